"""Packets in, decoded sets out; see FORMAT.md."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from mvcodec.array import Position
from mvcodec.container import McapReader
from mvcodec.errors import SettingError, StreamClosed, StreamError
from mvcodec.frames import DecodedSet, DisparityMap, Picture
from mvcodec.stream import Packet, StreamHeader, Track, TrackKind
from mvcodec.video.codec import Planes, VideoDecoder
from mvcodec.video.colour import even_size, to_picture
from mvcodec.video.disparity_code import dequantise
from mvcodec.video.table import find_codec

WORKERS = 2


class Decoder:
    """Decodes every track. The last packet of a frame set in, its decoded set out, at once.

    Either `push` packets into ``Decoder()``, or iterate over ``Decoder.open(source)``.
    Packets that come before the first header are dropped, so that a receiver can join late.
    """

    def __init__(self) -> None:
        self._header: StreamHeader | None = None
        self._decoders: dict[Track, VideoDecoder] = {}
        self._pending: dict[Track, Packet] = {}
        self._pool: ThreadPoolExecutor | None = ThreadPoolExecutor(WORKERS, "decode")
        self._reader: McapReader | None = None
        self._frames: slice | None = None
        self._name = "stream"

    @classmethod
    def open(cls, source: str | Path | BinaryIO, frames: slice | None = None) -> Decoder:
        """A decoder of a file, pipe or standard input, to iterate over.

        Args:
            source: path, or a binary file that may be a pipe and stays open.
            frames: Python slice over the frame sets that the file holds (from 0), step 1.

        Raises:
            InputError: the system refuses to open it.
            StreamError: not an MCAP file, none of ours, or one of a newer format version.
            SettingError (on iterating): the slice is empty.
        """
        decoder = cls()
        try:
            decoder._reader = McapReader.open(source)
            decoder._name = decoder._reader.name
            decoder._start(decoder._reader.header)
        except BaseException:
            decoder.close()
            raise
        decoder._frames = frames
        return decoder

    @property
    def header(self) -> StreamHeader:
        """The stream's header.

        Raises:
            StreamError: no header has come yet.
        """
        if self._header is None:
            raise StreamError(self._name, "no header yet", "a header before anything else")
        return self._header

    def __iter__(self) -> Iterator[DecodedSet]:
        """Decode the source given to `open`. A pipe can be gone through once only.

        Raises:
            StreamError: damage, with topic and time.
        """
        if self._reader is None:
            raise StreamError(self._name, "a decoder without a source", "Decoder.open(source)")
        self._start(self._reader.header)
        start, stop = self._reader.resolve(self._frames)
        number = -1
        for number, packet in self._reader.packets(start, stop):
            for decoded in self.push(packet):
                if number >= start:
                    yield decoded
        if self._pending and self._reader.frame_count is not None:  # else the end was cut off
            raise self._incomplete(next(iter(self._pending.values())))
        if number < start:
            raise SettingError(
                "frames", f"{start}:", f"less than the {number + 1} frame sets of {self._name}"
            )

    def push(self, packet: Packet) -> list[DecodedSet]:
        """Take a packet, in stream order; returns the decoded set that it completes, if it does.

        Raises:
            StreamError: damage, with topic and time.
            StreamClosed: after `flush`.
        """
        if self._pool is None:
            raise StreamClosed("the decoder was flushed; it takes no more packets")
        if packet.track.kind is TrackKind.HEADER:
            header = StreamHeader.from_json(packet.data, self._name)
            if header != self._header:
                self._start(header)
            return []
        if self._header is None:
            return []
        self._check(packet)
        self._pending[packet.track] = packet
        if len(self._pending) < len(self._decoders):
            return []
        packets, self._pending = self._pending, {}
        return [self._decode(packets)]

    def flush(self) -> list[DecodedSet]:
        """End the stream. Returns nothing, since no picture waits; `push` is an error from now on."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
        return []

    def close(self) -> None:
        """Flush, and close the source if `open` opened it."""
        self.flush()
        if self._reader is not None:
            self._reader.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _start(self, header: StreamHeader) -> None:
        """Begin at a keyframe, with fresh decoders."""
        try:
            codec = find_codec(header.codec)
        except SettingError as error:
            raise StreamError(self._name, f"codec {error.found}", error.expected) from None
        self._header = header
        self._decoders = {track: codec.decoder() for track in header.tracks}
        self._pending = {}

    def _check(self, packet: Packet) -> None:
        label = self._label(packet)
        if packet.track not in self._decoders:
            raise StreamError(label, "a track that the header does not name", "a real camera's")
        waiting = next(iter(self._pending.values()), None)
        if waiting is not None and waiting.index != packet.index:
            raise self._incomplete(waiting)
        if packet.track in self._pending:
            raise StreamError(label, "two packets of one frame set", "one")

    def _incomplete(self, waiting: Packet) -> StreamError:
        missing = next(track for track in self._decoders if track not in self._pending)
        label = self._label(replace(waiting, track=missing))
        return StreamError(label, "no packet", "one for each track of a frame set")

    def _label(self, packet: Packet) -> str:
        return f"{self._name}: {packet.track.topic} at {packet.time_ns / 1e9:.3f} s"

    def _decode(self, packets: dict[Track, Packet]) -> DecodedSet:
        assert self._pool is not None
        pictures: dict[Position, Future[Picture]] = {}
        maps: dict[Position, Future[DisparityMap]] = {}
        for track, packet in packets.items():
            assert track.camera is not None
            if track.kind is TrackKind.TEXTURE:
                pictures[track.camera] = self._pool.submit(self._picture, packet)
            else:
                maps[track.camera] = self._pool.submit(self._map, packet)
        array, first = self.header.array, next(iter(packets.values()))
        return DecodedSet(
            array=array,
            index=first.index,
            time_ns=first.time_ns,
            pictures={camera: pictures[camera].result() for camera in array.real},
            disparities={camera: maps[camera].result() for camera in array.real},
            disparity_range_px=self.header.disparity_range_px,
        )

    def _picture(self, packet: Packet) -> Picture:
        array = self.header.array
        return to_picture(self._planes(packet), array.width, array.height)

    def _map(self, packet: Packet) -> DisparityMap:
        header = self.header
        codes = self._planes(packet).y[: header.array.height, : header.array.width]
        return dequantise(codes, header.disparity_range_px)

    def _planes(self, packet: Packet) -> Planes:
        label, array = self._label(packet), self.header.array
        found = self._decoders[packet.track].push(packet.data, label)
        if len(found) != 1:
            raise StreamError(label, f"{len(found)} pictures in an access unit", "one")
        height, width = found[0].y.shape
        expected = even_size(array.width, array.height)
        if (width, height) != expected:
            raise StreamError(label, f"a picture of {width}x{height}", f"{expected[0]}x{expected[1]}")
        return found[0]

"""Packets -> one MCAP file that grows by whole chunks; see FORMAT.md."""

from __future__ import annotations

import io
import json
import os
import stat
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, BinaryIO, Self

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer

import mvcodec
from mvcodec.container import schemas
from mvcodec.container.chunks import METADATA_NAME, TOPICS_KEY
from mvcodec.errors import OutputError, SettingError, StreamClosed
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, TrackKind

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

CHUNK_MS = 500
"""The most stream time that a chunk holds by default, hence what a power cut can lose."""

MAX_CHUNK_MS = 60_000

FULL_CHUNK_BYTES = 1 << 26
"""A chunk ends when it holds so much, well below what readers take."""

LIBRARY = f"mvcodec {mvcodec.__version__}"


class McapWriter:
    """Writes packets into a file, from the first frame set on.

    Args:
        target: path, or an open binary file, which may be a pipe and stays open.
        chunk_ms: the most stream time that waits before it is written, 0..60000; with 0 each
            frame set is written at once.

    Raises (from `push` and `close`):
        SettingError (at once): chunk_ms is outside its range.
        OutputError: the system refuses to open or write.
    """

    def __init__(self, target: BinaryIO | Path, chunk_ms: int = CHUNK_MS) -> None:
        if not 0 <= chunk_ms <= MAX_CHUNK_MS:
            raise SettingError("chunk_ms", chunk_ms, f"0..{MAX_CHUNK_MS} ms")
        self._chunk_ns = chunk_ms * 1_000_000
        self._target = target
        self._name = str(target if isinstance(target, Path) else getattr(target, "name", "output"))
        self._file: io.BufferedWriter | None = None
        self._mcap: Writer | None = None
        self._channels: dict[str, int] = {}
        self._rig: tuple[schemas.RigMessage, ...] = ()
        self._video_topics: tuple[str, ...] = ()
        self._codec = ""
        self._chunk_start_ns: int | None = None
        self._chunk_bytes = 0
        self._closed = False
        self.frame_count = 0

    def push(self, packets: Sequence[Packet]) -> None:
        """Write one frame set's packets, as `Encoder.push` returns them (the header's first).

        Raises:
            StreamClosed: after `close`.
        """
        if self._closed:
            raise StreamClosed("the file was closed; it takes no more packets")
        try:
            mcap = self._mcap or self._start(packets[0])
            self._push(mcap, packets)
        except OSError as error:
            raise OutputError(self._name, error.strerror or error) from None

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record. Nothing is written where nothing was pushed."""
        if self._mcap is not None:
            self._mcap.add_metadata(name, dict(values))

    def close(self) -> None:
        """Complete the file with its summary. No file appears where nothing was pushed."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._mcap is not None:
                self._mcap.finish()  # type: ignore[no-untyped-call]
            if self._file is not None:
                self._file.close()  # a file that was handed in stays open: see _Pipe
        except OSError as error:
            raise OutputError(self._name, error.strerror or error) from None
        finally:
            if self._file is not None:
                # After a failure the buffer would be written again, and fail again, at exit.
                with suppress(OSError):
                    self._file.raw.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _push(self, mcap: Writer, packets: Sequence[Packet]) -> None:
        time_ns, keyframe = packets[0].time_ns, packets[0].track.kind is TrackKind.HEADER
        start = self._chunk_start_ns
        # A chunk starts at each keyframe, so that a reader reaches keyframes by the chunk index.
        if start is not None and (
            keyframe or time_ns - start >= self._chunk_ns or self._chunk_bytes >= FULL_CHUNK_BYTES
        ):
            self._end_chunk(mcap)
        if self._chunk_start_ns is None:
            self._chunk_start_ns = time_ns
        if keyframe and self.frame_count and self._joinable:
            mcap.add_metadata(METADATA_NAME, {TOPICS_KEY: self._topics()})
        for packet in packets:
            if packet.track.kind is TrackKind.HEADER:
                self._add(mcap, packet.track.topic, packet, packet.data)
                for message in self._rig:
                    self._add(mcap, message.topic, packet, message.at(time_ns))
            else:
                self._add(mcap, packet.track.topic, packet, schemas.video_message(packet, self._codec))
        self.frame_count += 1
        if not self._chunk_ns:
            self._end_chunk(mcap)

    def _end_chunk(self, mcap: Writer) -> None:
        """Write the chunk, and see that it outlasts a loss of power."""
        mcap.flush()  # type: ignore[no-untyped-call]
        self._chunk_start_ns, self._chunk_bytes = None, 0
        if isinstance(self._target, Path) and self._file is not None:
            descriptor = self._file.fileno()
            if stat.S_ISREG(os.fstat(descriptor).st_mode):
                os.fsync(descriptor)

    @property
    def _joinable(self) -> bool:
        """Whether somebody may begin to read in the middle: of a pipe."""
        return not isinstance(self._target, Path) and not self._target.seekable()

    def _topics(self) -> str:
        """Which topic each channel is, for readers that lack the first chunk, where channels are declared."""
        tracks = {HEADER_TRACK.topic, *self._video_topics}
        topics = {number: topic for topic, number in self._channels.items() if topic in tracks}
        return json.dumps(topics, separators=(",", ":"))

    def _add(self, mcap: Writer, topic: str, packet: Packet, data: bytes) -> None:
        self._chunk_bytes += len(data)
        mcap.add_message(self._channels[topic], packet.time_ns, data, packet.time_ns, sequence=packet.index)

    def _start(self, first: Packet) -> Writer:
        header = StreamHeader.from_json(first.data)
        self._codec, self._rig = header.codec, schemas.rig_messages(header.array)
        target = self._target
        self._file = target.open("wb") if isinstance(target, Path) else io.BufferedWriter(_Pipe(target))
        # Chunks end where `_push` says, never by size. Summary offsets are optional, and checkers
        # fault those of empty groups (a file without attachments).
        self._mcap = Writer(
            self._file,
            chunk_size=1 << 62,
            compression=CompressionType.ZSTD,
            use_summary_offsets=False,
            enable_data_crcs=True,
        )
        self._mcap.start(profile="", library=LIBRARY)
        self._register(self._mcap, header)
        self._mcap.add_metadata(METADATA_NAME, {"header": first.data.decode(), TOPICS_KEY: self._topics()})
        return self._mcap

    def _register(self, mcap: Writer, header: StreamHeader) -> None:
        schema = mcap.register_schema(
            schemas.HEADER_SCHEMA_NAME, SchemaEncoding.JSONSchema, schemas.HEADER_SCHEMA
        )
        topic = HEADER_TRACK.topic
        self._channels[topic] = mcap.register_channel(topic, MessageEncoding.JSON, schema)
        ids = {
            kind: mcap.register_schema(name, SchemaEncoding.Protobuf, data)
            for kind, (name, data) in schemas.PROTOBUF_SCHEMAS.items()
        }
        self._video_topics = tuple(track.topic for track in header.tracks)
        kinds = {message.topic: message.kind for message in self._rig}
        kinds.update(dict.fromkeys(self._video_topics, "video"))
        for topic, kind in kinds.items():
            self._channels[topic] = mcap.register_channel(topic, MessageEncoding.Protobuf, ids[kind])


class _Pipe(io.RawIOBase):
    """Any binary output with the `tell` that the MCAP library asks for; leaves the output open."""

    def __init__(self, output: BinaryIO) -> None:
        self._output = output
        self._written = 0

    def writable(self) -> bool:
        return True

    def write(self, data: ReadableBuffer, /) -> int:
        count = self._output.write(data)  # may be a part: io.BufferedWriter writes the rest
        self._written += count
        return count

    def tell(self) -> int:
        return self._written

    def flush(self) -> None:
        self._output.flush()

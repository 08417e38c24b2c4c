"""Packets in, decoded sets out; see FORMAT.md."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, Literal, get_args

from mvcodec import workers
from mvcodec.array import Position
from mvcodec.closing import Closing
from mvcodec.container import McapReader
from mvcodec.container.assembly import Assembler, PacketSet
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.decoding.decoded_set import SetMaker
from mvcodec.decoding.enhanced_views import EnhancedViews, WaitingSet
from mvcodec.decoding.estimated_maps import (
    decoding_matcher,
)
from mvcodec.decoding.kept_memory import keep_freed_memory
from mvcodec.decoding.pipeline import DecodedTracks, Pipeline
from mvcodec.decoding.tracks import Tracks
from mvcodec.enhancement import LAYER_TRACK, EnhancementHeader
from mvcodec.errors import MvCodecWarning, SettingError, StreamClosed, StreamError
from mvcodec.frames import DecodedSet
from mvcodec.settings import Setting
from mvcodec.stereo.matcher import Matcher
from mvcodec.stream import Packet, StreamHeader, TrackKind, view_name
from mvcodec.workers import check_threads

OnError = Literal["skip", "stop"]
ON_ERROR = Setting(
    "on_error",
    str,
    "stop",
    "at damage: go on with the next keyframe, or stop",
    choices=get_args(OnError),
)

AHEAD = 1
"""Frame sets that are begun behind the one that comes out, where several threads decode a whole file."""


class Decoder(Closing):
    """Decodes every track. The last packet of a frame set in, its decoded set out, at once.

    Either `push` packets into ``Decoder()``, or iterate over ``Decoder.open(source)``.
    Packets that come before the first header are dropped, so that a receiver can join late.

    Missing cameras, frame sets out of order and times given twice are told by an MvCodecWarning;
    the cameras that are there go on. A camera that missed a picture comes back with a keyframe.

    Args:
        on_error: at damage, ``stop``: raise StreamError; ``skip``: warn, and go on with the next keyframe.
        limits: what is more than that is refused.
        matcher: estimates the maps of a stream that holds none, by name or one's own; by default the one
            that the stream's settings name. It runs when the first map of a frame set is looked at.
        enhanced: virtual views that are decoded out of the stream's enhancement layer, if it has them; by
            default none, None: all. What is decoded is `DecodedSet.enhanced`. The attribute of this name may
            be changed; others are decoded from the next keyframe on.
        name: what messages call the stream.
        threads: how many decode at once; by default as set for the process. It changes no picture.

    Raises:
        SettingError: another policy, or (where a stream needs it) no matcher of that name.
    """

    def __init__(
        self,
        on_error: OnError = "stop",
        limits: Limits = DEFAULT_LIMITS,
        matcher: str | Matcher | None = None,
        name: str = "stream",
        threads: int | None = None,
        enhanced: Collection[Position] | None = (),
    ) -> None:
        ON_ERROR.check(on_error)
        self._on_error, self._limits, self._asked_matcher = on_error, limits, matcher
        self._maker: SetMaker | None = None
        self._header: StreamHeader | None = None
        self._tracks = Tracks()
        self._absent: frozenset[Position] = frozenset()
        self._skipping = False
        check_threads(threads)
        keep_freed_memory()
        self._threads, self._open = threads, True
        self._reader: McapReader | None = None
        self._frames: slice | None = None
        self._name = name
        self._assembler = Assembler(self._name, _warn)
        self._pipeline = Pipeline(self._tracks, self._assembler.label)
        self.enhanced = enhanced
        self._layer: EnhancedViews | None = None
        self._waiting: WaitingSet | None = None
        self._with_layer, self._ahead = False, 0

    @classmethod
    def open(
        cls,
        source: str | Path | BinaryIO,
        frames: slice | None = None,
        on_error: OnError = "stop",
        limits: Limits = DEFAULT_LIMITS,
        matcher: str | Matcher | None = None,
        threads: int | None = None,
        enhanced: Collection[Position] | None = (),
    ) -> Decoder:
        """A decoder of a file, pipe or standard input, to iterate over.

        Args:
            source: path, URL of a file on a web server, or a binary file that may be a pipe and stays open.
            frames: Python slice over the frame sets that the file holds (from 0), step 1.
            on_error, limits, matcher, threads, enhanced: as the constructor's.

        Raises:
            InputError: the system refuses to open it.
            StreamError: not an MCAP file, none of ours, or one of a newer format version.
            SettingError (on iterating): the slice is empty.
        """
        decoder = cls(on_error, limits, matcher, threads=threads, enhanced=enhanced)
        try:
            on_damage = _warn if on_error == "skip" else None
            decoder._with_layer = decoder._wants_layer
            decoder._reader = McapReader.open(source, limits, on_damage, layer=decoder._with_layer)
            decoder._name = decoder._reader.name
            decoder._assembler = Assembler(decoder._name, _warn)
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

    @property
    def enhancing(self) -> frozenset[Position]:
        """The views of the enhancement layer that are decoded since the last keyframe."""
        return frozenset() if self._layer is None else self._layer.views

    @property
    def bytes_read(self) -> int:
        """Bytes taken from the source given to `open` so far."""
        return 0 if self._reader is None else self._reader.bytes_read

    @property
    def bytes(self) -> int:
        """Bytes of the source given to `open`; of a pipe, what was read so far."""
        return 0 if self._reader is None else self._reader.size

    def __iter__(self) -> Iterator[DecodedSet]:
        """Decode the source given to `open`. A pipe can be gone through once only.

        With several threads the frame sets after the one that comes out are decoded meanwhile, if the source
        is a whole file and no enhanced views are wanted.

        Raises:
            StreamError: damage, with topic and time.
        """
        if self._reader is None:
            raise StreamError(self._name, "a decoder without a source", "Decoder.open(source)")
        # A whole file has what comes next at hand, so that tracks need not wait for each other.
        with workers.threads(self._threads):
            several = workers.thread_count() > 1
        ahead = several and self._reader.complete and self._on_error == "stop" and not self._with_layer
        self._ahead = AHEAD if ahead else 0
        self._start(self._reader.header)
        start, stop = self._reader.resolve(self._frames)
        number, numbers = -1, dict[int, int]()
        try:
            for number, packet in self._reader.packets(start, stop):
                if packet.index not in numbers:
                    # A frame set comes out while the one after those begun behind it is read, at the latest.
                    numbers = dict([*numbers.items()][-AHEAD - 1 :]) | {packet.index: number}
                # Before the header is pushed, so that none is lost with an error of a later one.
                if packet.track.kind is TrackKind.HEADER:
                    begun = self._finish_begun()
                    yield from (each for each in begun if numbers.get(each.index, number) >= start)
                for decoded in self.push(packet):
                    if numbers.get(decoded.index, number) >= start:
                        yield decoded
            if not self._reader.cut_off:
                rest = self._decode_all(self._assembler.flush())
                yield from (each for each in rest if numbers.get(each.index, number) >= start)
        except Exception:  # of what comes after the frame sets that were begun
            yield from (each for each in self._finish_begun() if numbers.get(each.index, number) >= start)
            raise
        finally:
            self._ahead = 0
        if number >= start:
            yield from self._finish_begun()
            yield from self._release()
        if number < start:
            raise SettingError(
                "frames", f"{start}:", f"less than the {number + 1} frame sets of {self._name}"
            )

    def push(self, packet: Packet) -> list[DecodedSet]:
        """Take a packet, in stream order; returns the decoded set that it completes, if it does.

        Where packets are missing, the set is complete when the next one begins. Tracks that decoding has no
        use for, such as depth and cameras that the header does not name, are ignored.

        Raises:
            StreamError: damage, with topic and time.
            StreamClosed: after `flush`.
        """
        if not self._open:
            raise StreamClosed("the decoder was flushed; it takes no more packets")
        if packet.track.kind is TrackKind.HEADER:
            return self._push_header(packet)
        if packet.track.kind in (TrackKind.LAYER, TrackKind.ENHANCED):
            return self._push_layer(packet)
        if packet.track not in self._tracks or self._skipping:
            return []
        try:
            sets = self._assembler.push(packet)
        except StreamError as error:
            self._skip(error)
            return []
        return self._decode_all(sets)

    def flush(self) -> list[DecodedSet]:
        """End the stream. Returns what waits for missing packets; `push` is an error from now on."""
        done = [*self._decode_all(self._assembler.flush()), *self._release()] if self._open else []
        self._end()
        return done

    def close(self) -> None:
        """End the stream, and close the source if `open` opened it."""
        self._end()
        if self._reader is not None:
            self._reader.close()

    def _end(self) -> None:
        self._open = False

    def _push_header(self, packet: Packet) -> list[DecodedSet]:
        """A keyframe begins, where all that was lost is found again."""
        done = [*self._decode_all(self._assembler.push(packet)), *self._finish_begun(), *self._release()]
        header = StreamHeader.from_json(packet.data, self._name)
        if header != self._header:
            self._start(header)
        self._skipping = False
        return done

    def _start(self, header: StreamHeader) -> None:
        """Begin at a keyframe, with fresh decoders."""
        self._limits.check_header(header, self._name)
        tracks = Tracks(header, self._name)
        estimates = header.estimates_maps
        self._maker = SetMaker(header, decoding_matcher(header, self._asked_matcher) if estimates else None)
        self._header = header
        self._tracks = tracks
        self._assembler.start(header.tracks)
        self._absent, self._skipping = frozenset(), False
        self._layer = None
        # Predictions are made out of pictures of the same time.
        self._pipeline = Pipeline(tracks, self._assembler.label, 0 if header.predicted else self._ahead)

    @property
    def _wants_layer(self) -> bool:
        return self.enhanced is None or bool(self.enhanced)

    def _push_layer(self, packet: Packet) -> list[DecodedSet]:
        """A packet of the enhancement layer; returns the frame set that it completes."""
        if self._header is None:
            return []
        if packet.track == LAYER_TRACK:
            self._begin_layer(packet)
            return []
        waiting = self._waiting
        if self._layer is None or waiting is None or packet.index != waiting.decoded.index:
            return []
        waiting.packets[packet.track] = packet
        return self._release() if self._layer.tracks <= waiting.packets.keys() else []

    def _begin_layer(self, packet: Packet) -> None:
        """A keyframe of the enhancement layer, where views can be joined and left."""
        if not self._wants_layer:
            self._layer = None
            return
        layer = EnhancementHeader.from_json(packet.data, self.header, self._assembler.label(packet))
        found = self._layer
        if found is None or (found.layer, found.wanted) != (layer, self.enhanced):
            self._layer = EnhancedViews(self.header, layer, self.enhanced, _warn)

    def _release(self) -> list[DecodedSet]:
        """The frame set that waits for its enhanced views, with those that came."""
        waiting, self._waiting = self._waiting, None
        if waiting is None or self._layer is None:
            return [] if waiting is None else [waiting.decoded]
        with workers.threads(self._threads):
            return [self._layer.finish(waiting, self._assembler.label)]

    def _decode_all(self, sets: list[PacketSet]) -> list[DecodedSet]:
        done = []
        for packets in sets:
            done += self._release()
            try:
                with workers.threads(self._threads):
                    done += [found for each in self._pipeline.push(packets) for found in self._finish(each)]
            except StreamError as error:
                self._skip(error)
        return done

    def _skip(self, error: StreamError) -> None:
        """Go on with the next keyframe, if that is wanted."""
        if self._on_error == "stop":
            raise error
        _warn(error)
        self._assembler.drop()
        self._skipping = True

    def _finish_begun(self) -> Iterator[DecodedSet]:
        """The frame sets that were begun ahead, one by one."""
        while self._pipeline:
            with workers.threads(self._threads):
                done = self._finish(self._pipeline.pop())
            yield from done

    def _finish(self, tracks: DecodedTracks) -> list[DecodedSet]:
        """The decoded set; nothing, where no map can be had of any camera that is there."""
        self._tell_absent(tracks.reasons, tracks.first)
        decoded = None if self._maker is None else self._maker.make(tracks)
        if decoded is None:
            return []
        if self._layer is None or not self._layer.tracks:
            return [decoded]
        self._waiting = WaitingSet(decoded, tracks.planes, tracks.first, {})
        return []

    def _tell_absent(self, reasons: Mapping[Position, StreamError], first: Packet) -> None:
        for camera in sorted(reasons.keys() - self._absent):
            _warn(reasons[camera], f"; the others go on without camera {view_name(camera)}")
        for camera in sorted(self._absent - reasons.keys()):
            text = f"{self._name}: camera {view_name(camera)} is back at {first.time_ns / 1e9:.3f} s"
            warnings.warn(text, MvCodecWarning, stacklevel=2)
        self._absent = frozenset(reasons)


def _warn(error: StreamError, more: str = "") -> None:
    warnings.warn(f"{error}{more}", MvCodecWarning, stacklevel=3)

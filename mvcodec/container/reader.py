"""One MCAP file or stream -> packets, in order, with bounded memory; see FORMAT.md."""

from __future__ import annotations

import re
import warnings
from bisect import bisect_right
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import BinaryIO

from mcap.records import Message

from mvcodec.closing import Closing
from mvcodec.container import schemas
from mvcodec.container.chunk_reading import EXPECTED, ChunkReader, OnDamage, TopicMessage
from mvcodec.container.declared import DROPPED_KEY
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.remote import is_url, open_url
from mvcodec.enhancement import LAYER_TRACK
from mvcodec.errors import InputError, MvCodecWarning, SettingError, StreamError
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track, TrackKind

_OPTIONAL = (TrackKind.DEPTH, TrackKind.ENHANCED)


class McapReader(Closing):
    """Reads the packets of a file or stream.

    A complete file is read by its index: a range of frames costs only the chunks that hold it.
    Anything else (a pipe, a file cut short) is read from front to back, once; where it breaks off,
    every complete frame set is delivered and then one MvCodecWarning says at what time.

    Args:
        file: binary input, which may be a pipe; it stays open.
        name: what to call it in messages.
        limits: what is more than that is refused.
        on_damage: told of damage, behind which reading goes on with the next keyframe; None raises it.
        layer: deliver the enhancement layer too, if there is one.
        depth: deliver depth too, which no decoder needs; a damaged image is told and left out.

    Raises:
        StreamError: not an MCAP file, none of ours, or one of a newer format version.
    """

    def __init__(
        self,
        file: BinaryIO,
        name: str = "input",
        limits: Limits = DEFAULT_LIMITS,
        on_damage: OnDamage | None = None,
        *,
        depth: bool = False,
        layer: bool = False,
    ) -> None:
        self.name = name
        self._limits = limits
        self._owned: BinaryIO | None = None
        self._on_damage = on_damage
        self._gap = False
        self._known_times: dict[str, list[int]] = {}
        self._chunks = ChunkReader(file, name, limits, None if on_damage is None else self._skip)
        if self._chunks.indexed and HEADER_TRACK.topic not in self._chunks.topics:
            raise self._headless()
        self._rest = self._chunks.chunks()
        self._first: list[TopicMessage] | None = None
        self.header = StreamHeader.from_json(self._first_header().data, name)
        limits.check_header(self.header, name)
        depths = [Track(TrackKind.DEPTH, camera) for camera in self.header.array.real] if depth else []
        views = self.header.array.positions if layer else ()
        enhanced = [LAYER_TRACK, *(Track(TrackKind.ENHANCED, view) for view in views)] if layer else []
        self._tracks = {
            track.topic: track for track in (HEADER_TRACK, *self.header.tracks, *depths, *enhanced)
        }

    @classmethod
    def open(
        cls,
        source: str | Path | BinaryIO,
        limits: Limits = DEFAULT_LIMITS,
        on_damage: OnDamage | None = None,
        *,
        depth: bool = False,
        layer: bool = False,
    ) -> McapReader:
        """Open a path or the URL of a file on a web server, or take a binary file or pipe.

        Raises:
            InputError: the system refuses to open it.
            StreamError: as the constructor.
        """
        if not isinstance(source, str | Path):
            name = str(getattr(source, "name", "input"))
            return cls(source, name, limits, on_damage, depth=depth, layer=layer)
        try:
            file = open_url(str(source)) if is_url(str(source)) else Path(source).open("rb")  # noqa: SIM115
        except IsADirectoryError:
            expected = "an MCAP file, which `mvcodec encode` makes of an array folder"
            raise InputError(source, "a folder", expected) from None
        except OSError as error:
            raise InputError(source, error.strerror, "a file that can be read") from None
        try:
            reader = cls(file, str(source), limits, on_damage, depth=depth, layer=layer)
        except BaseException:
            file.close()
            raise
        reader._owned = file
        return reader

    @property
    def bytes_read(self) -> int:
        """Bytes taken from the input so far."""
        return self._chunks.bytes_read

    @property
    def cut_off(self) -> bool:
        """Whether the input broke off, which is known when `packets` has ended."""
        return self._chunks.cut_off

    @property
    def size(self) -> int:
        """Bytes of the input: a file's size; of a pipe, what was read so far."""
        return self._chunks.size

    @property
    def complete(self) -> bool:
        """Whether it is a whole file with its index, not a pipe nor one that was cut short or still grows."""
        return self._chunks.indexed

    @property
    def has_layer(self) -> bool:
        """Whether a complete file has an enhancement layer; of others, whether one was met so far."""
        return LAYER_TRACK.topic in self._chunks.topics

    @property
    def dropped(self) -> int | None:
        """Frame sets that a live encoder left out; None where nothing is said, or not yet."""
        said = self._chunks.facts().get(DROPPED_KEY, "")
        return int(said) if re.fullmatch(r"[0-9]{1,18}", said) else None

    @property
    def frame_count(self) -> int | None:
        """The frame sets of a complete file; None for a pipe or a file cut short."""
        return len(self._times(self.header.tracks[0])) if self._chunks.indexed else None

    def frame_times(self) -> tuple[list[int], list[int]] | None:
        """Times of a complete file's frame sets and of its keyframes, ns, ascending; else None.

        Raises:
            StreamError: the index is damaged.
        """
        if not self._chunks.indexed:
            return None
        return self._times(self.header.tracks[0]), self._times(HEADER_TRACK)

    def resolve(self, frames: slice | None) -> tuple[int, int | None]:
        """The first frame set of a Python slice over the file's, and the one after its last.

        The end is None where it is the input's and its length is unknown.

        Raises:
            SettingError: the slice is empty, has a step, or counts from an unknown end.
        """
        if frames is None:
            return 0, None
        text = ":".join("" if end is None else str(end) for end in (frames.start, frames.stop))
        if frames.step not in (None, 1):
            raise SettingError("frames", f"{text}:{frames.step}", "A:B, in steps of 1")
        count = self.frame_count
        start, stop = frames.start or 0, frames.stop
        if count is not None:
            start, stop, _ = frames.indices(count)
        elif start < 0 or (stop is not None and stop < 0):
            raise SettingError("frames", text, "counts from the start, since this input's length is unknown")
        if stop is not None and start >= stop:
            held = "" if count is None else f" of the {count} in {self.name}"
            raise SettingError("frames", text, f"at least one frame set{held}")
        return start, stop

    def packets(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, Packet]]:
        """The packets, each with the number of its frame set in this file (from 0).

        They begin with the keyframe at or before frame set `start` and end before `stop`. An input
        without an index can be gone through once only, and always from its first keyframe.

        Raises:
            StreamError: damage.
        """
        chunks, first_ns, number = self._rest, 0, -1
        if self._chunks.indexed:
            self._gap = False
            first_ns, number = self._keyframe_before(start)
            chunks = self._from_chunk(self._chunks.chunk_at(first_ns), self._time_of(stop))
        index = self.header.first_frame + number
        last: Packet | None = None
        keyframe = False
        for topic, message in chain.from_iterable(map(self._whole_sets, chunks)):
            track = self._tracks.get(topic)
            if track is None or message.log_time < first_ns or (self._gap and track is not HEADER_TRACK):
                continue
            if last is None or message.sequence != index:
                # Numbers go on by one, but over a gap by what is missing.
                number += max(message.sequence - index, 1) if self._gap else 1
                index, keyframe, self._gap = message.sequence, track is HEADER_TRACK, False
                if stop is not None and number >= stop:
                    return
            try:
                last = self._packet(track, message, keyframe)
            except StreamError as error:
                if self._on_damage is None:
                    raise
                self._on_damage(error)
                continue
            yield number, last
        if self._chunks.cut_off:
            self._warn_of_cut(last)

    def close(self) -> None:
        """Close the file if it was opened here."""
        if self._owned is not None:
            self._owned.close()

    def _from_chunk(self, number: int, end_ns: int | None) -> Iterator[list[TopicMessage]]:
        """The chunks of an indexed file from one on; the first is at hand once: it has the header."""
        first, self._first = self._first, None
        if number > 0 or first is None:
            return self._chunks.chunks(number, end_ns)
        return chain([first], self._chunks.chunks(1, end_ns))

    def _first_header(self) -> Message:
        """The first header's message; what was read with it stays to be read."""
        for number, chunk in enumerate(self._rest):
            for position, (topic, message) in enumerate(chunk):
                if topic == HEADER_TRACK.topic:
                    self._limits.check("max_header_bytes", len(message.data), f"{self.name}: header bytes")
                    if not self._chunks.indexed:
                        remaining: list[TopicMessage] = chunk[position:]
                        self._rest = chain([remaining], self._rest)
                    elif number == 0 and not self._gap:
                        self._first = chunk
                    return message
        raise self._headless()

    def _skip(self, error: StreamError) -> None:
        self._gap = True
        assert self._on_damage is not None
        self._on_damage(error)

    def _whole_sets(self, chunk: list[TopicMessage]) -> list[TopicMessage]:
        """A chunk's messages, without those of a frame set that breaks off at its end."""
        if not (self._chunks.partial and chunk):
            return chunk
        index = chunk[-1][1].sequence
        there = {topic for topic, message in chunk if message.sequence == index}
        optional = {track.topic for track in self._tracks.values() if track.kind in _OPTIONAL}
        with_keyframes = {HEADER_TRACK.topic, LAYER_TRACK.topic}
        due = self._tracks.keys() - with_keyframes - (optional - self._chunks.topics)
        if due <= there:
            return chunk
        return [(topic, message) for topic, message in chunk if message.sequence != index]

    def _warn_of_cut(self, last: Packet | None) -> None:
        if last is None:
            raise self._cut_before()
        text = f"{self.name}: cut off after {last.time_ns / 1e9:.3f} s; all before that is whole"
        warnings.warn(text, MvCodecWarning, stacklevel=3)

    def _cut_before(self) -> StreamError:
        return StreamError(self.name, "a file cut off before its first frame set ended", EXPECTED)

    def _headless(self) -> StreamError:
        if self._chunks.cut_off:
            return self._cut_before()
        topics = ", ".join(sorted(self._chunks.topics)[:5]) or "none"
        return StreamError(self.name, f"MCAP without {HEADER_TRACK.topic} (topics: {topics})", EXPECTED)

    def _packet(self, track: Track, message: Message, keyframe: bool) -> Packet:
        data = message.data
        source = f"{self.name}: {track.topic} at {message.log_time / 1e9:.3f} s"
        if track.camera is None:
            self._limits.check("max_header_bytes", len(data), f"{self.name}: header bytes")
        elif track.kind is TrackKind.DEPTH:
            data = schemas.depth_data(data, source, self.header.array.width, self.header.array.height)
        else:
            data = schemas.video_data(data, source, schemas.video_format(track, self.header.codec))
        return Packet(track, message.sequence, message.log_time, keyframe, data)

    def _time_of(self, number: int | None) -> int | None:
        """Time of a frame set, ns; None for one that is not there."""
        if number is None:
            return None
        times = self._times(self.header.tracks[0])
        return times[number] if number < len(times) else None

    def _keyframe_before(self, start: int) -> tuple[int, int]:
        """Time of the keyframe at or before a frame set, ns, and the number of the set before it."""
        if start == 0:
            return 0, -1
        times, keys = self._times(self.header.tracks[0]), self._times(HEADER_TRACK)
        key_ns = keys[max(bisect_right(keys, times[start]) - 1, 0)]
        return key_ns, bisect_right(times, key_ns) - 2

    def _times(self, track: Track) -> list[int]:
        if track.topic not in self._known_times:
            self._known_times[track.topic] = self._chunks.times(track.topic)
        return self._known_times[track.topic]

"""One MCAP file or stream -> packets, in order, with bounded memory; see FORMAT.md."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from mcap.records import Message

from mvcodec.container import schemas
from mvcodec.container.chunks import EXPECTED, ChunkReader, TopicMessage
from mvcodec.errors import InputError, SettingError, StreamError
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track


class McapReader:
    """Reads the packets of a file or stream.

    A complete file is read by its index: a range of frames costs only the chunks that hold it.
    Anything else (a pipe, a file cut short) is read from front to back, once; where it breaks off,
    every complete chunk is delivered and then one MvCodecWarning says at what time.

    Args:
        file: binary input, which may be a pipe; it stays open.
        name: what to call it in messages.

    Raises:
        StreamError: not an MCAP file, none of ours, or one of a newer format version.
    """

    def __init__(self, file: BinaryIO, name: str = "input") -> None:
        self.name = name
        self._owned: BinaryIO | None = None
        self._chunks = ChunkReader(file, name)
        if self._chunks.indexed and HEADER_TRACK.topic not in self._chunks.topics:
            raise self._headless()
        self._rest = self._chunks.chunks()
        self.header = StreamHeader.from_json(self._first_header().data, name)
        self._tracks = {track.topic: track for track in (HEADER_TRACK, *self.header.tracks)}

    @classmethod
    def open(cls, source: str | Path | BinaryIO) -> McapReader:
        """Open a path, or take a binary file or pipe.

        Raises:
            InputError: the system refuses to open it.
            StreamError: as the constructor.
        """
        if not isinstance(source, str | Path):
            return cls(source, str(getattr(source, "name", "input")))
        try:
            file = Path(source).open("rb")  # noqa: SIM115 - `close` closes it
        except OSError as error:
            raise InputError(source, error.strerror, "a file that can be read") from None
        try:
            reader = cls(file, str(source))
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
    def size(self) -> int:
        """Bytes of the input: a file's size; of a pipe, what was read so far."""
        return self._chunks.size

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
            first_ns, number = self._keyframe_before(start)
            chunks = self._chunks.chunks(self._chunks.chunk_at(first_ns))
        index, keyframe = None, False
        for topic, message in chain.from_iterable(chunks):
            track = self._tracks.get(topic)
            if track is None or message.log_time < first_ns:
                continue
            if message.sequence != index:
                index, number, keyframe = message.sequence, number + 1, track is HEADER_TRACK
                if stop is not None and number >= stop:
                    return
            yield number, self._packet(track, message, keyframe)

    def close(self) -> None:
        """Close the file if it was opened here."""
        if self._owned is not None:
            self._owned.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _first_header(self) -> Message:
        """The first header's message; what was read with it stays to be read."""
        for chunk in self._rest:
            for position, (topic, message) in enumerate(chunk):
                if topic == HEADER_TRACK.topic:
                    remaining: list[TopicMessage] = chunk[position:]
                    self._rest = chain([remaining], self._rest)
                    return message
        raise self._headless()

    def _headless(self) -> StreamError:
        topics = ", ".join(sorted(self._chunks.topics)[:5]) or "none"
        return StreamError(self.name, f"MCAP without {HEADER_TRACK.topic} (topics: {topics})", EXPECTED)

    def _packet(self, track: Track, message: Message, keyframe: bool) -> Packet:
        data = message.data
        if track is not HEADER_TRACK:
            source = f"{self.name}: {track.topic} at {message.log_time / 1e9:.3f} s"
            data = schemas.video_data(data, source, self.header.codec)
        return Packet(track, message.sequence, message.log_time, keyframe, data)

    def _keyframe_before(self, start: int) -> tuple[int, int]:
        """Time of the keyframe at or before a frame set, ns, and the number of the set before it."""
        if start == 0:
            return 0, -1
        times, keys = self._times(self.header.tracks[0]), self._times(HEADER_TRACK)
        key_ns = keys[max(bisect_right(keys, times[start]) - 1, 0)]
        return key_ns, bisect_right(times, key_ns) - 2

    def _times(self, track: Track) -> list[int]:
        return self._chunks.times(track.topic)

"""Where the frame sets and keyframes of a file are, without decoding any."""

from __future__ import annotations

import warnings
from bisect import bisect_right
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mvcodec.array import Position
from mvcodec.container import McapReader
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.enhancement import LAYER_TRACK, EnhancementHeader
from mvcodec.errors import MvCodecWarning, StreamError
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader


@dataclass(frozen=True, slots=True)
class FrameTable:
    """The frame sets of a file, by number from 0.

    Attributes:
        header: the first one.
        times_ns: capture time of each frame set, ascending.
        keyframes: frame numbers where decoding can start, ascending; the first is 0.
        cut_off: what is wrong with the end of the file, or None.
        enhanced: the views of its enhancement layer; none where it has no layer.
    """

    header: StreamHeader
    times_ns: tuple[int, ...]
    keyframes: tuple[int, ...]
    cut_off: str | None = None
    enhanced: frozenset[Position] = frozenset()

    @property
    def count(self) -> int:
        """How many frame sets there are."""
        return len(self.times_ns)

    def keyframe_before(self, frame: int) -> int:
        """The keyframe at or before a frame."""
        return self.keyframes[bisect_right(self.keyframes, frame) - 1]

    def keyframe_after(self, frame: int) -> int:
        """The first keyframe behind a frame; the number of frame sets where there is none."""
        place = bisect_right(self.keyframes, frame)
        return self.keyframes[place] if place < len(self.keyframes) else self.count


def read_frame_table(source: str | Path | BinaryIO, limits: Limits = DEFAULT_LIMITS) -> FrameTable:
    """Read a file's index; where it has none (it was cut off), the whole file.

    Raises:
        InputError: the system refuses to open it.
        StreamError: not a file of ours, or no frame set in it.
    """
    with McapReader.open(source, limits, layer=True) as reader:
        indexed = reader.frame_times()
        if indexed is None:
            return _scan(reader)
        times, keys = indexed
        if not times:
            raise StreamError(reader.name, "no frame set", "at least one")
        keyframes = {max(bisect_right(times, key) - 1, 0) for key in keys}
        enhanced: frozenset[Position] = frozenset()
        if reader.has_layer:
            # Damage in the first frame set is told to who decodes it.
            with suppress(StreamError):
                enhanced = _views_of(reader, (packet for _, packet in reader.packets(0, 1)))
        return FrameTable(reader.header, tuple(times), tuple(sorted(keyframes | {0})), enhanced=enhanced)


def _views_of(reader: McapReader, packets: Iterable[Packet]) -> frozenset[Position]:
    for packet in packets:
        if packet.track == LAYER_TRACK:
            layer = EnhancementHeader.from_json(packet.data, reader.header, reader.name)
            return frozenset(each.view for each in layer.views)
    return frozenset()


def _scan(reader: McapReader) -> FrameTable:
    times: list[int] = []
    keyframes: list[int] = []
    cut_off, enhanced = None, frozenset[Position]()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MvCodecWarning)
        try:
            for number, packet in reader.packets():
                if packet.track == HEADER_TRACK:
                    keyframes.append(number)
                enhanced = enhanced or _views_of(reader, [packet])
                if number == len(times):
                    times.append(packet.time_ns)
        except StreamError as error:
            if not times:
                raise
            cut_off = str(error)
    for warning in caught:
        cut_off = cut_off or str(warning.message)
    if not times:
        raise StreamError(reader.name, "no frame set", "at least one")
    return FrameTable(reader.header, tuple(times), tuple(keyframes), cut_off, enhanced)

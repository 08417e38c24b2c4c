"""Segments of one stream, coded each for itself, to one file. Nothing is coded again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import BinaryIO

from mvcodec.container.declared import DROPPED_KEY
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.reader import McapReader
from mvcodec.container.writer import McapWriter
from mvcodec.errors import StreamError
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader


@dataclass(frozen=True, slots=True)
class _Part:
    """What a part says before its packets are read: its header, its span of time, what was left out."""

    name: str
    header: StreamHeader
    start_ns: int
    end_ns: int
    dropped: int | None


def join(parts: Sequence[str | Path], target: BinaryIO | Path, limits: Limits = DEFAULT_LIMITS) -> int:
    """Write the frame sets of several files, one after the other, into one.

    Args:
        parts: paths or URLs of complete files of one encoding, in order of time.
        target: as `McapWriter` takes it. Nothing is written before all parts are known to fit.
        limits: as `McapReader` takes them.

    Returns:
        The frame sets of the new file.

    Raises:
        InputError: a part cannot be opened.
        StreamError: a part is damaged or cut off, was coded otherwise than the first one, or does not begin
            after the end of the one before it.
        OutputError: the system refuses to write.
    """
    known: list[_Part] = []
    for part in parts:
        known.append(_examined(part, limits))
        _check(known[-1], known[0], known[-2] if len(known) > 1 else None)
    header = known[0].header
    with McapWriter(target) as writer:
        for part in parts:
            with McapReader.open(part, limits, depth=True, layer=True) as reader:
                for packets in _frame_sets(reader, header):
                    writer.push(packets)
        left_out = [part.dropped for part in known if part.dropped is not None]
        if left_out:
            writer.note({DROPPED_KEY: str(sum(left_out))})
        return writer.frame_count


def _examined(part: str | Path, limits: Limits) -> _Part:
    with McapReader.open(part, limits) as reader:
        times = reader.frame_times()
        if times is None or not times[0]:
            raise StreamError(
                reader.name, "a file without an index", "a complete one (see `mvcodec recover`)"
            )
        return _Part(reader.name, reader.header, times[0][0], times[0][-1], reader.dropped)


def _check(part: _Part, first: _Part, before: _Part | None) -> None:
    """Raise StreamError where a part does not fit behind the ones before it."""
    mine = replace(part.header, first_frame=first.header.first_frame)
    for name in StreamHeader.__slots__:
        found, expected = getattr(mine, name), getattr(first.header, name)
        if found != expected:
            raise StreamError(part.name, f"{name} {found}", f"{expected}, as {first.name} has it")
    if before is not None and part.start_ns <= before.end_ns:
        starts = f"a start at {part.start_ns / 1e9:.3f} s"
        expected = f"one after {before.end_ns / 1e9:.3f} s, where {before.name} ends"
        raise StreamError(part.name, starts, expected)


def _frame_sets(reader: McapReader, header: StreamHeader) -> Iterator[list[Packet]]:
    """The packets of each frame set; all headers of the new file say the same."""
    data = header.to_json()
    for _, packets in groupby(reader.packets(), key=lambda item: item[0]):
        yield [
            replace(packet, data=data) if packet.track == HEADER_TRACK else packet for _, packet in packets
        ]

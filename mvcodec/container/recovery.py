"""What can be read of a damaged or unfinished file -> a clean one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

from mvcodec.container.assembly import Assembler, PacketSet
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.reader import McapReader
from mvcodec.container.writer import McapWriter
from mvcodec.errors import StreamError
from mvcodec.stream import Packet, StreamHeader


@dataclass(frozen=True, slots=True)
class Recovered:
    """What `recover` did.

    Attributes:
        frames: frame sets in the new file.
        dropped: frame sets that were read but left out: incomplete, or built on one that is missing.
    """

    frames: int
    dropped: int


def recover(
    source: str | Path | BinaryIO,
    target: BinaryIO | Path,
    tell: Callable[[StreamError], None],
    limits: Limits = DEFAULT_LIMITS,
) -> Recovered:
    """Copy every complete frame set that can be decoded; the video is copied, not coded again.

    Args:
        tell: takes each damage found.

    Raises:
        InputError: the source cannot be opened.
        StreamError: there is no complete frame set in it.
        OutputError: the system refuses to write.
    """
    with McapReader.open(source, limits, tell) as reader, McapWriter(target) as writer:
        assembler = Assembler(reader.name, tell)
        assembler.start(reader.header.tracks)
        copier = _Copier(reader.header, writer, tell, assembler.label)
        for _, packet in reader.packets():
            for found in assembler.push(packet):
                copier.push(found)
        if not reader.cut_off:
            for found in assembler.flush():
                copier.push(found)
        if not writer.frame_count:
            raise StreamError(reader.name, "no complete frame set", "one at least")
    return Recovered(writer.frame_count, copier.dropped)


class _Copier:
    """Writes the frame sets that a decoder can decode. All headers of the new file say the same."""

    def __init__(
        self,
        header: StreamHeader,
        writer: McapWriter,
        tell: Callable[[StreamError], None],
        label: Callable[[Packet], str],
    ) -> None:
        self._header, self._writer, self._tell, self._label = header, writer, tell, label
        self._last: Packet | None = None
        self._waits = True
        self.dropped = 0

    def push(self, found: PacketSet) -> None:
        first = found.first
        in_order = self._last is None or first.time_ns > self._last.time_ns
        if found.missing or not in_order:
            if found.missing:
                label = self._label(replace(first, track=found.missing[0]))
                self._tell(StreamError(label, "no packet", "one for each track of a frame set"))
            self._waits = True
        elif found.header is not None:
            self._waits = False
        if self._waits:
            self.dropped += 1
            return
        packets = [found.packets[track] for track in self._header.tracks]
        if found.header is not None:
            if self._last is None and first.index != self._header.first_frame:
                self._header = replace(self._header, first_frame=first.index)
            packets.insert(0, replace(found.header, data=self._header.to_json()))
        self._writer.push(packets)
        self._last = first

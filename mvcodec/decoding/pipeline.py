"""Frame sets on their way through their tracks' decoders, some begun behind the one that comes out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mvcodec.array import Position
from mvcodec.container.assembly import PacketSet
from mvcodec.decoding.tracks import Tracks
from mvcodec.errors import StreamError
from mvcodec.stream import Packet, Track
from mvcodec.video.codec import Planes
from mvcodec.workers import Job


@dataclass(frozen=True, slots=True, eq=False)
class DecodedTracks:
    """What came of the packets of a frame set.

    Attributes:
        first: a packet of it, which has its index and time.
        planes: by track, those that are there.
        reasons: of each camera that something is missing of, what.
    """

    first: Packet
    planes: Mapping[Track, Planes]
    reasons: Mapping[Position, StreamError]


@dataclass(frozen=True, slots=True, eq=False)
class _Begun:
    packets: PacketSet
    jobs: dict[Track, Job[Planes | None]]


class Pipeline:
    """Decodes frame sets in order; each track goes on with its next picture while others are behind.

    Args:
        tracks: of the stream, with fresh decoders.
        label: what to call a packet in an error.
        ahead: how many frame sets are begun behind the one that comes out.
    """

    def __init__(self, tracks: Tracks, label: Callable[[Packet], str], ahead: int = 0) -> None:
        self._tracks, self._label, self._ahead = tracks, label, ahead
        self._begun = deque[_Begun]()

    def __len__(self) -> int:
        return len(self._begun)

    def push(self, packets: PacketSet) -> list[DecodedTracks]:
        """Begin a frame set; returns the one that comes out for it, if one does.

        Raises:
            StreamError: that one is damaged; what was begun behind it is dropped.
        """
        before = self._begun[-1].jobs if self._begun else {}
        self._begun.append(_Begun(packets, self._tracks.begin(packets, self._label, before)))
        return [self.pop()] if len(self._begun) > self._ahead else []

    def pop(self) -> DecodedTracks:
        """The first frame set that was begun, of at least one.

        Raises:
            StreamError: as `push`.
        """
        begun = self._begun.popleft()
        self._work_off(begun)
        try:
            planes, reasons = self._tracks.finish(begun.packets, begun.jobs, self._label)
        except StreamError:
            self._begun.clear()
            raise
        return DecodedTracks(begun.packets.first, planes, reasons)

    def _work_off(self, first: _Begun) -> None:
        """Decode what nobody has begun of a frame set; while others are at its last, what is behind it."""
        for job in reversed(first.jobs.values()):
            job.begin()
        before = first.jobs
        for behind in self._begun:
            for track, job in behind.jobs.items():
                if all(each.done for each in first.jobs.values()):
                    return
                if before[track].done:
                    job.begin()
            before = behind.jobs

"""Gaps in the times of videos whose codec does not say whether pictures are missing there."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from statistics import median
from typing import Any, Literal, get_args

from mvcodec.capture.pairing import typical_step_ns
from mvcodec.settings import setting

Gaps = Literal["lost", "pause"]
"""What a gap in time is: lost pictures, on which later ones may build, or a time without any."""

BEHIND_GAP = (
    "after a gap in time they may build on a picture that is missing, which their codec does not tell;"
    " `gaps` pause takes them"
)

_GAP_STEPS = 1.5
"""Of the usual time from picture to picture."""

_IRREGULAR, _RARE_SHARE = 0.5, 0.25
"""Where more than that share of all steps differs from the usual one by more than that part of it, the rate
is a variable one."""

_REMEMBERED = 31
_KNOWN_STEPS = 3


def gaps_field() -> Any:
    """The field of every settings class that has a meaning of gaps."""
    return setting(
        None,
        "what a gap in time is in a video whose codec does not tell whether pictures are missing (VP8, VP9,"
        " MPEG-4 and others): lost ones, so that all up to the next keyframe is left out, or a pause"
        " (default: lost where gaps are rare)",
        choices=get_args(Gaps),
    )


@dataclass(frozen=True, slots=True)
class TimedPacket:
    """A picture in coding order.

    Attributes:
        time: when it is shown, in any unit.
        keyframe: decoding can start here.
    """

    time: int
    keyframe: bool


def behind_gaps(packets: Sequence[TimedPacket], reordered: bool, gaps: Gaps | None) -> tuple[set[int], int]:
    """Which pictures may build on missing ones, by their place; and the gaps that are taken for pauses.

    Args:
        reordered: pictures are shown in another order than coded: what is missing may have been coded
            anywhere between two keyframes.
        gaps: what they are; None: lost pictures where they are rare.
    """
    times = sorted(packet.time for packet in packets)
    usual = typical_step_ns(times)
    found = [(a, b) for a, b in pairwise(times) if b - a > _GAP_STEPS * usual]
    groups: list[int] = []
    begin: dict[int, int] = {}
    for packet in packets:
        groups.append((groups[-1] if groups else 0) + packet.keyframe)
        if packet.keyframe:
            begin[groups[-1]] = packet.time
    group_of = {packet.time: group for packet, group in zip(packets, groups, strict=True)}
    keys = {packet.time for packet in packets if packet.keyframe}
    risky = [(a, b) for a, b in found if reordered or b not in keys]
    if gaps == "pause" or (gaps is None and _is_variable([b - a for a, b in pairwise(times)], usual)):
        return set(), len(risky)
    unsure_from: dict[int, float] = {}
    for a, b in risky:
        for group in {group_of[a], group_of[b]} if reordered else {group_of[b]}:
            unsure_from[group] = min(unsure_from.get(group, inf), -inf if reordered else b)

    def is_unsure(packet: TimedPacket, group: int) -> bool:
        leads = packet.time < begin.get(group, packet.time)  # it builds on the group before
        return packet.time >= unsure_from.get(group, inf) or (leads and group - 1 in unsure_from)

    places = enumerate(zip(packets, groups, strict=True))
    return {n for n, (packet, group) in places if not packet.keyframe and is_unsure(packet, group)}, 0


class GapWatch:
    """Follows the times of one video as its pictures come, in the order in which they are shown.

    Args:
        gaps: what gaps are; None: lost pictures where they are rare.
    """

    def __init__(self, gaps: Gaps | None) -> None:
        self._gaps = gaps
        self._last: int | None = None
        self._steps: deque[int] = deque(maxlen=_REMEMBERED)

    def push(self, time_ns: int) -> bool:
        """Whether a picture may build on one that is missing before it."""
        last, self._last = self._last, time_ns
        if last is None or time_ns <= last:
            return False
        step = time_ns - last
        usual = median(self._steps) if len(self._steps) >= _KNOWN_STEPS else inf
        self._steps.append(step)
        if step <= _GAP_STEPS * usual or self._gaps == "pause":
            return False
        return self._gaps == "lost" or not _is_variable(self._steps, usual)


def _is_variable(steps: Collection[int], usual: float) -> bool:
    irregular = sum(abs(step - usual) > _IRREGULAR * usual for step in steps)
    return irregular > max(1, _RARE_SHARE * len(steps))

"""Which pictures of several cameras belong together: those that were taken at one time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from mvcodec.array import Position
from mvcodec.errors import SettingError

NEAREST_SHARE = 0.5
"""Of the shortest time from picture to picture: the next one would be nearer beyond that."""

TOLD_SHARE = 0.1
"""Of the same: cameras that are further apart all the time are told."""

MAX_TOLERANCE_MS = 10_000.0
_LISTED = 4


@dataclass(frozen=True, slots=True)
class Pairing:
    """The frame sets of an array.

    Attributes:
        times_ns: of each frame set: when the camera with the fewest pictures took its own.
        numbers: of each view, the number of its picture in each frame set; ascending.
        notes: what was left out and what does not fit, one line each.
    """

    times_ns: tuple[int, ...]
    numbers: Mapping[Position, tuple[int, ...]]
    notes: tuple[str, ...] = ()


def pair_pictures(
    times_ns: Mapping[Position, Sequence[int]],
    names: Mapping[Position, str],
    tolerance_ms: float | None = None,
) -> Pairing:
    """Put pictures of one time together; what has no counterpart in every view is left out.

    Each picture of the view with the fewest pictures in the common time span gets the nearest one of
    every other view.

    Args:
        times_ns: of every picture, strictly ascending, on a clock that all views share.
        names: what to call the views in notes.
        tolerance_ms: how far apart pictures of one frame set may be taken; None: half of the
            shortest time from picture to picture.

    Returns:
        A pairing, which may hold no frame set.

    Raises:
        SettingError: a tolerance outside of 0..10000 ms.
    """
    if tolerance_ms is not None and not 0 <= tolerance_ms <= MAX_TOLERANCE_MS:
        raise SettingError("tolerance_ms", tolerance_ms, f"0..{MAX_TOLERANCE_MS:g} ms")
    first = next(iter(times_ns))
    if all(tuple(times) == tuple(times_ns[first]) for times in times_ns.values()):
        everything = tuple(range(len(times_ns[first])))
        return Pairing(tuple(times_ns[first]), dict.fromkeys(times_ns, everything))
    steps = [step for times in times_ns.values() if (step := typical_step_ns(times))]
    shortest = min(steps, default=0)
    tolerance = round(NEAREST_SHARE * shortest if tolerance_ms is None else tolerance_ms * 1e6)
    start = max(times[0] for times in times_ns.values()) - tolerance
    stop = min(times[-1] for times in times_ns.values()) + tolerance
    within = {view: _within(times, start, stop) for view, times in times_ns.items()}
    lead = min(within, key=lambda view: len(within[view]))
    found = {
        view: _nearest([times_ns[lead][number] for number in within[lead]], times_ns[view], tolerance)
        for view in times_ns
    }
    whole = [
        index for index in range(len(within[lead])) if all(numbers[index] >= 0 for numbers in found.values())
    ]
    numbers = {view: tuple(found[view][index] for index in whole) for view in times_ns}
    notes = [
        *_span_notes(times_ns, within, names),
        *_gap_notes(within, numbers, names, tolerance),
        *_offset_notes(times_ns, numbers, names, shortest),
    ]
    return Pairing(tuple(times_ns[lead][number] for number in numbers[lead]), numbers, tuple(notes))


def typical_step_ns(times_ns: Sequence[int]) -> int:
    """The median time from picture to picture, which no pause changes; 0 for fewer than two pictures."""
    steps = sorted(after - before for before, after in pairwise(times_ns))
    return steps[len(steps) // 2] if steps else 0


def _within(times: Sequence[int], start: int, stop: int) -> range:
    return range(bisect_left(times, start), bisect_left(times, stop + 1))


def _nearest(wanted: Sequence[int], times: Sequence[int], tolerance: int) -> list[int]:
    """For each wanted time the number of the nearest picture, each used once; -1 where none is near."""
    found = []
    last = -1
    for time in wanted:
        after = bisect_left(times, time)
        near = [n for n in (after - 1, after) if last < n < len(times) and abs(times[n] - time) <= tolerance]
        best = min(near, key=lambda n: abs(times[n] - time), default=-1)
        found.append(best)
        last = max(last, best)
    return found


def _span_notes(
    times: Mapping[Position, Sequence[int]], within: Mapping[Position, range], names: Mapping[Position, str]
) -> list[str]:
    outside = {view: len(times[view]) - len(within[view]) for view in times}
    if not any(outside.values()):
        return []
    late = max(times, key=lambda view: times[view][0])
    early = min(times, key=lambda view: times[view][-1])
    begin, end = times[late][0] / 1e9, times[early][-1] / 1e9
    if begin > end:
        return [
            f"{names[early]} ends at {end:.3f} s, before {names[late]} begins at {begin:.3f} s;"
            " `offsets_ms` CAMERA=MS shifts a camera's clock"
        ]
    most = max(outside, key=lambda view: outside[view])
    return [
        f"the cameras' common time is {begin:.3f} s, where {names[late]} begins, to {end:.3f} s,"
        f" where {names[early]} ends; what lies outside is left out,"
        f" up to {outside[most]} pictures (of {names[most]})"
    ]


def _gap_notes(
    within: Mapping[Position, range],
    numbers: Mapping[Position, Sequence[int]],
    names: Mapping[Position, str],
    tolerance: int,
) -> list[str]:
    alone = {names[view]: len(within[view]) - len(numbers[view]) for view in within}
    worst = sorted((name for name in alone if alone[name] > 0), key=lambda name: -alone[name])
    if not worst:
        return []
    listed = ", ".join(f"{alone[name]} of {name}" for name in worst[:_LISTED])
    return [
        f"pictures without a counterpart within {tolerance / 1e6:.4g} ms in every other camera are left out:"
        f" {listed}{' ...' * (len(worst) > _LISTED)}"
    ]


def _offset_notes(
    times: Mapping[Position, Sequence[int]],
    numbers: Mapping[Position, Sequence[int]],
    names: Mapping[Position, str],
    step: int,
) -> list[str]:
    """Cameras whose pictures come at other times than the first one's, which no pairing mends."""
    first = next(iter(times))
    for view in times:
        apart = sorted(
            times[view][ours] - times[first][theirs]
            for ours, theirs in zip(numbers[view], numbers[first], strict=True)
        )
        if not apart or max(-apart[0], apart[-1]) <= TOLD_SHARE * step:
            continue
        middle, spread = apart[len(apart) // 2], apart[-1] - apart[0]
        if spread <= TOLD_SHARE * step:
            when = "after" if middle > 0 else "before"
            return [
                f"{names[view]} takes its pictures {abs(middle) / 1e6:.4g} ms {when} {names[first]} all the"
                f" time, {abs(middle) / step:.2f} of a frame: what moves is seen at two places"
            ]
        return [
            f"pictures of {names[view]} and {names[first]} in one frame set are up to"
            f" {max(-apart[0], apart[-1]) / 1e6:.4g} ms apart; `tolerance_ms` leaves out those further apart"
        ]
    return []

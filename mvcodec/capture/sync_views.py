"""Offsets of the cameras of an array against the first one, by `sync`."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

from mvcodec.array import Position
from mvcodec.capture.pairing import typical_step_ns
from mvcodec.capture.sync import (
    LEAST_LIKENESS,
    MAX_PICTURES,
    MIN_STEPS,
    Motion,
    motion_of,
    motion_offset_ns,
    sound_of,
    sound_offset_ns,
)
from mvcodec.capture.view_array import ViewReader
from mvcodec.errors import InputError, MvCodecWarning
from mvcodec.workers import run_all


def synchronised(
    views: Mapping[Position, ViewReader],
    times_ns: Mapping[Position, Sequence[int]],
    names: Mapping[Position, str],
    sync: str,
) -> dict[Position, int]:
    """What to add to each view's times, ns; what was found is a warning.

    Args:
        times_ns: of every picture of each view, on a clock of its own.
        names: what to call the views in messages.
        sync: ``motion`` or ``audio``.

    Raises:
        InputError: nothing tells how far a camera's clock is apart.
    """
    first, *others = views
    offsets = {first: 0}
    if sync == "motion":
        motions = run_all(_motion, views.values(), [times_ns[v] for v in views], [names[v] for v in views])
        signals = dict(zip(views, motions, strict=True))
        found = {view: motion_offset_ns(signals[first], signals[view]) for view in others}
    else:
        sounds = dict(zip(views, run_all(lambda view: sound_of(view.path), views.values()), strict=True))
        found = {view: sound_offset_ns(sounds[first], sounds[view]) for view in others}
    for view, (offset_ns, likeness) in found.items():
        if likeness < LEAST_LIKENESS:
            what = f"nothing in common with {names[first]} to tell the time by (correlation {likeness:.2f})"
            raise InputError(names[view], what, "the same scene that changes, or `offsets_ms` CAMERA=MS")
        offsets[view] = round(offset_ns)
        step = typical_step_ns(times_ns[view])
        if step and abs(offset_ns) > 0.02 * step:
            text = (
                f"by {sync}, {names[view]} is {-offset_ns / 1e6:.1f} ms ahead of {names[first]}"
                f" (correlation {likeness:.2f}): that is taken back"
            )
            warnings.warn(text, MvCodecWarning, stacklevel=4)
    return offsets


def _motion(view: ViewReader, times_ns: Sequence[int], name: str) -> Motion:
    count = min(len(times_ns), MAX_PICTURES)
    motion = motion_of(view.readable(range(count), lambda _: None), times_ns)
    if len(motion.times_ns) < MIN_STEPS:
        found = f"{len(motion.times_ns) + 1} pictures"
        raise InputError(name, found, f"{MIN_STEPS + 1} or more, for sync motion")
    if motion.is_still:
        raise InputError(name, "pictures in which nothing moves", "some motion, or `offsets_ms` CAMERA=MS")
    return motion

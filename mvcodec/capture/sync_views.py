"""Offsets of the cameras of an array against the first one, by `sync`."""

from __future__ import annotations

import warnings
from collections.abc import Hashable, Mapping, Sequence
from typing import TypeVar

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

Camera = TypeVar("Camera", bound=Hashable)


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
    if sync == "motion":
        motions = run_all(_motion, views.values(), [times_ns[v] for v in views])
        return offsets_by_motion(dict(zip(views, motions, strict=True)), times_ns, names)
    first, *others = views
    sounds = dict(zip(views, run_all(lambda view: sound_of(view.path), views.values()), strict=True))
    found = {view: sound_offset_ns(sounds[first], sounds[view]) for view in others}
    return {first: 0} | _told(found, times_ns, names, names[first], sync)


def offsets_by_motion(
    motions: Mapping[Camera, Motion], times_ns: Mapping[Camera, Sequence[int]], names: Mapping[Camera, str]
) -> dict[Camera, int]:
    """What to add to the times of cameras whose motion is known, ns; see `synchronised`."""
    for camera, motion in motions.items():
        if len(motion.times_ns) < MIN_STEPS:
            count = f"{len(motion.times_ns) + 1} pictures"
            raise InputError(names[camera], count, f"{MIN_STEPS + 1} or more, for sync motion")
        if motion.is_still:
            what = "pictures in which nothing moves"
            raise InputError(names[camera], what, "some motion, or `offsets_ms` CAMERA=MS")
    first, *others = motions
    found = {camera: motion_offset_ns(motions[first], motions[camera]) for camera in others}
    return {first: 0} | _told(found, times_ns, names, names[first], "motion")


def _told(
    found: Mapping[Camera, tuple[float, float]],
    times_ns: Mapping[Camera, Sequence[int]],
    names: Mapping[Camera, str],
    first: str,
    sync: str,
) -> dict[Camera, int]:
    """Offsets in whole ns, which are told; those that nothing tells are an error."""
    for camera, (offset_ns, likeness) in found.items():
        if likeness < LEAST_LIKENESS:
            what = f"nothing in common with {first} to tell the time by (correlation {likeness:.2f})"
            raise InputError(names[camera], what, "the same scene that changes, or `offsets_ms` CAMERA=MS")
        step = typical_step_ns(times_ns[camera])
        if step and abs(offset_ns) > 0.02 * step:
            text = (
                f"by {sync}, {names[camera]} is {-offset_ns / 1e6:.1f} ms ahead of {first}"
                f" (correlation {likeness:.2f}): that is taken back"
            )
            warnings.warn(text, MvCodecWarning, stacklevel=5)
    return {camera: round(offset_ns) for camera, (offset_ns, _) in found.items()}


def _motion(view: ViewReader, times_ns: Sequence[int]) -> Motion:
    return motion_of(view.readable(range(min(len(times_ns), MAX_PICTURES)), lambda _: None), times_ns)

"""Cameras of a rig that are late or early by whole frames, told by what moves in their pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from mvcodec.array import Position
from mvcodec.capture.source import ArraySource
from mvcodec.capture.sync import FLOW_SIZE, MIN_STEPS, Motion, lag_of, motion_of
from mvcodec.frames import Picture
from mvcodec.rigs.features import neighbours
from mvcodec.workers import run_all

MOST_PICTURES = 30
"""Of each camera that are looked at."""

_SURE_LIKENESS = 0.4
_SURE_GAIN = 0.03
"""How much likelier than none a delay must be."""

_FEWEST_CAMERAS = 4
_MOST_SHARE = 0.25
"""Of the cameras that may be late. What passes by is seen by one column after the other: that is no delay."""


@dataclass(frozen=True, slots=True)
class Delay:
    """A camera that shows things later than most of the others do.

    Attributes:
        camera: its place on the grid.
        frames: how many frames later; below 0 it is early.
        offset_ms: what its times would need to be added.
    """

    camera: Position
    frames: int
    offset_ms: float


def find_delays(source: ArraySource, chosen: range) -> list[Delay]:
    """Cameras that are not in step with the others, as far as the pictures show beyond doubt.

    Every pair of neighbours must tell the same: where nothing moves, where there are too few pictures or
    cameras, or where pairs contradict each other, nothing is claimed.

    Args:
        source: the input, all of whose cameras are looked at.
        chosen: frame numbers, of which the first ones are.
    """
    stop = min(chosen.stop, chosen.start + MOST_PICTURES)
    cameras = source.array.positions
    small: dict[Position, list[Picture]] = {camera: [] for camera in cameras}
    times: list[int] = []
    for frame_set in source.frame_sets(slice(chosen.start, stop), cameras):
        times.append(frame_set.time_ns)
        for camera, pictures in small.items():
            copy = cv2.resize(frame_set.pictures[camera], FLOW_SIZE, interpolation=cv2.INTER_AREA)
            pictures.append(np.asarray(copy, np.uint8))
    if len(times) <= MIN_STEPS or len(cameras) < _FEWEST_CAMERAS:
        return []
    # Frames, not times: what belongs together is what is asked.
    step_ns = float(np.median(np.diff(times)))
    even = [round(number * step_ns) for number in range(len(times))]
    found = run_all(lambda camera: motion_of(small[camera], even), cameras)
    late = late_frames(dict(zip(cameras, found, strict=True)))
    return [Delay(camera, frames, -frames * step_ns / 1e6) for camera, frames in late.items() if frames]


def late_frames(motions: Mapping[Position, Motion]) -> dict[Position, int]:
    """How many frames each camera is later than most are; nothing where that is not sure.

    Args:
        motions: of each camera, all at the same even times.
    """
    if any(motion.is_still for motion in motions.values()):
        return {}
    first, *others = motions
    pairs = dict.fromkeys([(first, other) for other in others] + neighbours(list(motions)))
    lags = {}
    for one, other in pairs:
        lag = lag_of(motions[one], motions[other])
        whole = round(lag.steps)
        if lag.likeness < _SURE_LIKENESS or (whole and lag.likeness < lag.unmoved + _SURE_GAIN):
            return {}
        lags[one, other] = -whole
    late = {first: 0} | {other: lags[first, other] for other in others}
    if any(late[other] - late[one] != lag for (one, other), lag in lags.items()):
        return {}
    usual = Counter(late.values()).most_common(1)[0][0]
    found = {camera: frames - usual for camera, frames in late.items()}
    return found if sum(map(bool, found.values())) <= _MOST_SHARE * len(found) else {}

"""How far apart cameras should be averaged, measured from what they say of the same surfaces.

What a camera contributes to a view is wrong by noise (the sensor's and the coding's), the same from
everywhere, and by a misplacement that grows with its distance b to the view: noise + placement * b^2.
Weights inverse to that, 1 / (spread + b^2) with spread = noise / placement, are the best for independent
errors. Two cameras that see the same surface differ by 2 * noise + placement * b^2, which cameras side
by side (b = 1 cell) and across a cell (b^2 = 2) tell apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position, Viewpoint
from mvcodec.frames import DecodedSet
from mvcodec.workers import run_all

FALLBACK = 0.4
"""Where cameras stand in one line, which can't tell noise from misplacement."""

FACTOR, POWER = 0.6, 1.5
"""The spread is FACTOR * (noise / placement)^POWER: 1 and 1 by the reasoning above, but errors are not quite
independent. Fitted to the best spreads of antinous and the shop sets, uncoded, and of shop_v3 and v4, coded.
"""

LEAST, MOST = 0.05, 1.5
SAME_SURFACE_PX = 1.0
OUTLIER = 30.0
"""Differences count as at most this many times their median."""
LEAST_MEDIAN = 1.0
"""Grey levels that counts as at least: it is 0 where pictures are plain, and edges would not count then."""

SAMPLES = 10_000
"""Pixels of each picture, about."""

FEWEST = 100
"""Pixels that two cameras must share for their difference to count."""

MOST_PAIRS = 6
"""Pairs of cameras of each kind that are asked."""

Pair = tuple[Position, Position]


def measure_spread(decoded: DecodedSet) -> float:
    """The spread at which this array's cameras are best averaged, in squared cells, LEAST..MOST.

    FALLBACK where no two cameras across a cell share enough of the scene.
    """
    pairs_beside, pairs_across = _pairs(decoded)
    cameras = {camera for pair in pairs_beside + pairs_across for camera in pair}
    lumas = dict(zip(cameras, run_all(partial(_luma, decoded), cameras), strict=True))
    beside = _mean_difference(decoded, lumas, pairs_beside)
    across = _mean_difference(decoded, lumas, pairs_across)
    if beside is None or across is None:
        return FALLBACK
    placement = across - beside
    noise = (beside - placement) / 2
    if placement <= 0:
        return MOST
    ratio = max(noise / placement, 0.0)
    return float(min(max(FACTOR * ratio**POWER, LEAST), MOST))


def _pairs(decoded: DecodedSet) -> tuple[list[Pair], list[Pair]]:
    """Some neighbours side by side, and some across a cell."""
    array = decoded.array
    beside: list[Pair] = []
    across: list[Pair] = []
    for one, other in combinations(sorted(decoded.pictures), 2):
        down, right = other[0] - one[0], abs(other[1] - one[1])
        if down <= array.row_step and right <= array.col_step:
            (across if down and right else beside).append((one, other))
    return _some(beside), _some(across)


def _some(pairs: list[Pair]) -> list[Pair]:
    """MOST_PAIRS of them, spread evenly."""
    return pairs[:: -(-len(pairs) // MOST_PAIRS) or 1]


def _luma(decoded: DecodedSet, camera: Position) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(decoded.pictures[camera], cv2.COLOR_RGB2GRAY), np.uint8)


def _mean_difference(
    decoded: DecodedSet, lumas: Mapping[Position, NDArray[np.uint8]], pairs: Sequence[Pair]
) -> float | None:
    found = run_all(lambda pair: _difference(decoded, lumas, *pair), pairs)
    known = [value for value in found if value is not None]
    return float(np.mean(known)) if known else None


def _difference(
    decoded: DecodedSet, lumas: Mapping[Position, NDArray[np.uint8]], one: Position, other: Position
) -> float | None:
    """Mean square of the luma difference on surfaces that both see, less a difference in brightness."""
    array = decoded.array
    step = max(1, round((array.height * array.width / SAMPLES) ** 0.5))
    disparity = decoded.disparities[one].values_px[::step, ::step]
    by_x, by_y = array.shift_per_disparity(one, Viewpoint(*other))
    x = np.arange(0, array.width, step, dtype=np.float32)[None] - np.float32(by_x) * disparity
    y = np.arange(0, array.height, step, dtype=np.float32)[:, None] - np.float32(by_y) * disparity
    there = cv2.remap(decoded.disparities[other].values_px, x, y, cv2.INTER_NEAREST)
    seen = (x >= 1) & (y >= 1) & (x < array.width - 2) & (y < array.height - 2)
    seen &= np.abs(there - disparity) < SAME_SURFACE_PX
    if np.count_nonzero(seen) < FEWEST:
        return None
    fetched = cv2.remap(lumas[other], x, y, cv2.INTER_CUBIC).astype(np.float32)
    difference = (fetched - lumas[one][::step, ::step])[seen]
    size = np.abs(difference - np.median(difference))
    most = OUTLIER * max(float(np.median(size)), LEAST_MEDIAN) + 1
    return float(np.mean(np.minimum(size, most) ** 2))

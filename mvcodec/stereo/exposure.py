"""How much brighter one camera of an array shows the scene than another, channel by channel.

Cameras that expose for themselves differ by a factor (of the coded values too, which are a power of the
light). It is measured on small copies of the pictures, where places that are confirmed by another
camera's map show the same surface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import FloatMap, Mask, Picture
from mvcodec.workers import run_all

SMALL_WIDTH = 160
"""Width of the small copies, px, about."""

LEAST_DIFFERENCE = 0.04
"""Smaller differences than this (of the logarithm) are not told from what the measurement leaves."""

DARKEST, BRIGHTEST = 2, 250
"""Values outside are cut off: they follow no factor."""

FEWEST = 100
"""Pixels that two cameras must share for their ratio to count."""

SAME_SURFACE_PX = 1.0

Matches = Callable[
    [CameraArray, Mapping[Position, Picture], tuple[float, float]],
    tuple[Mapping[Position, FloatMap], Mapping[Position, Mask]],
]


@dataclass(frozen=True, slots=True, eq=False)
class _Ratio:
    """log(other / one), float64 (3,), of two cameras."""

    one: Position
    other: Position
    logs: NDArray[np.float64]


def camera_gains(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    range_px: tuple[float, float],
    match: Matches,
) -> dict[Position, NDArray[np.float32]]:
    """What to multiply each camera's channels with, so that all show the scene equally bright.

    Args:
        array: the geometry.
        pictures: uint8 (H, W, 3) of every real camera.
        range_px: (lo, hi) of the disparity, px.
        match: gives the small pictures' disparities, and where another camera confirms them.

    Returns:
        float32 (3,) for each real camera, of geometric mean 1 over them; all 1 where no two
        cameras differ by more than `LEAST_DIFFERENCE`.
    """
    ones = {camera: np.ones(3, np.float32) for camera in array.real}
    every = max(1, round(array.width / SMALL_WIDTH))
    small = replace(array, width=max(array.width // every, 1), height=max(array.height // every, 1))
    made = run_all(lambda camera: _shrunk(pictures[camera], small, every), array.real)
    shrunk = dict(zip(array.real, made, strict=True))
    maps, confirmed = match(small, shrunk, (range_px[0] / every, range_px[1] / every))
    ratios = _ratios(small, shrunk, maps, confirmed)
    if not ratios:
        return ones
    logs = _solved(array.real, ratios)
    if np.max(np.ptp(logs, axis=0)) <= LEAST_DIFFERENCE:
        return ones
    return {camera: np.exp(-log).astype(np.float32) for camera, log in zip(array.real, logs, strict=True)}


def _shrunk(picture: Picture, small: CameraArray, every: int) -> Picture:
    kept = picture[: small.height * every, : small.width * every]
    size = small.width, small.height
    return np.asarray(cv2.resize(kept, size, interpolation=cv2.INTER_AREA), np.uint8)


def _ratios(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    maps: Mapping[Position, FloatMap],
    confirmed: Mapping[Position, Mask],
) -> list[_Ratio]:
    """Of every two neighbours in a row or a column that share enough."""
    pairs = [
        (one, other)
        for one in array.real
        for other in ((one[0], one[1] + array.col_step), (one[0] + array.row_step, one[1]))
        if other != one and other in pictures
    ]

    def logs_of(pair: tuple[Position, Position]) -> NDArray[np.float64] | None:
        one, other = pair
        return _logs(array, one, other, pictures, maps, confirmed[one])

    logs = run_all(logs_of, pairs)
    return [_Ratio(*pair, found) for pair, found in zip(pairs, logs, strict=True) if found is not None]


def _logs(
    array: CameraArray,
    one: Position,
    other: Position,
    pictures: Mapping[Position, Picture],
    maps: Mapping[Position, FloatMap],
    confirmed: Mask,
) -> NDArray[np.float64] | None:
    """log(other / one) of each channel. A ratio of sums: the logarithm of noise is not without bias."""
    by_x, by_y = array.shift_per_disparity(one, Viewpoint(*other))
    disparity = maps[one]
    x = np.arange(array.width, dtype=np.float32)[None] - np.float32(by_x) * disparity
    y = np.arange(array.height, dtype=np.float32)[:, None] - np.float32(by_y) * disparity
    there = cv2.remap(maps[other], x, y, cv2.INTER_NEAREST)
    same = confirmed & (np.abs(there - disparity) <= SAME_SURFACE_PX)
    same &= (x >= 0) & (y >= 0) & (x <= array.width - 1) & (y <= array.height - 1)
    here = pictures[one][same].astype(np.float64)
    seen = cv2.remap(pictures[other], x, y, cv2.INTER_LINEAR)[same].astype(np.float64)
    fair = ((np.minimum(here, seen) >= DARKEST) & (np.maximum(here, seen) <= BRIGHTEST)).all(axis=1)
    if np.count_nonzero(fair) < FEWEST:
        return None
    return np.asarray(np.log(seen[fair].sum(axis=0) / here[fair].sum(axis=0)))


def _solved(cameras: Sequence[Position], ratios: Sequence[_Ratio]) -> NDArray[np.float64]:
    """(cameras, 3): the logarithms that explain the ratios best, of mean 0."""
    equations = np.zeros((len(ratios), len(cameras)))
    for row, ratio in enumerate(ratios):
        equations[row, cameras.index(ratio.one)] = -1
        equations[row, cameras.index(ratio.other)] = 1
    # Of all solutions the shortest: its mean is 0, and cameras that nothing tells about stay at 0.
    solution = np.linalg.lstsq(equations, np.stack([ratio.logs for ratio in ratios]), rcond=None)[0]
    return np.asarray(solution)

"""Depth Image Layers Separation: the thesis's split of a disparity map, and a finer one.

Thesis 4.3.2.1 - 4.3.2.3 (equations 4.8 - 4.12). Disparities are rounded to whole px (halves up) first,
since the thesis's histogram counts whole disparities.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import MAX_PICTURE_SIDE
from mvcodec.frames import DisparityMap, LayerStack, Mask

THRESHOLD = 20
"""T of equation 4.9, pixels."""

Bounds = tuple[tuple[int, int], ...]
"""(d_min, d_max) of each layer, px, inclusive, farthest first."""


def split(disparity: DisparityMap, threshold: int = THRESHOLD) -> LayerStack:
    """The thesis's split: each run of frequent disparities is a layer (equations 4.8 - 4.12).

    Args:
        disparity: float32 (H, W) px; invalid pixels are occluded.
        threshold: T; a disparity counts when more than this many valid pixels have it.

    Returns:
        Layers, farthest first. ``labels == i`` is the mask M_i of equation 4.11, ``labels == 0`` the occluded
        pixels (4.12): the invalid ones and those whose disparity lies in no layer.
    """
    levels, usable = whole_disparities(disparity)
    lowest, counts = histogram(levels, usable)
    bounds = tuple((lowest + first, lowest + last) for first, last in runs(counts > threshold))
    return label(levels, usable, bounds)


def split_levels(disparity: DisparityMap, threshold: int = THRESHOLD) -> LayerStack:
    """A layer for each frequent whole disparity: the same histogram, no runs joined.

    The thesis's runs merge on real scenes, and one rigid shift does not fit a layer that is 40 px deep.
    Arguments and result as in `split`.
    """
    levels, usable = whole_disparities(disparity)
    lowest, counts = histogram(levels, usable)
    frequent = np.flatnonzero(counts > threshold) + lowest
    return label(levels, usable, tuple((int(level), int(level)) for level in frequent))


def whole_disparities(disparity: DisparityMap) -> tuple[NDArray[np.int32], Mask]:
    """int32 (H, W) disparities rounded to whole px, and bool (H, W) where they count.

    A disparity larger than any picture shows nothing, so it does not count: a damaged map must not
    make the histogram as long as its largest value.
    """
    limit = MAX_PICTURE_SIDE
    rounded = np.floor(disparity.values_px + np.float32(0.5))
    levels = np.clip(rounded, -limit - 1, limit + 1).astype(np.int32)
    return levels, disparity.valid & (np.abs(levels) <= limit)


def histogram(levels: NDArray[np.int32], usable: Mask) -> tuple[int, NDArray[np.int64]]:
    """Equation 4.8: the lowest usable disparity, px, and the counts from there upward, int64 (n,)."""
    counted = levels[usable]
    if not counted.size:
        return 0, np.zeros(0, np.int64)
    lowest = int(counted.min())
    return lowest, np.bincount(counted - lowest)


def runs(ones: NDArray[np.bool_]) -> tuple[tuple[int, int], ...]:
    """First and last index of each run of ones, single zeros inside a run tolerated (equation 4.10).

    Args:
        ones: bool (n,), p' of equation 4.9.
    """
    indices = np.flatnonzero(ones)
    if not indices.size:
        return ()
    breaks = np.flatnonzero(np.diff(indices) > 2) + 1
    return tuple((int(run[0]), int(run[-1])) for run in np.split(indices, breaks))


def label(levels: NDArray[np.int32], usable: Mask, bounds: Bounds) -> LayerStack:
    """Give each usable pixel the number of the layer that its disparity lies in (equation 4.11)."""
    if not bounds:
        return LayerStack((), np.zeros(levels.shape, np.uint16))
    low, high = bounds[0][0], bounds[-1][1]
    numbers = np.zeros(high - low + 1, np.uint16)
    for number, (d_min, d_max) in enumerate(bounds, start=1):
        numbers[d_min - low : d_max - low + 1] = number
    inside = usable & (levels >= low) & (levels <= high)
    return LayerStack(bounds, np.where(inside, numbers[np.clip(levels - low, 0, high - low)], np.uint16(0)))


def average_px(bounds_px: tuple[int, int]) -> int:
    """Equation 4.13: the whole disparity that a layer is moved by."""
    return (bounds_px[0] + bounds_px[1]) // 2

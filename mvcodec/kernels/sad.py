"""Sums of absolute differences over a square window, and the winner of each pixel."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def sad_band(  # noqa: PLR0917  (numba takes positions)
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    low: int,
    levels: int,
    radius: int,
    subpixel: bool,
    start: int,
    stop: int,
    left_px: NDArray[np.float32],
    right_px: NDArray[np.float32],
) -> None:
    """Winner-takes-all SAD disparities of rows start..stop-1 of both pictures of a pair.

    Args:
        left, right: uint8 (H, W, 3); differences are summed over channels.
        low, levels: disparities low .. low + levels - 1 are tried.
        radius: the window is 2 * radius + 1 square; pictures are repeated beyond their borders.
        subpixel: whether a parabola through the winner and its neighbours refines it.
        left_px, right_px: float32 (H, W), written; NaN where every candidate lies outside the
            other picture. Ties go to the smaller disparity.
    """
    height, width = left.shape[0], left.shape[1]
    columns = np.zeros((levels, width), np.int32)
    costs = np.empty((levels, width), np.int32)
    for y in range(start - radius, start + radius):
        row = min(max(y, 0), height - 1)
        _add_row(columns, left[row], right[row], low, 1)
    for y in range(start, stop):
        row = min(y + radius, height - 1)
        _add_row(columns, left[row], right[row], low, 1)
        _sum_windows(columns, radius, costs)
        for x in range(width):
            left_px[y, x] = _winner(costs, x, 0, low, subpixel)
            right_px[y, x] = _winner(costs, x, 1, low, subpixel)
        row = max(y - radius, 0)
        _add_row(columns, left[row], right[row], low, -1)


@njit(cache=True, nogil=True)
def _add_row(
    columns: NDArray[np.int32], left: NDArray[np.uint8], right: NDArray[np.uint8], low: int, weight: int
) -> None:
    levels, width = columns.shape
    for level in range(levels):
        for x in range(width):
            target = min(max(x - low - level, 0), width - 1)
            total = np.int32(0)
            for channel in range(3):
                total += abs(np.int32(left[x, channel]) - np.int32(right[target, channel]))
            columns[level, x] += weight * total


@njit(cache=True, nogil=True)
def _sum_windows(columns: NDArray[np.int32], radius: int, costs: NDArray[np.int32]) -> None:
    levels, width = columns.shape
    for level in range(levels):
        total = 0
        for x in range(-radius, radius + 1):
            total += columns[level, min(max(x, 0), width - 1)]
        costs[level, 0] = total
        for x in range(1, width):
            total += columns[level, min(x + radius, width - 1)] - columns[level, max(x - radius - 1, 0)]
            costs[level, x] = total


@njit(cache=True, nogil=True)
def _winner(costs: NDArray[np.int32], x: int, slant: int, low: int, subpixel: bool) -> float:
    """Cheapest disparity of a pixel of the left (slant 0) or the right (slant 1) picture."""
    levels, width = costs.shape
    best, cheapest = -1, 0
    for level in range(levels):
        at = x + slant * (low + level)
        target = at - low - level
        if 0 <= at < width and 0 <= target < width and (best < 0 or costs[level, at] < cheapest):
            best, cheapest = level, costs[level, at]
    if best < 0:
        return np.nan
    before, after = x + slant * (low + best - 1), x + slant * (low + best + 1)
    if subpixel and 0 < best < levels - 1 and 0 <= before < width and 0 <= after < width:
        first, last = costs[best - 1, before], costs[best + 1, after]
        bend = first + last - 2 * cheapest
        # A cheaper neighbour is one that was no candidate, since it looks outside the other picture.
        if min(first, last) >= cheapest and bend > 0:
            return float(low + best + 0.5 * (first - last) / bend)
    return float(low + best)

"""Semi-global matching of one camera against all its partners at once (Hirschmueller 2008).

A volume is (H, levels, W): the cost of disparity low + level at each pixel of the camera. Whole rows are
the innermost loops, free of branches and in 8 bits, so that a vector holds as many pixels as it can: paths
from row to row take all pixels of a row at once, and paths along rows run on turned bands of them.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
FloatMap = NDArray[np.float32]
Volume = NDArray[np.uint8]
SumVolume = NDArray[np.uint16]

MAX_SUM = 255
"""Most that a cost, a jump (P2) and a small step (P1) may add up to: a path of 8 bits holds no more."""
SIDE = 1
"""Columns that stand beside the first and the last of a path's row."""


@njit(cache=True, nogil=True)
def _ways_in(least_before, grey, grey_before, shift, jumps, least, highest):  # type: ignore[no-untyped-def]
    """Of each pixel of a row: the least cost where its path comes from, and that plus the cost of a jump."""
    width = grey.size
    first, last = max(-shift, 0), min(width - shift, width)
    least[:first], highest[:first] = 0, 0
    least[last:], highest[last:] = 0, 0
    for x in range(first, last):
        before = least_before[x + shift]
        least[x] = before
        highest[x] = before + jumps[abs(np.int32(grey[x]) - np.int32(grey_before[x + shift]))]


@njit(cache=True, nogil=True)
def _follow(  # type: ignore[no-untyped-def]
    costs, at, stride, levels, before, least_before, highest, small, shift, path, least, sums
):
    """One row of one path (equation 13 of Hirschmueller 2008), added to `sums`; least: its least costs.

    Of flat arrays, by unsigned indexes: slices would take longer to make than short rows take to add up.
    """
    width = np.uint64(len(least))
    side, row = np.uint64(SIDE), np.uint64(len(least) + 2 * SIDE)
    come = np.uint64(SIDE + shift)
    for x in range(width):
        least[x] = MAX_SUM
    for level in range(np.uint64(levels)):
        lower, here = np.uint64(level * row + come), np.uint64((level + np.uint64(1)) * row + side)
        same, upper = np.uint64(lower + row), np.uint64(lower + row + row)
        now = np.uint64(at + level * stride)
        for x in range(width):
            beside = np.uint8(min(before[lower + x], before[upper + x]) + small)
            way = np.uint8(min(min(before[same + x], beside), highest[x]) - least_before[x])
            found = np.uint8(way + costs[now + x])
            path[here + x] = found
            least[x] = min(least[x], found)
            sums[now + x] = np.uint16(sums[now + x] + found)


@njit(cache=True, nogil=True)
def add_paths(
    costs: Volume,
    grey: Bytes,
    jumps: Bytes,
    small: int,
    shifts: NDArray[np.int64],
    turned: bool,
    downwards: bool,
    sums: SumVolume,
) -> None:
    """Add up the costs along paths that go from row to row.

    Args:
        costs: uint8 (H, levels, W), contiguous; where `turned`, (levels, H, W).
        grey: uint8 (H, W), of the camera.
        jumps: uint8 (256,), penalty of a jump (P2) by the difference of grey between two pixels of the path.
        small: penalty of a step of one level (P1). The highest cost, jump and small step add up to
            MAX_SUM at most.
        shifts: int64 (K,), in -1..1: a path comes to column x from column x + shift of the row before.
        downwards: from the first row to the last, else from the last to the first.
        sums: uint16, of the shape of `costs`, added to.
    """
    height, width = grey.shape
    levels = costs.shape[0] if turned else costs.shape[1]
    stride = height * width if turned else width
    paths = len(shifts)
    flat_costs, flat_sums = costs.reshape(-1), sums.reshape(-1)
    rows = np.full((2, paths, (levels + 2) * (width + 2 * SIDE)), MAX_SUM - small, np.uint8)
    least = np.zeros((2, paths, width), np.uint8)
    least_before, highest = np.zeros(width, np.uint8), np.zeros(width, np.uint8)
    for i in range(height):
        y = i if downwards else height - 1 - i
        now = i % 2
        for k in range(paths):
            if i > 0:
                before = y - 1 if downwards else y + 1
                _ways_in(least[1 - now, k], grey[y], grey[before], shifts[k], jumps, least_before, highest)
            _follow(
                flat_costs,
                np.uint64(y * width if turned else y * levels * width),
                np.uint64(stride),
                levels,
                rows[1 - now, k],
                least_before,
                highest,
                np.uint8(small),
                shifts[k],
                rows[now, k],
                least[now, k],
                flat_sums,
            )


@njit(cache=True, nogil=True)
def _cheapest(sums, least, best):  # type: ignore[no-untyped-def]
    """Least sum of each pixel of a row, and the (first) level that has it."""
    levels, width = sums.shape
    least[:], best[:] = sums[0], 0
    for level in range(1, levels):
        here = sums[level]
        for x in range(width):
            lower = here[x] < least[x]
            least[x] = here[x] if lower else least[x]
            best[x] = np.uint16(level) if lower else best[x]


@njit(cache=True, nogil=True)
def winners(sums: SumVolume, low: int, disparity: FloatMap) -> None:
    """Least sum of each pixel, sub-pixel by fitting two lines of equal slope (Shimizu and Okutomi 2001).

    Args:
        sums: uint16 (H, levels, W).
        low: disparity of level 0, px.
        disparity: float32 (H, W), px, overwritten.
    """
    height, levels, width = sums.shape
    least, best = np.empty(width, np.uint16), np.empty(width, np.uint16)
    for y in range(height):
        here = sums[y]
        _cheapest(here, least, best)
        for x in range(width):
            level = np.int64(best[x])
            offset = np.float32(0)
            if 0 < level < levels - 1:
                before = np.float32(here[level - 1, x] - least[x])
                after = np.float32(here[level + 1, x] - least[x])
                if before + after > 0:
                    offset = np.float32(0.5) * (before - after) / max(before, after)
            disparity[y, x] = np.float32(low + level) + offset


@njit(cache=True, nogil=True)
def _take_lower(sums, here, level, count, there, least, best):  # type: ignore[no-untyped-def]
    for x in range(count):
        lower = sums[here + x] < least[there + x]
        least[there + x] = sums[here + x] if lower else least[there + x]
        best[there + x] = level if lower else best[there + x]


@njit(cache=True, nogil=True)
def partner_winners(
    sums: SumVolume, low: int, step_x: float, step_y: float, unseen: float, disparity: FloatMap
) -> None:
    """The disparity of a partner's pixels by the sums of this camera: of all that land there the cheapest.

    Args:
        sums: uint16 (H, levels, W), of this camera, contiguous.
        low: disparity of level 0, px.
        step_x, step_y: a pixel of disparity d is at (x - step_x * d, y - step_y * d) of the partner; rounded.
        unseen: what pixels get where none lands.
        disparity: float32 (H, W), px, overwritten.
    """
    height, levels, width = sums.shape
    least = np.full(height * width, 65535, np.uint16)
    best = np.full(height * width, 65535, np.uint16)
    flat = sums.reshape(-1)
    for y in range(height):
        for level in range(levels):
            left = int(np.rint(step_x * (low + level)))
            row = y - int(np.rint(step_y * (low + level)))
            first, last = max(left, 0), min(width + left, width)
            if 0 <= row < height and first < last:
                here = np.uint64((y * levels + level) * width + first)
                there = np.uint64(row * width + first - left)
                _take_lower(flat, here, np.uint16(level), np.uint64(last - first), there, least, best)
    for y in range(height):
        for x in range(width):
            level = best[y * width + x]
            disparity[y, x] = unseen if level == 65535 else low + level

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
SumMap = NDArray[np.uint16]

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
    costs, at, stride, levels, before, lower, path, here, row, least_before, highest, small, least
):
    """One row of one path (equation 13 of Hirschmueller 2008); least: its least costs.

    Of flat arrays, by unsigned indexes: slices would take longer to make than short rows take to add up.

    Args:
        at, stride: where the costs of level 0 begin, and how far the next level's are.
        lower: where what stands below level 0 begins in `before`; here: where level 0 goes to in `path`.
        row: how far apart levels are in both of them.
    """
    width = np.uint64(len(least))
    for x in range(width):
        least[x] = MAX_SUM
    for _ in range(levels):
        same, upper = np.uint64(lower + row), np.uint64(lower + row + row)
        for x in range(width):
            beside = np.uint8(min(before[lower + x], before[upper + x]) + small)
            way = np.uint8(min(min(before[same + x], beside), highest[x]) - least_before[x])
            found = np.uint8(way + costs[at + x])
            path[here + x] = found
            least[x] = min(least[x], found)
        lower, here, at = same, np.uint64(here + row), np.uint64(at + stride)


@njit(cache=True, nogil=True)
def _add_three(rows, levels, sums):  # type: ignore[no-untyped-def]
    """Add three paths of a row, in a loop of its own: 16 bits among 8 would halve how much a vector holds."""
    width = np.uint64(sums.size // levels)
    row = np.uint64(width + np.uint64(2 * SIDE))
    left, middle, right = rows[0], rows[1], rows[2]
    for level in range(np.uint64(levels)):
        here, there = np.uint64((level + np.uint64(1)) * row + np.uint64(SIDE)), np.uint64(level * width)
        for x in range(width):
            found = np.uint16(np.uint16(left[here + x]) + np.uint16(middle[here + x]))
            sums[there + x] = np.uint16(sums[there + x] + np.uint16(found + np.uint16(right[here + x])))


@njit(cache=True, nogil=True)
def _add_one(rows, levels, sums):  # type: ignore[no-untyped-def]
    width = np.uint64(sums.size // levels)
    row = np.uint64(width + np.uint64(2 * SIDE))
    middle = rows[0]
    for level in range(np.uint64(levels)):
        here, there = np.uint64((level + np.uint64(1)) * row + np.uint64(SIDE)), np.uint64(level * width)
        for x in range(width):
            sums[there + x] = np.uint16(sums[there + x] + np.uint16(middle[here + x]))


@njit(cache=True, nogil=True)
def path_state(levels: int, width: int, paths: int, small: int) -> tuple[Bytes, Bytes]:
    """Where paths stand before their first row.

    Returns:
        uint8 (2, paths, (levels + 2) * (width + 2 * SIDE)), the row before and the row now, and uint8
        (2, paths, width), their least costs.
    """
    rows = np.full((2, paths, (levels + 2) * (width + 2 * SIDE)), MAX_SUM - small, np.uint8)
    return rows, np.zeros((2, paths, width), np.uint8)


@njit(cache=True, nogil=True)
def add_paths(
    costs: Volume,
    grey: Bytes,
    start: int,
    jumps: Bytes,
    small: int,
    downwards: bool,
    begun: bool,
    rows: Bytes,
    least: Bytes,
    sums: SumVolume,
) -> None:
    """Add up the costs of a band of rows along paths that go from row to row.

    Args:
        costs: uint8 (R, levels, W), contiguous, of the band.
        grey: uint8 (H, W), of the camera; start: the band's first row.
        jumps: uint8 (256,), penalty of a jump (P2) by the difference of grey between two pixels of the path.
        small: penalty of a step of one level (P1). The highest cost, jump and small step add up to
            MAX_SUM at most.
        downwards: from the first row to the last, else from the last to the first.
        begun: whether paths come into the band; else they begin in it.
        rows, least: where they stand, see `path_state`; three paths are the vertical and both diagonals.
        sums: uint16 (R', levels, W), added to: of the first R' rows, R' <= R.
    """
    count, levels, width = costs.shape
    paths = rows.shape[1]
    flat = costs.reshape(-1)
    row = np.uint64(width + 2 * SIDE)
    least_before, highest = np.zeros(width, np.uint8), np.zeros(width, np.uint8)
    now = 0
    for i in range(count):
        at = i if downwards else count - 1 - i
        now = 1 - now
        for k in range(paths):
            shift = k - 1 if paths == 3 else 0
            if i > 0 or begun:
                here, before = grey[start + at], grey[start + at - 1 if downwards else start + at + 1]
                _ways_in(least[1 - now, k], here, before, shift, jumps, least_before, highest)
            _follow(
                flat,
                np.uint64(at * levels * width),
                np.uint64(width),
                levels,
                rows[1 - now, k],
                np.uint64(SIDE + shift),
                rows[now, k],
                np.uint64(row + np.uint64(SIDE)),
                row,
                least_before,
                highest,
                np.uint8(small),
                least[now, k],
            )
        if at < len(sums):
            if paths == 3:
                _add_three(rows[now], levels, sums[at].reshape(-1))
            else:
                _add_one(rows[now], levels, sums[at].reshape(-1))
    if now == 1:
        rows[0], least[0] = rows[1], least[1]


@njit(cache=True, nogil=True)
def turned_path(costs: Volume, grey: Bytes, jumps: Bytes, small: int, forwards: bool, path: Volume) -> None:
    """The costs along paths through turned rows: pixel by pixel, all rows of a band at once.

    Args:
        costs: uint8 (levels, W, rows), contiguous; grey: uint8 (W, rows).
        jumps, small: as in `add_paths`.
        forwards: from the first pixel to the last, else from the last to the first.
        path: uint8 (levels, W, rows), written.
    """
    levels, width, rows = costs.shape
    flat, flat_path = costs.reshape(-1), path.reshape(-1)
    state, least = path_state(levels, rows, 1, small)
    row = np.uint64(rows + 2 * SIDE)
    least_before, highest = np.zeros(rows, np.uint8), np.zeros(rows, np.uint8)
    for i in range(width):
        x = i if forwards else width - 1 - i
        now = i % 2
        if i > 0:
            before = grey[x - 1 if forwards else x + 1]
            _ways_in(least[1 - now, 0], grey[x], before, 0, jumps, least_before, highest)
        _follow(
            flat,
            np.uint64(x * rows),
            np.uint64(width * rows),
            levels,
            state[1 - now, 0],
            np.uint64(SIDE),
            state[now, 0],
            np.uint64(row + np.uint64(SIDE)),
            row,
            least_before,
            highest,
            np.uint8(small),
            least[now, 0],
        )
        found = state[now, 0]
        here, there = np.uint64(row + np.uint64(SIDE)), np.uint64(x * rows)
        for _ in range(levels):
            for r in range(np.uint64(rows)):
                flat_path[there + r] = found[here + r]
            here, there = np.uint64(here + row), np.uint64(there + np.uint64(width * rows))


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
def take_partner_winners(
    sums: SumVolume, start: int, low: int, step_x: float, step_y: float, least: SumMap, best: SumMap
) -> None:
    """What a partner's pixels are by the sums of this camera: of all levels that land there the cheapest.

    Args:
        sums: uint16 (R, levels, W), of a band of rows of this camera, contiguous; start: its first row.
        low: disparity of level 0, px.
        step_x, step_y: a pixel of disparity d is at (x - step_x * d, y - step_y * d) of the partner; rounded.
        least, best: uint16 (H, W), least sums so far and their levels, updated. They begin at 65535.
    """
    count, levels, width = sums.shape
    flat, flat_least, flat_best = sums.reshape(-1), least.reshape(-1), best.reshape(-1)
    for at in range(count):
        for level in range(levels):
            left = int(np.rint(step_x * (low + level)))
            row = start + at - int(np.rint(step_y * (low + level)))
            first, last = max(left, 0), min(width + left, width)
            if 0 <= row < len(least) and first < last:
                here = np.uint64((at * levels + level) * width + first)
                there = np.uint64(row * width + first - left)
                _take_lower(
                    flat, here, np.uint16(level), np.uint64(last - first), there, flat_least, flat_best
                )

"""Disparity of the picture that predicts another one, in whole numbers: the same bits everywhere.

FORMAT.md ("Predicted pictures") says what these kernels compute; a change of any makes a new predictor.
Disparity is counted in FINE-ths of a pixel, shifts in 65536ths. What nobody knows is UNKNOWN, below every
disparity.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Plane = NDArray[np.uint8]
IntMap = NDArray[np.int32]

FINE = 64
HALF_SHIFT = 1 << 15
UNKNOWN = -(1 << 24)
"""Exact in float32, too, in which the median sorts it."""

REACH = 35
"""A moved pixel covers the places within this distance, in FINE-ths."""

TOLERANCE = 96
"""Disparities that differ by no more are one surface."""

RATIO_NUM, RATIO_DEN = 13, 10
"""A farther surface must weigh this many times a nearer one to outvote it."""

SMOOTH = 192
"""Samples of a small map that differ by no more are one surface."""


@njit(cache=True, nogil=True)
def enlarge(small: IntMap, luma: Plane, out: IntMap) -> None:
    """Double a map's size: bilinear on surfaces, and at their edges by the luma of its picture.

    Args:
        small: int32 (h, w); sample (v, u) stands in the middle of pixels 2v, 2v + 1 and 2u, 2u + 1.
        luma: uint8 (2h, 2w) or smaller, at least (H, W).
        out: int32 (H, W), written.
    """
    height, width = out.shape
    rows, columns = small.shape
    for y in range(height):
        up, down = max((y - 1) // 2, 0), min((y + 1) // 2, rows - 1)
        near_down = 3 if y % 2 == 0 else 1  # of 4: the weight of the row `down` on even rows, of `up` else
        for x in range(width):
            left, right = max((x - 1) // 2, 0), min((x + 1) // 2, columns - 1)
            a, b, c, d = small[up, left], small[up, right], small[down, left], small[down, right]
            if max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) <= SMOOTH:
                near_right = 3 if x % 2 == 0 else 1
                above = (4 - near_right) * a + near_right * b
                below = (4 - near_right) * c + near_right * d
                out[y, x] = ((4 - near_down) * above + near_down * below + 8) >> 4
            else:
                out[y, x] = _by_luma(small, luma, y, x)


@njit(cache=True, nogil=True)
def _by_luma(small, luma, y, x):  # type: ignore[no-untyped-def]
    """Of the samples around a pixel, the one whose luma and place are most like the pixel's own."""
    rows, columns = small.shape
    height, width = luma.shape
    best, chosen = 1 << 30, 0
    for v in range(max(y // 2 - 1, 0), min(y // 2 + 2, rows)):
        for u in range(max(x // 2 - 1, 0), min(x // 2 + 2, columns)):
            lower, righter = min(2 * v + 1, height - 1), min(2 * u + 1, width - 1)
            four = np.int64(luma[2 * v, 2 * u]) + luma[2 * v, righter] + luma[lower, 2 * u]
            mean = (four + luma[lower, righter] + 2) >> 2
            down, across = 4 * v + 1 - 2 * y, 4 * u + 1 - 2 * x
            cost = 6 * abs(np.int64(luma[y, x]) - mean) + 5 * (down * down + across * across)
            if cost < best:
                best, chosen = cost, small[v, u]
    return chosen


@njit(cache=True, nogil=True)
def splat(disparity: IntMap, shift_x: int, shift_y: int, out: IntMap) -> None:
    """Move a map to another view, the nearest surface last.

    Args:
        disparity: int32 (H, W).
        shift_x, shift_y: 65536ths of a pixel that a pixel moves (left, up) for each pixel of disparity.
        out: int32 (H, W), overwritten; UNKNOWN where nothing lands.
    """
    height, width = disparity.shape
    out[:] = UNKNOWN
    spill = FINE - REACH
    for y in range(height):
        for x in range(width):
            d = disparity[y, x]
            at_x = FINE * x - ((shift_x * d + HALF_SHIFT) >> 16)
            at_y = FINE * y - ((shift_y * d + HALF_SHIFT) >> 16)
            u, v = (at_x + FINE // 2) >> 6, (at_y + FINE // 2) >> 6
            part_x, part_y = at_x - FINE * u, at_y - FINE * v
            right = 1 if part_x >= spill else 0
            left = 1 if part_x <= -spill else 0
            below = 1 if part_y >= spill else 0
            above = 1 if part_y <= -spill else 0
            for row in range(max(v - above, 0), min(v + below + 1, height)):
                for column in range(max(u - left, 0), min(u + right + 1, width)):
                    # Indices without a sign: nothing asks whether they count from the end.
                    at = np.uintp(row), np.uintp(column)
                    out[at] = max(out[at], d)


@njit(cache=True, nogil=True)
def vote(moved: NDArray[np.int32], weights: NDArray[np.int64], out: IntMap, first: int, last: int) -> None:
    """One disparity for each pixel from the cameras' moved maps, rows first..last-1.

    Disparities within TOLERANCE of the nearest one of their group are one surface: their mean by weight,
    rounded down. Surfaces are tried near to far; a farther one wins whose cameras weigh more than
    RATIO times those of the winner so far.

    Args:
        moved: int32 (N, H, W), see `splat`.
        weights: int64 (N,), of the cameras, above 0.
        out: int32 (H, W), rows first..last-1 overwritten; UNKNOWN where no camera knows.
    """
    count, _, width = moved.shape
    near, weigh = np.empty(count, np.int64), np.empty(count, np.int64)
    for y in range(first, last):
        for x in range(width):
            known = 0
            for i in range(count):
                d = np.int64(moved[i, y, x])
                if d == UNKNOWN:
                    continue
                place = known
                while place > 0 and near[place - 1] < d:
                    near[place], weigh[place] = near[place - 1], weigh[place - 1]
                    place -= 1
                near[place], weigh[place] = d, weights[i]
                known += 1
            best, strength, start = np.int64(UNKNOWN), np.int64(0), 0
            while start < known:
                end, total, sums = start, np.int64(0), np.int64(0)
                while end < known and near[start] - near[end] <= TOLERANCE:
                    total += weigh[end]
                    sums += weigh[end] * near[end]
                    end += 1
                if start == 0 or RATIO_DEN * total > RATIO_NUM * strength:
                    best, strength = sums // total, total
                start = end
            out[y, x] = best


@njit(cache=True, nogil=True)
def fill(disparity: IntMap, fallback: int) -> None:
    """Fill what is unknown in place by the farther end of its gap on the row; whole rows with `fallback`."""
    height, width = disparity.shape
    for y in range(height):
        x = 0
        while x < width:
            if disparity[y, x] != UNKNOWN:
                x += 1
                continue
            end = x
            while end < width and disparity[y, end] == UNKNOWN:
                end += 1
            left = disparity[y, x - 1] if x > 0 else UNKNOWN
            right = disparity[y, end] if end < width else UNKNOWN
            farther = min(left, right) if min(left, right) != UNKNOWN else max(left, right)
            disparity[y, x:end] = farther if farther != UNKNOWN else fallback
            x = end

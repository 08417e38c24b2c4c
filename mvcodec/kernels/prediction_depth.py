"""Disparity of the picture that predicts another one, in whole numbers: the same bits everywhere.

FORMAT.md ("Predicted pictures") says what these kernels compute; a change of any makes a new predictor.
Disparity is counted in FINE-ths of a pixel, shifts in 65536ths. What nobody knows is UNKNOWN, below every
disparity.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_marks import list_marked

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
    sums, high, low = np.empty(columns, np.int32), np.empty(columns, np.int32), np.empty(columns, np.int32)
    marks, chosen = np.empty(columns, np.uint8), np.empty(columns, np.int32)
    for y in range(height):
        above, below = small[max((y - 1) // 2, 0)], small[min((y + 1) // 2, rows - 1)]
        near = np.int32(
            3 if y % 2 == 0 else 1
        )  # of 4: the weight of the row below on even rows, of above else
        line = out[y]
        for u in range(columns):  # vectorised
            sums[u] = (np.int32(4) - near) * above[u] + near * below[u]
            high[u], low[u] = max(above[u], below[u]), min(above[u], below[u])
        _enlarge_row(sums, high, low, line, marks)
        for x in (0, width - 1) if width > 2 * columns - 1 else (0, 0):
            u = x // 2
            line[x] = _by_luma(small, luma, y, x) if high[u] - low[u] > SMOOTH else (4 * sums[u] + 8) >> 4
        for u in chosen[: list_marked(marks[: columns - 1], chosen)]:
            line[2 * u + 1] = _by_luma(small, luma, y, 2 * u + 1)
            line[2 * u + 2] = _by_luma(small, luma, y, 2 * u + 2)


@njit(cache=True, nogil=True)
def _enlarge_row(sums, high, low, line, marks):  # type: ignore[no-untyped-def]
    """Both pixels between each two samples of a row, bilinearly; marks where these are not one surface."""
    three, eight, four = np.int32(3), np.int32(8), np.int32(4)
    for u in range(sums.size - 1):  # vectorised
        line[2 * u + 1] = (three * sums[u] + sums[u + 1] + eight) >> four
        line[2 * u + 2] = (sums[u] + three * sums[u + 1] + eight) >> four
        marks[u] = max(high[u], high[u + 1]) - min(low[u], low[u + 1]) > SMOOTH


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
        out: int32 (H + 2, W + 2), C-contiguous, overwritten: the view with a border of one pixel, in which
            what leaves the picture lands; UNKNOWN where nothing does.
    """
    height, width = disparity.shape
    stride = np.int32(width + 2)
    flat = out.ravel()
    flat[:] = UNKNOWN
    places = np.empty(width, np.int32)
    beside, above = np.empty(width, np.int32), np.empty(width, np.int32)
    chosen = np.empty(width, np.int32)
    for y in range(height):
        row = disparity[y]
        _targets(row, y, height, shift_x, shift_y, stride, places, beside, above)
        count = 0
        for x in range(width):
            place = np.uint32(places[x])
            flat[place] = max(flat[place], row[x])
            chosen[count] = x
            count += (beside[x] | above[x]) != 0
        for x in chosen[:count]:  # again where one of them is 0, which costs less than to ask
            d = row[x]
            for step in (beside[x], above[x], np.int32(beside[x] + above[x])):
                place = np.uint32(places[x] + step)
                flat[place] = max(flat[place], d)


@njit(cache=True, nogil=True)
def _targets(row, y, height, shift_x, shift_y, stride, places, beside, above):  # type: ignore[no-untyped-def]
    """Where the pixels of a row go, and the steps to the neighbours that they cover too, 0 where none."""
    fine, half, spill = np.int32(FINE), np.int32(FINE // 2), np.int32(FINE - REACH)
    right, bottom = np.int32(FINE * row.size), np.int32(FINE * height)
    by_x, by_y = np.int64(np.int32(shift_x)), np.int64(np.int32(shift_y))
    for x in range(row.size):  # vectorised: no branch
        d = np.int64(row[x])
        at_x = np.int32(FINE * x) - np.int32((by_x * d + HALF_SHIFT) >> 16)
        at_y = np.int32(FINE * y) - np.int32((by_y * d + HALF_SHIFT) >> 16)
        at_x, at_y = min(max(at_x, -fine), right), min(max(at_y, -fine), bottom)
        u, v = (at_x + half) >> np.int32(6), (at_y + half) >> np.int32(6)
        part_x, part_y = at_x - fine * u, at_y - fine * v
        places[x] = (v + np.int32(1)) * stride + u + np.int32(1)
        beside[x] = np.int32(part_x >= spill) - np.int32(part_x <= -spill)
        above[x] = (np.int32(part_y >= spill) - np.int32(part_y <= -spill)) * stride


@njit(cache=True, nogil=True, error_model="numpy")
def _common(moved, weights, y, mean, marks):  # type: ignore[no-untyped-def]
    """The cameras' mean for a row, rounded down; marks where they do not say the same surface."""
    width = mean.size
    total, sums = np.zeros(width, np.float64), np.zeros(width, np.float64)
    nearest, farthest = np.full(width, UNKNOWN, np.int32), np.full(width, -UNKNOWN, np.int32)
    for i in range(len(weights)):
        row, weight = moved[i, y + 1, 1:-1], np.float64(weights[i])
        for x in range(width):  # vectorised: no branch
            known = row[x] > UNKNOWN
            part = weight if known else 0.0
            total[x] += part
            sums[x] += part * np.float64(row[x])
            nearest[x] = max(nearest[x], row[x])
            farthest[x] = min(farthest[x], row[x] if known else np.int32(-UNKNOWN))
    for x in range(width):
        found = np.floor(sums[x] / max(total[x], 1.0))
        mean[x] = np.int32(found) if total[x] > 0 else np.int32(UNKNOWN)
        marks[x] = nearest[x] - farthest[x] > TOLERANCE


@njit(cache=True, nogil=True)
def vote(moved: NDArray[np.int32], weights: NDArray[np.int64], out: IntMap, first: int, last: int) -> None:
    """One disparity for each pixel from the cameras' moved maps, rows first..last-1.

    Disparities within TOLERANCE of the nearest one of their group are one surface: their mean by weight,
    rounded down. Surfaces are tried near to far; a farther one wins whose cameras weigh more than
    RATIO times those of the winner so far.

    Args:
        moved: int32 (N, H + 2, W + 2), see `splat`.
        weights: int64 (N,), of the cameras, above 0.
        out: int32 (H, W), rows first..last-1 overwritten; UNKNOWN where no camera knows.
    """
    count, width = len(moved), out.shape[1]
    near, weigh = np.empty(count, np.int64), np.empty(count, np.int64)
    marks, chosen = np.empty(width, np.uint8), np.empty(width, np.int32)
    for y in range(first, last):
        _common(moved, weights, y, out[y], marks)
        for x in chosen[: list_marked(marks, chosen)]:
            known = 0
            for i in range(count):
                d = np.int64(moved[i, y + 1, x + 1])
                if d == UNKNOWN:
                    continue
                place = known
                while place > 0 and near[place - 1] < d:
                    near[place], weigh[place] = near[place - 1], weigh[place - 1]
                    place -= 1
                near[place], weigh[place] = d, weights[i]
                known += 1
            out[y, x] = _outvoted(near, weigh, known)


@njit(cache=True, nogil=True)
def _outvoted(near, weigh, known):  # type: ignore[no-untyped-def]
    """The winner of disparities that are sorted near to far."""
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
    return best


@njit(cache=True, nogil=True)
def fill(disparity: IntMap, fallback: int) -> None:
    """Fill what is unknown in place by the farther end of its gap on the row; whole rows with `fallback`."""
    height, width = disparity.shape
    for y in range(height):
        unknown = 0
        for x in range(width):  # vectorised
            unknown += disparity[y, x] == UNKNOWN
        x = 0 if unknown else width
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

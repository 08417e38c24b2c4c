"""Disparity of the picture that predicts another one, in whole numbers: the same bits everywhere.

FORMAT.md ("Predicted pictures") says what these kernels compute; a change of any makes a new predictor.
Disparity is counted in FINE-ths of a pixel, shifts in 65536ths. What nobody knows is UNKNOWN, below every
disparity.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.prediction_moves import UNKNOWN, mean_run, move_run
from mvcodec.kernels.prediction_runs import TOLERANCE
from mvcodec.kernels.view_marks import list_bits, list_marked

Plane = NDArray[np.uint8]
IntMap = NDArray[np.int32]

MARGIN = COUNT
"""Columns beside a moved map, which runs of pixels may read and write."""

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
        out: int32 (H + 2, W + 2 MARGIN), C-contiguous, overwritten: the view with a border of one row and
            MARGIN columns, of which the inner one is where what leaves the picture lands; UNKNOWN where
            nothing does.

    Raises:
        ValueError: `out` is of another shape: runs of pixels would be written outside of it.
    """
    height, width = disparity.shape
    if out.shape != (height + 2, width + 2 * MARGIN):
        raise ValueError("a view without its border")
    flat = out.ravel()
    flat[:] = UNKNOWN
    row = np.full(width + COUNT, UNKNOWN, np.int32)
    size, shifts = (np.int32(width), np.int32(height)), (np.int32(shift_x), np.int32(shift_y))
    for y in range(height):
        row[:width] = disparity[y]
        for x in range(0, width, COUNT):
            move_run(row, flat, x, (np.int32(x), np.int32(y)), size, shifts)


@njit(cache=True, nogil=True)
def vote(
    moved: NDArray[np.int32], weights: NDArray[np.int64], out: NDArray[np.float32], first: int, last: int
) -> None:
    """One disparity for each pixel from the cameras' moved maps, rows first..last-1.

    Disparities within TOLERANCE of the nearest one of their group are one surface: their mean by weight,
    rounded down. Surfaces are tried near to far; a farther one wins whose cameras weigh more than
    RATIO times those of the winner so far.

    Args:
        moved: int32 (N, H + 2, W + 2 MARGIN), C-contiguous, see `splat`.
        weights: int64 (N,), of the cameras, above 0.
        out: float32 (H, W), rows first..last-1 overwritten with whole numbers, which float32 holds exactly
            below 2^24; UNKNOWN where no camera knows.
    """
    count, width = len(moved), out.shape[1]
    near, weigh = np.empty(count, np.int64), np.empty(count, np.int64)
    flat, parts, step = moved.ravel(), weights.astype(np.float64), moved.shape[1] * moved.shape[2]
    line, chosen = np.empty(width + COUNT, np.float32), np.empty(width + COUNT, np.int32)
    for y in range(first, last):
        start, marked = (y + 1) * moved.shape[2] + MARGIN, 0
        for x in range(0, width, COUNT):
            bits = mean_run(flat, parts, line, (start + x, step), x, np.int32(TOLERANCE))
            marked = list_bits(bits, x, chosen, marked)
        out[y] = line[:width]
        for x in chosen[:marked]:
            if x >= width:
                break
            known = 0
            for i in range(count):
                d = np.int64(moved[i, y + 1, x + MARGIN])
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
def fill(disparity: NDArray[np.float32], fallback: int, out: IntMap, first: int, last: int) -> None:
    """Fill what is unknown by the farther end of its gap on the row; whole rows with `fallback`.

    Args:
        disparity: float32 (H, W), whole numbers or UNKNOWN.
        out: int32 (H, W), rows first..last-1 overwritten.
    """
    width = disparity.shape[1]
    for y in range(first, last):
        unknown, line = 0, out[y]
        for x in range(width):  # vectorised
            line[x] = np.int32(disparity[y, x])
        for x in range(width):  # vectorised
            unknown += line[x] == UNKNOWN
        x = 0 if unknown else width
        while x < width:
            if line[x] != UNKNOWN:
                x += 1
                continue
            end = x
            while end < width and line[end] == UNKNOWN:
                end += 1
            left = line[x - 1] if x > 0 else UNKNOWN
            right = line[end] if end < width else UNKNOWN
            farther = min(left, right) if min(left, right) != UNKNOWN else max(left, right)
            line[x:end] = farther if farther != UNKNOWN else fallback
            x = end

"""Small pieces of a map that contradict all that is around them."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_marks import list_marked

FloatMap = NDArray[np.float32]


NEW, OWN, MET = 0, 1, 2
"""Pixels: not yet of any piece, of the piece that is being gathered, and of one that was before."""


@njit(cache=True, nogil=True)
def _gather(disparity, y, x, step, reach, pieces, rows, columns, around):  # type: ignore[no-untyped-def]
    """Gather the piece of (x, y): whether it is small, how many pixels, how many values around it."""
    height, width = disparity.shape
    rows[0], columns[0] = y, x
    pieces[y, x] = OWN
    count, beside, at = 1, 0, 0
    while at < count:
        row, column = rows[at], columns[at]
        here = disparity[row, column]
        at += 1
        for v in range(max(row - reach, 0), min(row + reach + 1, height)):
            for u in range(max(column - reach, 0), min(column + reach + 1, width)):
                if abs(disparity[v, u] - here) > step:
                    if max(abs(v - row), abs(u - column)) == 1:
                        around[beside] = disparity[v, u]
                        beside += 1
                elif pieces[v, u] == NEW:
                    if count >= len(rows) - 1:
                        return False, count, 0
                    pieces[v, u] = OWN
                    rows[count], columns[count] = v, u
                    count += 1
                elif pieces[v, u] == MET:
                    # It is no small piece: that would have been gathered as a whole.
                    return False, count, 0
    return count < len(rows), count, beside


@njit(cache=True, nogil=True)
def smooth_over(
    disparity: FloatMap, step: float, reach: int, fewest: int, out: FloatMap, first: int, last: int
) -> None:
    """Give pieces of fewer than `fewest` pixels the median of what is around them: in rows first..last-1.

    A piece that lies in several bands of rows is found in each of them, and comes out the same.

    Args:
        disparity: float32 (H, W), px, C-contiguous.
        step: pixels that differ by no more are of one piece, px,
        reach: if they are no further apart than this, px along rows and columns.
        fewest: 1 or more; 1 changes nothing.
        out: float32 (H, W), a copy of `disparity`, changed in place.
    """
    height, width = disparity.shape
    apart = np.float32(step)
    pieces = np.full((height, width), NEW, np.uint8)
    rows, columns = np.empty((2, fewest), np.int32)
    around = np.empty(8 * fewest, np.float32)
    marks, chosen = np.empty(width, np.uint8), np.empty(width, np.int32)
    for y in range(first, last):
        above, here, below = disparity[max(y - 1, 0)], disparity[y], disparity[min(y + 1, height - 1)]
        for x in range(width):
            marks[x] = max(abs(above[x] - here[x]), abs(below[x] - here[x])) > apart
        for x in range(1, width):
            marks[x] |= abs(here[x] - here[x - 1]) > apart
        for x in chosen[: list_marked(marks, chosen)]:
            if pieces[y, x] == NEW:
                small, count, beside = _gather(disparity, y, x, apart, reach, pieces, rows, columns, around)
                middle = np.sort(around[:beside])[beside // 2] if small and beside else np.float32(0)
                for i in range(count):
                    pieces[rows[i], columns[i]] = MET
                    if small and beside:
                        out[rows[i], columns[i]] = middle

"""Small pieces of a map that contradict all that is around them."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_marks import list_marked

FloatMap = NDArray[np.float32]


NEW, OWN, LARGE, SMALL = 0, 1, 2, 3
"""Pixels: not yet of any piece, of the piece that is being gathered, of a large one, and of a small one."""


@njit(cache=True, nogil=True)
def _gather(disparity, y, x, step, reach, fewest, pieces, rows, columns, start):  # type: ignore[no-untyped-def]
    """Gather the piece of (x, y) behind `start` others: how many pixels there are then.

    None is added of a large piece; what was gathered of it is marked.
    """
    height, width = disparity.shape
    rows[start], columns[start] = y, x
    pieces[y, x] = OWN
    end, at, large = start + 1, start, False
    while at < end and not large:
        row, column = rows[at], columns[at]
        here = disparity[row, column]
        at += 1
        for v in range(max(row - reach, 0), min(row + reach + 1, height)):
            for u in range(max(column - reach, 0), min(column + reach + 1, width)):
                if abs(disparity[v, u] - here) > step:
                    continue
                if pieces[v, u] == LARGE or end == start + fewest:
                    large = True
                elif pieces[v, u] == NEW:
                    pieces[v, u] = OWN
                    rows[end], columns[end] = v, u
                    end += 1
    large |= end == start + fewest
    for i in range(start, end):
        pieces[rows[i], columns[i]] = LARGE if large else SMALL
    return start if large else end


@njit(cache=True, nogil=True)
def _around(disparity, pieces, rows, columns, count):  # type: ignore[no-untyped-def]
    """The disparities of large pieces beside so many pixels, sorted; empty where there are none."""
    height, width = disparity.shape
    found, beside = np.empty(8 * count, np.float32), 0
    for i in range(count):
        for v in range(max(rows[i] - 1, 0), min(rows[i] + 2, height)):
            for u in range(max(columns[i] - 1, 0), min(columns[i] + 2, width)):
                if pieces[v, u] == LARGE:
                    found[beside] = disparity[v, u]
                    beside += 1
    return np.sort(found[:beside])


@njit(cache=True, nogil=True)
def smooth_over(
    disparity: FloatMap, step: float, reach: int, fewest: int, out: FloatMap, first: int, last: int
) -> None:
    """Give pieces of fewer than `fewest` pixels the median of what is around them: in rows first..last-1.

    Such pieces side by side are smoothed over as one, by the larger ones around. What lies in several bands
    of rows is found in each of them, and comes out the same.

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
    rows, columns = np.empty((2, height * width + fewest), np.int32)
    marks, chosen = np.empty(width, np.uint8), np.empty(width, np.int32)
    for y in range(first, last):
        above, here, below = disparity[max(y - 1, 0)], disparity[y], disparity[min(y + 1, height - 1)]
        for x in range(width):
            marks[x] = max(abs(above[x] - here[x]), abs(below[x] - here[x])) > apart
        for x in range(1, width):
            marks[x] |= abs(here[x] - here[x - 1]) > apart
        for x in chosen[: list_marked(marks, chosen)]:
            if pieces[y, x] != NEW:
                continue
            count, at = _gather(disparity, y, x, apart, reach, fewest, pieces, rows, columns, 0), 0
            while at < count:
                row, column = rows[at], columns[at]
                at += 1
                for v in range(max(row - 1, 0), min(row + 2, height)):
                    for u in range(max(column - 1, 0), min(column + 2, width)):
                        if pieces[v, u] == NEW:
                            count = _gather(
                                disparity, v, u, apart, reach, fewest, pieces, rows, columns, count
                            )
            if count:
                around = _around(disparity, pieces, rows, columns, count)
                for i in range(count if around.size else 0):
                    out[rows[i], columns[i]] = around[around.size // 2]

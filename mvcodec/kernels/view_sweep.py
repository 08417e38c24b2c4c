"""Disparity of a view from its cameras' maps, all the way in one go down the picture.

What the steps hand on are a few rows, which the caches hold: a row of the view is final as soon as no row
of a map that is still to come can reach it.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_depth import MARGIN, UNKNOWN, fill_background, move_rows, vote
from mvcodec.kernels.view_marks import list_marked

FloatMap = NDArray[np.float32]

STEP = 8
"""Rows that are put to the vote at a time."""

LINES = 16
"""Rows of the vote that are kept: those of a step and two before, a power of two."""

FEWEST_ALIKE = 2
"""Pixels of a line have as many neighbours on it."""


@njit(cache=True, nogil=True)
def disparity_rows(
    cameras: NDArray[np.int64],
    maps: NDArray[np.float32],
    extents: NDArray[np.float32],
    lumas: NDArray[np.int16],
    shifts: NDArray[np.float32],
    weights: NDArray[np.float32],
    reach: float,
    tolerance: float,
    contrast: float,
    ratio: float,
    denial: float,
    fallback: float,
    out: FloatMap,
    first: int,
    last: int,
) -> None:
    """Disparity of a view, rows first..last-1: maps moved (`splat`), put to the `vote`, cleaned, filled.

    A pixel becomes the median of its 3 x 3 window. One that this moves to another surface returns where
    FEWEST_ALIKE of its eight neighbours lie on its own: it is no stray pixel but thin. What is still unknown
    is filled, see `fill_background`.

    Args:
        cameras, maps, lumas, shifts, weights, tolerance, contrast, ratio, denial: see `vote`.
        extents: float32 (R, 2), px, at most the least and at least the greatest disparity of each map.
        reach: see `splat`.
        fallback: disparity of rows of which no camera knows anything, px.
        out: float32 (H, W), px, rows first..last-1 overwritten.
    """
    height, width = out.shape
    above, below = max(first - 1, 0), min(last + 1, height)  # the median asks one row beyond these
    before, beyond = _rows_that_reach(cameras, extents, shifts, height)
    room = 1
    while room < min((beyond - before).max() + 2 + STEP, below - above):
        room *= 2
    moved = np.full((cameras.size, room, width + 2 * MARGIN), UNKNOWN, np.float32)
    flat, size = moved.ravel(), room * moved.shape[2]
    rows = np.int32(above + 1), np.int32(below), np.int32(room - 1)
    done = np.minimum(np.maximum(above + before, 0), height)
    lines, sorted_ = np.empty((LINES, width), np.float32), np.empty((3, width + 2), np.float32)
    marks, chosen = np.empty(width, np.uint8), np.empty(width, np.int32)
    near, now = np.float32(tolerance), first
    for y in range(above, below, STEP):
        end = min(y + STEP, below)
        for i in range(cameras.size):
            until = min(max(end + beyond[i], done[i]), height)
            shift = shifts[i, 0], shifts[i, 1]
            move_rows(maps[cameras[i]], shift, reach, flat, i * size, rows, done[i], until)
            done[i] = until
        vote(
            moved,
            room - 1,
            cameras,
            maps,
            lumas,
            shifts,
            weights,
            tolerance,
            contrast,
            ratio,
            denial,
            lines,
            LINES - 1,
            y,
            end,
        )
        for i in range(cameras.size):
            for row in range(y + 1, end + 1):
                moved[i, row & (room - 1)] = UNKNOWN
        while now < last and (now + 1 < end or end == height):
            _clean_row(now, height, lines, near, sorted_, marks, chosen, out[now])
            fill_background(out, fallback, now, now + 1)
            now += 1


@njit(cache=True, nogil=True)
def _rows_that_reach(cameras, extents, shifts, height):  # type: ignore[no-untyped-def]
    """Of each camera: rows y + before..y + beyond - 1 of its map are all that may cover row y of the view."""
    before, beyond = np.empty(cameras.size, np.int64), np.empty(cameras.size, np.int64)
    for i in range(cameras.size):
        one, other = shifts[i, 1] * extents[cameras[i], 0], shifts[i, 1] * extents[cameras[i], 1]
        # Rounded, and a pixel covers at most one row beside its own.
        before[i] = np.int64(np.floor(min(max(min(one, other), -height), height))) - 2
        beyond[i] = np.int64(np.ceil(min(max(max(one, other), -height), height))) + 3
    return before, beyond


@njit(cache=True, nogil=True)
def _clean_row(y, height, lines, near, sorted_, marks, chosen, out):  # type: ignore[no-untyped-def]
    """The median of each pixel's 3 x 3 window, and what is thin as it was."""
    width = out.size
    above, here = lines[max(y - 1, 0) & (LINES - 1)], lines[y & (LINES - 1)]
    below = lines[min(y + 1, height - 1) & (LINES - 1)]
    low, middle, high = sorted_[0], sorted_[1], sorted_[2]
    for x in range(width):
        less, more = min(above[x], here[x]), max(above[x], here[x])
        low[x + 1], high[x + 1] = min(less, below[x]), max(more, below[x])
        middle[x + 1] = max(less, min(more, below[x]))
    for ends in (low, middle, high):
        ends[0], ends[width + 1] = ends[1], ends[width]
    for x in range(width):
        # The median of nine: of the greatest low, the median middle and the least high one of three columns.
        least, most = max(max(low[x], low[x + 1]), low[x + 2]), min(min(high[x], high[x + 1]), high[x + 2])
        less, more = min(middle[x], middle[x + 1]), max(middle[x], middle[x + 1])
        between = max(less, min(more, middle[x + 2]))
        out[x] = max(min(least, between), min(max(least, between), most))
    for x in range(width):
        marks[x] = (here[x] > UNKNOWN) & (abs(out[x] - here[x]) > near)
    for x in chosen[: list_marked(marks, chosen)]:
        alike = -1  # the pixel is like itself
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                alike += abs(lines[v & (LINES - 1), u] - here[x]) <= near
        if alike >= FEWEST_ALIKE:
            out[x] = here[x]

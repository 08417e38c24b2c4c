"""Where a camera sees a point of a view; what it sees there, `view_vectors` fetches.

Planes have a border of BORDER repeated pixels and are given flat, with the index of a pixel in them.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mvcodec.kernels.view_vectors import PHASES, STEPS

BORDER = 2
"""Pixels that `view_planes` repeats around a picture, so that a cubic fetch never leaves it."""
CONTOUR = np.float32(-1e9)
"""Stands, in a map of fetchable disparity, for a pixel whose cubic fetch would cross a depth edge."""


@njit(cache=True, nogil=True, inline="always")
def place_of(x, y, d, shift_x, shift_y, width, height):  # type: ignore[no-untyped-def]
    """Where a camera sees the view's point (x, y) at disparity d, kept inside, and whether it was."""
    at_x = np.float32(x) + shift_x * d
    at_y = np.float32(y) + shift_y * d
    inside = (
        (at_x > np.float32(-0.5))
        & (at_y > np.float32(-0.5))
        & (at_x < np.float32(width - 0.5))
        & (at_y < np.float32(height - 0.5))
    )
    at_x = min(max(at_x, np.float32(0)), np.float32(width - 1))
    at_y = min(max(at_y, np.float32(0)), np.float32(height - 1))
    return at_x, at_y, inside


@njit(cache=True, nogil=True, inline="always")
def phase_of(part_x, part_y):  # type: ignore[no-untyped-def]
    """Where between pixels a place is, 0..1 right of one and below it: PHASES * steps down + steps right."""
    right = np.int32(part_x * np.float32(STEPS) + np.float32(0.5))
    down = np.int32(part_y * np.float32(STEPS) + np.float32(0.5))
    return down * np.int32(PHASES) + right


@njit(cache=True, nogil=True, inline="always")
def corner_of(at_x, at_y, width, height):  # type: ignore[no-untyped-def]
    """Index of the pixel up left of a place in a map, and how far its right and its lower neighbour are."""
    left, top = np.int32(at_x), np.int32(at_y)
    right = np.uintp(1) if left + 1 < width else np.uintp(0)
    down = np.uintp(width) if top + 1 < height else np.uintp(0)
    return np.uintp(top * np.int32(width) + left), (right, down)


@njit(cache=True, nogil=True)
def distinct(shifts):  # type: ignore[no-untyped-def]
    """The different ones among shifts, and which of them each is: cameras of one row or column share them."""
    found, which = np.empty_like(shifts), np.empty(shifts.size, np.int64)
    count = 0
    for i in range(shifts.size):
        which[i] = 0
        while which[i] < count and found[which[i]] != shifts[i]:
            which[i] += 1
        if which[i] == count:
            found[count] = shifts[i]
            count += 1
    return found[:count], which

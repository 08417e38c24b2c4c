"""Where a camera sees a point of a view, and what it sees there beside a depth edge (else `view_vectors`).

Planes have a border of BORDER repeated pixels and are given flat, with the index of a pixel in them.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mvcodec.kernels.view_vectors import LEVELS, PHASES, STEPS

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


@njit(cache=True, nogil=True)
def add_edge(  # type: ignore[no-untyped-def]
    luma, colour, disparity, sums, at, place, left, top, phase, d, tolerance, weight
):
    """Add weight * (Y, R - Y, B - Y, 1) to four of `sums`, linear between those of the four pixels at `place`
    that lie at disparity d, each by its share; whether there is any. See `view_vectors.add_fetched`."""
    height, width = disparity.shape
    stride = np.uintp(width + 2 * BORDER)
    share = grey = red = blue = np.float32(0)
    part_x = np.float32(phase % PHASES) * np.float32(1 / STEPS)
    part_y = np.float32(phase // PHASES) * np.float32(1 / STEPS)
    for j in range(2):
        for i in range(2):
            # The border repeats the pixels at the margin, so that `place` need not be kept inside.
            here = disparity[min(top + j, height - 1), min(left + i, width - 1)]
            part = (part_x if i else np.float32(1) - part_x) * (part_y if j else np.float32(1) - part_y)
            part = part if abs(here - d) <= tolerance else np.float32(0)
            pixel = place + np.uintp(j) * stride + np.uintp(i)
            share += part
            grey += part * np.float32(luma[pixel])
            red += part * np.float32(colour[np.uintp(2) * pixel])
            blue += part * np.float32(colour[np.uintp(2) * pixel + np.uintp(1)])
    if share <= np.float32(1e-3):
        return False
    one, two, three = np.uintp(1), np.uintp(2), np.uintp(3)
    of_level = weight * np.float32(1 / LEVELS)
    sums[at] += of_level * grey
    sums[at + one] += of_level * red
    sums[at + two] += of_level * blue
    sums[at + three] += weight * share
    return True

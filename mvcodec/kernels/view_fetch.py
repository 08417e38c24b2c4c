"""Fetches from a real camera's planes at a point between pixels: cubic, linear, and beside a depth edge.

Planes have a border of BORDER repeated pixels and are given flat, with the index of a pixel in them.
"""

from __future__ import annotations

import numpy as np
from numba import njit

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
def cubic_weights(t, a):  # type: ignore[no-untyped-def]
    """The four weights of cubic convolution at fraction t (Keys 1981, equation 15, parameter a)."""
    s = np.float32(1) - t
    inner = ((a + np.float32(2)) * t - (a + np.float32(3))) * t * t + np.float32(1)
    after = ((a + np.float32(2)) * s - (a + np.float32(3))) * s * s + np.float32(1)
    return a * t * s * s, inner, after, a * s * t * t


@njit(cache=True, nogil=True, inline="always")
def cubic(luma, place, stride, across, down):  # type: ignore[no-untyped-def]
    """Luma of the 4 x 4 window whose upper left pixel is at the flat index `place`."""
    one, two, three = np.uintp(1), np.uintp(2), np.uintp(3)
    a, b, c, d = across
    grey = down[0] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    place += stride
    grey += down[1] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    place += stride
    grey += down[2] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    place += stride
    grey += down[3] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    return grey


@njit(cache=True, nogil=True, inline="always")
def linear(colour, place, stride, part_x, part_y):  # type: ignore[no-untyped-def]
    """(R - Y, B - Y) between the four pixels whose upper left one is at the flat index `place`."""
    one_x, one_y = np.float32(1) - part_x, np.float32(1) - part_y
    a, b, c, d = one_x * one_y, part_x * one_y, one_x * part_y, part_x * part_y
    top = np.uintp(2) * place
    low = top + np.uintp(2) * stride
    one, two, three = np.uintp(1), np.uintp(2), np.uintp(3)
    red = a * colour[top] + b * colour[top + two] + c * colour[low] + d * colour[low + two]
    blue = a * colour[top + one] + b * colour[top + three] + c * colour[low + one] + d * colour[low + three]
    return red, blue


@njit(cache=True, nogil=True)
def linear_edge(  # type: ignore[no-untyped-def]
    luma, colour, disparity, place, left, top, part_x, part_y, d, tolerance
):
    """(share, Y, R - Y, B - Y) as `linear`, but of those of the four pixels that lie at disparity d."""
    height, width = disparity.shape
    stride = width + 2 * BORDER
    share = grey = red = blue = np.float32(0)
    for j in range(2):
        for i in range(2):
            # The border repeats the pixels at the margin, so that `place` need not be kept inside.
            if abs(disparity[min(top + j, height - 1), min(left + i, width - 1)] - d) <= tolerance:
                part = (part_x if i else np.float32(1) - part_x) * (part_y if j else np.float32(1) - part_y)
                at = np.uintp(place + j * stride + i)
                share += part
                grey += part * luma[at]
                red += part * colour[np.uintp(2) * at]
                blue += part * colour[np.uintp(2) * at + np.uintp(1)]
    if share > np.float32(1e-3):
        return share, grey / share, red / share, blue / share
    return np.float32(0), grey, red, blue

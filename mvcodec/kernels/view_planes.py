"""A real camera's picture and map made ready for fetching: planes with a border, and marks at contours."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.view_fetch import BORDER, CONTOUR
from mvcodec.kernels.view_vectors import LEVELS

FloatMap = NDArray[np.float32]
Planes = tuple[NDArray[np.int16], NDArray[np.int16], FloatMap, FloatMap]


def make_room(count: int, height: int, width: int) -> Planes:
    """Planes of `count` cameras, not yet filled.

    Returns:
        Luma, int16 (R, H + 2 BORDER, W + 2 BORDER, 2), each pixel with the one below it; colour differences
        of that shape; disparity, float32 (R, H, W); and where it can be fetched, float32
        (R, H + 2 BORDER, W + 2 BORDER). Before and behind them is memory that runs of pixels may read.
    """
    padded = count, height + 2 * BORDER, width + 2 * BORDER
    return (
        reserve((*padded, 2), np.dtype(np.int16)),
        reserve((*padded, 2), np.dtype(np.int16)),
        np.empty((count, height, width), np.float32),
        reserve(padded, np.dtype(np.float32)),
    )


def reserve(shape: tuple[int, ...], kind: np.dtype[Any]) -> NDArray[Any]:
    """An array, not yet filled, before and behind which is memory that runs of pixels may read."""
    slack, size = 2 * COUNT, math.prod(shape)
    return np.empty(size + 2 * slack, kind)[slack : slack + size].reshape(shape)


@njit(cache=True, nogil=True)
def split_luma(picture: NDArray[np.uint8], luma: NDArray[np.int16], colour: NDArray[np.int16]) -> None:
    """RGB to luma and colour differences, in 1 / LEVELS of a grey level, with a border of repeated pixels.

    Args:
        picture: uint8 (H, W, 3).
        luma: int16 (H + 2 BORDER, W + 2 BORDER, 2), overwritten with Y = .299 R + .587 G + .114 B of each
            pixel and of the one below it; the last row has itself below it.
        colour: int16 (H + 2 BORDER, W + 2 BORDER, 2), overwritten with R - Y and B - Y.
    """
    height, width, _ = picture.shape
    levels, half = np.float32(LEVELS), np.float32(0.5)
    grey, above = np.empty((2, width), np.int32)
    red, blue = np.empty((2, width), np.int32)
    for y in range(height):
        row, pairs = picture[y].ravel(), luma[y + BORDER - 1, BORDER:-BORDER].ravel()
        differences = colour[y + BORDER, BORDER:-BORDER].ravel()
        above[:] = grey
        for x in range(width):  # three loops: each is vectorised by itself
            r, g, b = np.float32(row[3 * x]), np.float32(row[3 * x + 1]), np.float32(row[3 * x + 2])
            sum_ = np.float32(0.299) * r + np.float32(0.587) * g + np.float32(0.114) * b
            grey[x] = np.int32(levels * sum_ + half)
            red[x], blue[x] = np.int32(levels * r) - grey[x], np.int32(levels * b) - grey[x]
        if y == 0:
            above[:] = grey
        for x in range(width):
            pairs[2 * x], pairs[2 * x + 1] = np.int16(above[x]), np.int16(grey[x])
        for x in range(width):
            differences[2 * x], differences[2 * x + 1] = np.int16(red[x]), np.int16(blue[x])
    pairs = luma[height + BORDER - 1, BORDER:-BORDER].ravel()
    for x in range(width):
        pairs[2 * x], pairs[2 * x + 1] = np.int16(grey[x]), np.int16(grey[x])
    _repeat_sides(luma)
    for y in range(BORDER):  # of pairs, the first and the last with one pixel twice are these
        luma[y] = luma[BORDER - 1]
        luma[height + BORDER + y] = luma[height + BORDER - 1]
    _repeat_edges(colour)


@njit(cache=True, nogil=True)
def _repeat_sides(plane):  # type: ignore[no-untyped-def]
    """Fill the columns at both ends of a plane, BORDER wide, with the pixels beside them."""
    for y in range(plane.shape[0]):
        for x in range(BORDER):
            plane[y, x] = plane[y, BORDER]
            plane[y, plane.shape[1] - 1 - x] = plane[y, plane.shape[1] - 1 - BORDER]


@njit(cache=True, nogil=True)
def _repeat_edges(plane):  # type: ignore[no-untyped-def]
    """Fill the border of a plane, BORDER wide, with the pixels beside it."""
    _repeat_sides(plane)
    for y in range(BORDER):
        plane[y] = plane[BORDER]
        plane[plane.shape[0] - 1 - y] = plane[plane.shape[0] - 1 - BORDER]


@njit(cache=True, nogil=True)
def mark_contours(disparity: FloatMap, tolerance: float, fetchable: FloatMap) -> None:
    """A map with a border of repeated edge pixels, and CONTOUR where a fetch would cross a depth edge.

    That is where the 4 x 4 pixels around the point differ by more than twice the tolerance, or the inner
    2 x 2 by more than once: these must agree by themselves, since one of them alone is asked.

    Args:
        disparity: float32 (H, W), px.
        tolerance: px.
        fetchable: float32 (H + 2 BORDER, W + 2 BORDER), overwritten.
    """
    height, width = disparity.shape
    high, low = np.empty(width + 3, np.float32), np.empty(width + 3, np.float32)
    high_two, low_two = np.empty(width + 1, np.float32), np.empty(width + 1, np.float32)
    near, twice = np.float32(tolerance), np.float32(2 * tolerance)
    for y in range(height):
        above, here = disparity[max(y - 1, 0)], disparity[y]
        below, last = disparity[min(y + 1, height - 1)], disparity[min(y + 2, height - 1)]
        for x in range(width):
            high_two[x], low_two[x] = max(here[x], below[x]), min(here[x], below[x])
        for x in range(width):
            high[x + 1] = max(high_two[x], max(above[x], last[x]))
            low[x + 1] = min(low_two[x], min(above[x], last[x]))
        for ends in (high, low):
            ends[0] = ends[1]
            ends[-2:] = ends[-3]
        high_two[-1], low_two[-1] = high_two[-2], low_two[-2]
        out = fetchable[y + BORDER, BORDER:-BORDER]
        for x in range(width):
            four = max(max(high[x], high[x + 1]), max(high[x + 2], high[x + 3])) - min(
                min(low[x], low[x + 1]), min(low[x + 2], low[x + 3])
            )
            two = max(high_two[x], high_two[x + 1]) - min(low_two[x], low_two[x + 1])
            out[x] = CONTOUR if (four > twice) | (two > near) else here[x]
    _repeat_edges(fetchable)


@njit(cache=True, nogil=True)
def extent(disparity):  # type: ignore[no-untyped-def]
    """The least and the greatest number of a map, float32 (H, W); (0, 0) where there is none."""
    height, width = disparity.shape
    least, most = np.full(width, np.inf, np.float32), np.full(width, -np.inf, np.float32)
    for y in range(height):
        for x in range(width):  # by column, which is vectorised; NaN is neither less nor more
            d = disparity[y, x]
            least[x] = d if d < least[x] else least[x]
            most[x] = d if d > most[x] else most[x]
    low, high = least.min(), most.max()
    return (low, high) if low <= high else (np.float32(0), np.float32(0))

"""A decoded picture and its disparity made ready for being fetched from by runs of pixels."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.prediction_runs import MIDDLE

Plane = NDArray[np.uint8]
IntMap = NDArray[np.int32]

BORDER = 2
"""Pixels that planes are continued by on each side."""


@njit(cache=True, nogil=True)
def pair_luma(luma: Plane, out: IntMap) -> None:
    """Luma less MIDDLE, each pixel with the one below it in one number, the upper one in the lower half.

    Args:
        luma: uint8 (H, W).
        out: int32 (H + 2 BORDER, W + 2 BORDER), overwritten; the edges are repeated.
    """
    height, width = luma.shape
    middle, mask = np.int32(MIDDLE), np.int32(0xFFFF)
    for y in range(-BORDER, height + BORDER):
        above = luma[min(max(y, 0), height - 1)]
        below = luma[min(max(y + 1, 0), height - 1)]
        line = out[y + BORDER, BORDER : BORDER + width]
        for x in range(width):  # vectorised
            high, low = np.int32(below[x]) - middle, np.int32(above[x]) - middle
            line[x] = (high << np.int32(16)) | (low & mask)
        _repeat_ends(out[y + BORDER])


@njit(cache=True, nogil=True)
def pair_chroma(blue: Plane, red: Plane, out: IntMap) -> None:
    """Cb and Cr of each sample in one number, Cb in the lower half.

    Args:
        blue, red: uint8 (H, W).
        out: int32 (H + 2 BORDER, W + 2 BORDER), overwritten; the edges are repeated.
    """
    height, width = blue.shape
    for y in range(-BORDER, height + BORDER):
        at = min(max(y, 0), height - 1)
        one, other = blue[at], red[at]
        line = out[y + BORDER, BORDER : BORDER + width]
        for x in range(width):  # vectorised
            line[x] = np.int32(one[x]) | (np.int32(other[x]) << np.int32(16))
        _repeat_ends(out[y + BORDER])


@njit(cache=True, nogil=True)
def widen_map(disparity: IntMap, out: IntMap) -> None:
    """A map, int32 (H, W), in the middle of `out`, int32 (H + 2 BORDER, W + 2 BORDER); the edges repeated."""
    height, width = disparity.shape
    for y in range(-BORDER, height + BORDER):
        row, line = disparity[min(max(y, 0), height - 1)], out[y + BORDER, BORDER : BORDER + width]
        for x in range(width):  # vectorised
            line[x] = row[x]
        _repeat_ends(out[y + BORDER])


@njit(cache=True, nogil=True, inline="always")
def _repeat_ends(line):  # type: ignore[no-untyped-def]
    for x in range(BORDER):
        line[x] = line[BORDER]
        line[line.size - 1 - x] = line[line.size - 1 - BORDER]

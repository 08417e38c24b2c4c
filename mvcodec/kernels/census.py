"""Census transform and the distance of its bit strings (Zabih and Woodfill 1994; thesis equation 3.7)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def census_transform(grey: NDArray[np.uint8], radius_x: int, radius_y: int) -> NDArray[np.uint64]:
    """One bit for each neighbour in the window: whether it is darker than the centre.

    Args:
        grey: uint8 (H, W); repeated beyond its borders.
        radius_x, radius_y: the window is (2 * radius_x + 1) x (2 * radius_y + 1), of 65 pixels at most.

    Returns:
        uint64 (H, W); neighbours in row order, the first one in the highest of the bits used.
    """
    height, width = grey.shape
    bits = np.zeros((height, width), np.uint64)
    for y in range(height):
        for dy in range(-radius_y, radius_y + 1):
            row = min(max(y + dy, 0), height - 1)
            for dx in range(-radius_x, radius_x + 1):
                if dx == 0 and dy == 0:
                    continue
                for x in range(width):
                    column = min(max(x + dx, 0), width - 1)
                    darker = np.uint64(grey[row, column] < grey[y, x])
                    bits[y, x] = (bits[y, x] << np.uint64(1)) | darker
    return bits


@njit(cache=True, nogil=True, inline="always")
def hamming(first: np.uint64, second: np.uint64) -> np.int64:
    """How many bits differ."""
    bits = first ^ second
    bits = bits - ((bits >> np.uint64(1)) & np.uint64(0x5555555555555555))
    bits = (bits & np.uint64(0x3333333333333333)) + ((bits >> np.uint64(2)) & np.uint64(0x3333333333333333))
    bits = (bits + (bits >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((bits * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, nogil=True)
def _darker(centre, other, bit, bits):  # type: ignore[no-untyped-def]
    for x in range(centre.size):
        bits[x] |= np.uint8(bit) if other[x] < centre[x] else np.uint8(0)


@njit(cache=True, nogil=True)
def census_rows(grey: NDArray[np.uint8], radius_x: int, radius_y: int, bits: NDArray[np.uint8]) -> None:
    """The bits of `census_transform`, eight to a byte.

    Args:
        grey: uint8 (H, W); repeated beyond its borders.
        radius_x, radius_y: as in `census_transform`, without its limit.
        bits: uint8 (H, B, W), written; neighbours in row order, the first one in the lowest bit of the
            first byte.
    """
    height, width = grey.shape
    bits[:] = 0
    wide = np.empty((height, width + 2 * radius_x), np.uint8)
    for y in range(height):
        wide[y, :radius_x], wide[y, radius_x + width :] = grey[y, 0], grey[y, width - 1]
        wide[y, radius_x : radius_x + width] = grey[y]
    for y in range(height):
        place = 0
        for dy in range(-radius_y, radius_y + 1):
            row = min(max(y + dy, 0), height - 1)
            for dx in range(2 * radius_x + 1):
                if dx == radius_x and dy == 0:
                    continue
                _darker(grey[y], wide[row, dx : dx + width], 1 << place % 8, bits[y, place // 8])
                place += 1

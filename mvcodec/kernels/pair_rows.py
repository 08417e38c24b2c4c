"""Row loops of pair synthesis: forward mapping, blending, nearest known pixel."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def forward_sources(
    shift_px: NDArray[np.int32], nearness: NDArray[np.float32], usable: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """Which pixel of its row lands on each place when pixel x moves to ``x - shift_px``.

    Args:
        shift_px: int32 (H, W), px to the left.
        nearness: float32 (H, W); where several pixels land on one place the largest wins, the last of equals.
        usable: bool (H, W); the others stay away.

    Returns:
        int32 (H, W): source column, -1 where nothing lands (a hole).
    """
    height, width = shift_px.shape
    source = np.full((height, width), -1, np.int32)
    for y in range(height):
        for x in range(width):
            if not usable[y, x]:
                continue
            target = x - shift_px[y, x]
            if not 0 <= target < width:
                continue
            rival = source[y, target]
            if rival < 0 or nearness[y, x] >= nearness[y, rival]:
                source[y, target] = x
    return source


@njit(cache=True, nogil=True)
def blend_pair(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    left_disparity: NDArray[np.float32],
    left_seen: NDArray[np.uint8],
    right_seen: NDArray[np.uint8],
    source: NDArray[np.int32],
    right_shift_px: NDArray[np.int32],
    left_weight: float,
) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.uint8]]:
    """Fetch and blend the two pictures of a pair at the sources of `forward_sources`.

    Args:
        left, right: uint8 (H, W, 3).
        left_disparity: float32 (H, W), px.
        left_seen, right_seen: uint8 (H, W), real cameras behind each pixel; 0 = filled or black.
        source: int32 (H, W), column in the left picture, -1 = hole.
        right_shift_px: int32 (H, W), by pixel of the left picture: x is at ``x - shift`` in the right one.
        left_weight: share of the left picture; it is 1 where the right one has nothing to show.

    Returns:
        uint8 (H, W, 3) pixels, rounded to nearest, holes black; float32 (H, W) disparity, px, in holes that
        of the left picture's pixel at the same place; uint8 (H, W) real cameras behind each.
    """
    height, width = source.shape
    pixels = np.zeros((height, width, 3), np.uint8)
    disparity = left_disparity.copy()
    seen = np.zeros((height, width), np.uint8)
    for y in range(height):
        for x in range(width):
            from_left = source[y, x]
            if from_left < 0:
                continue
            disparity[y, x] = left_disparity[y, from_left]
            from_right = from_left - right_shift_px[y, from_left]
            if 0 <= from_right < width and right_seen[y, from_right] > 0:
                seen[y, x] = left_seen[y, from_left] + right_seen[y, from_right]
                for channel in range(3):
                    mixed = left_weight * left[y, from_left, channel]
                    mixed += (1.0 - left_weight) * right[y, from_right, channel]
                    pixels[y, x, channel] = np.uint8(mixed + 0.5)
            else:
                seen[y, x] = left_seen[y, from_left]
                for channel in range(3):
                    pixels[y, x, channel] = left[y, from_left, channel]
    return pixels, disparity, seen


@njit(cache=True, nogil=True)
def nearest_known(known: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Column of the nearest known pixel of each pixel's row, the left one of two equally near.

    Args:
        known: bool (H, W).

    Returns:
        int32 (H, W); -1 in a row without a known pixel.
    """
    height, width = known.shape
    nearest = np.full((height, width), -1, np.int32)
    for y in range(height):
        last = -1
        for x in range(width):
            if known[y, x]:
                last = x
            nearest[y, x] = last
        last = -1
        for x in range(width - 1, -1, -1):
            if known[y, x]:
                last = x
            if last >= 0 and (nearest[y, x] < 0 or last - x < x - nearest[y, x]):
                nearest[y, x] = last
    return nearest


@njit(cache=True, nogil=True)
def filled_along_rows(
    pixels: NDArray[np.uint8], disparity: NDArray[np.float32], nearest: NDArray[np.int32]
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Copy into each pixel what its row's nearest known pixel holds.

    Args:
        pixels: uint8 (H, W, 3).
        disparity: float32 (H, W), px.
        nearest: int32 (H, W), of `nearest_known`; where it is -1 nothing changes.

    Returns:
        The filled pixels and disparity, of the same shapes.
    """
    height, width = nearest.shape
    filled_pixels, filled_disparity = pixels.copy(), disparity.copy()
    for y in range(height):
        for x in range(width):
            known = nearest[y, x]
            if known >= 0 and known != x:
                filled_disparity[y, x] = disparity[y, known]
                for channel in range(3):
                    filled_pixels[y, x, channel] = pixels[y, known, channel]
    return filled_pixels, filled_disparity

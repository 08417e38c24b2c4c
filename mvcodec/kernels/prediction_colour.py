"""Planes of the picture that predicts another one, in whole numbers: the same bits everywhere.

See `mvcodec.kernels.prediction_depth`, and FORMAT.md ("Predicted pictures").
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.prediction_depth import FINE, HALF_SHIFT, TOLERANCE

Plane = NDArray[np.uint8]
IntMap = NDArray[np.int32]

PHASES = 16
TAP_SUM = 128
BORDER = 2
"""Pixels that planes are continued by on each side."""


@njit(cache=True, nogil=True, inline="always")
def _sees(y, x, d, shift_x, shift_y, own):  # type: ignore[no-untyped-def]
    """(seen, x, y in FINE-ths): where a camera has the view's point (x, y) at d, if it sees it."""
    height, width = own.shape
    at_x = FINE * x + ((shift_x * d + HALF_SHIFT) >> 16)
    at_y = FINE * y + ((shift_y * d + HALF_SHIFT) >> 16)
    column, row = (at_x + FINE // 2) >> 6, (at_y + FINE // 2) >> 6
    if not (0 <= column < width and 0 <= row < height):
        return False, at_x, at_y
    return abs(np.int64(own[row, column]) - d) <= TOLERANCE, at_x, at_y


@njit(cache=True, nogil=True, inline="always")
def _fetch(plane, taps, at_x, at_y, reach):  # type: ignore[no-untyped-def]
    """A value between pixels, times TAP_SUM squared; taps reach from 1 - reach to reach."""
    fine_x, fine_y = (at_x + 2) >> 2, (at_y + 2) >> 2
    left = (fine_x >> 4) + BORDER + 1 - reach
    top = (fine_y >> 4) + BORDER + 1 - reach
    by_x, by_y = taps[fine_x & 15], taps[fine_y & 15]
    total = np.int64(0)
    for v in range(2 * reach):
        line = np.int64(0)
        for u in range(2 * reach):
            line += by_x[u] * np.int64(plane[top + v, left + u])
        total += by_y[v] * line
    return total


@njit(cache=True, nogil=True)
def predict_luma(
    planes: NDArray[np.uint8],
    maps: NDArray[np.int32],
    shifts: NDArray[np.int64],
    weights: NDArray[np.int64],
    taps: NDArray[np.int64],
    disparity: IntMap,
    out: Plane,
    first: int,
    last: int,
) -> None:
    """Luma of a view from every camera that sees each pixel, rows first..last-1.

    A camera counts where its own disparity at the nearest pixel agrees. What none of them sees repeats
    the pixel beside its gap on the row whose disparity is the farther one.

    Args:
        planes: uint8 (N, H + 4, W + 4), continued by BORDER.
        maps: int32 (N, H, W), the cameras' own.
        shifts: int64 (N, 2), 65536ths of a pixel (x, y) from the view to the camera for each of disparity.
        weights: int64 (N,), above 0.
        taps: int64 (PHASES, 4), sums of TAP_SUM.
        disparity: int32 (H, W), the view's.
        out: uint8 (H, W), rows first..last-1 overwritten.
    """
    width = disparity.shape[1]
    seen = np.empty(width, np.bool_)
    scale = np.int64(TAP_SUM * TAP_SUM)
    for y in range(first, last):
        for x in range(width):
            d = np.int64(disparity[y, x])
            total = value = np.int64(0)
            for i in range(len(weights)):
                there, at_x, at_y = _sees(y, x, d, shifts[i, 0], shifts[i, 1], maps[i])
                if there:
                    value += weights[i] * _fetch(planes[i], taps, at_x, at_y, 2)
                    total += weights[i]
            seen[x] = total > 0
            if total > 0:
                total *= scale
                rounded = (2 * value + total) // (2 * total)
                out[y, x] = np.uint8(min(max(rounded, np.int64(0)), np.int64(255)))
        _repeat(seen, disparity[y], 1, out[y], 128)


@njit(cache=True, nogil=True)
def predict_chroma(
    planes: NDArray[np.uint8],
    maps: NDArray[np.int32],
    shifts: NDArray[np.int64],
    weights: NDArray[np.int64],
    taps: NDArray[np.int64],
    disparity: IntMap,
    out: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Chroma of a view, rows first..last-1 of the half-sized planes; as `predict_luma`, fetched linearly.

    Sample (j, i) has the disparity of pixel (2j, 2i), and is seen where that is.

    Args:
        planes: uint8 (N, 2, H / 2 + 4, W / 2 + 4), Cb and Cr, continued by BORDER.
        taps: int64 (PHASES, 2), sums of TAP_SUM.
        out: uint8 (2, H / 2, W / 2), rows first..last-1 overwritten.
    """
    width = out.shape[2]
    seen = np.empty(width, np.bool_)
    scale = np.int64(TAP_SUM * TAP_SUM)
    for y in range(first, last):
        for x in range(width):
            d = np.int64(disparity[2 * y, 2 * x])
            total = first_value = second_value = np.int64(0)
            for i in range(len(weights)):
                there, _, _ = _sees(2 * y, 2 * x, d, shifts[i, 0], shifts[i, 1], maps[i])
                if there:
                    at_x = FINE * x + ((shifts[i, 0] * d + 2 * HALF_SHIFT) >> 17)
                    at_y = FINE * y + ((shifts[i, 1] * d + 2 * HALF_SHIFT) >> 17)
                    first_value += weights[i] * _fetch(planes[i, 0], taps, at_x, at_y, 1)
                    second_value += weights[i] * _fetch(planes[i, 1], taps, at_x, at_y, 1)
                    total += weights[i]
            seen[x] = total > 0
            if total > 0:
                total *= scale
                out[0, y, x] = (2 * first_value + total) // (2 * total)
                out[1, y, x] = (2 * second_value + total) // (2 * total)
        _repeat(seen, disparity[2 * y], 2, out[0, y], 128)
        _repeat(seen, disparity[2 * y], 2, out[1, y], 128)


@njit(cache=True, nogil=True)
def _repeat(seen, disparity, step, line, fallback):  # type: ignore[no-untyped-def]
    """Fill one row's gaps from the end of each whose disparity is the farther one (left where equal)."""
    width = seen.size
    x = 0
    while x < width:
        if seen[x]:
            x += 1
            continue
        end = x
        while end < width and not seen[end]:
            end += 1
        source = -1
        if x > 0:
            source = x - 1
        if end < width and (source < 0 or disparity[step * end] < disparity[step * source]):
            source = end
        line[x:end] = line[source] if source >= 0 else fallback
        x = end

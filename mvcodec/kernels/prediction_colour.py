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
    return abs(np.int64(own[np.uintp(row), np.uintp(column)]) - d) <= TOLERANCE, at_x, at_y


@njit(cache=True, nogil=True, inline="always")
def _line(plane, row, left, a, b, c, d):  # type: ignore[no-untyped-def]
    # Indices without a sign: nothing asks whether they count from the end.
    y = np.uintp(row)
    value = a * plane[y, np.uintp(left)] + b * plane[y, np.uintp(left + 1)]
    return value + c * plane[y, np.uintp(left + 2)] + d * plane[y, np.uintp(left + 3)]


@njit(cache=True, nogil=True, inline="always")
def _fetch_cubic(plane, taps, at_x, at_y):  # type: ignore[no-untyped-def]
    """A value between pixels, times TAP_SUM squared, from 4 x 4 of them."""
    fine_x, fine_y = (at_x + 2) >> 2, (at_y + 2) >> 2
    left, top = (fine_x >> 4) + BORDER - 1, (fine_y >> 4) + BORDER - 1
    x, y = np.uintp(fine_x & 15), np.uintp(fine_y & 15)
    a, b, c, d = taps[x, 0], taps[x, 1], taps[x, 2], taps[x, 3]
    total = taps[y, 0] * _line(plane, top, left, a, b, c, d)
    total += taps[y, 1] * _line(plane, top + 1, left, a, b, c, d)
    total += taps[y, 2] * _line(plane, top + 2, left, a, b, c, d)
    return total + taps[y, 3] * _line(plane, top + 3, left, a, b, c, d)


@njit(cache=True, nogil=True, inline="always")
def _fetch_linear(plane, taps, at_x, at_y):  # type: ignore[no-untyped-def]
    """A value between pixels, times TAP_SUM squared, from 2 x 2 of them."""
    fine_x, fine_y = (at_x + 2) >> 2, (at_y + 2) >> 2
    left, top = (fine_x >> 4) + BORDER, (fine_y >> 4) + BORDER
    u, v, row, below = np.uintp(left), np.uintp(left + 1), np.uintp(top), np.uintp(top + 1)
    x, y = np.uintp(fine_x & 15), np.uintp(fine_y & 15)
    upper = taps[x, 0] * plane[row, u] + taps[x, 1] * plane[row, v]
    lower = taps[x, 0] * plane[below, u] + taps[x, 1] * plane[below, v]
    return taps[y, 0] * upper + taps[y, 1] * lower


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
    values, totals = np.empty(width, np.int64), np.empty(width, np.int64)
    scale = np.int64(TAP_SUM * TAP_SUM)
    for y in range(first, last):
        values[:] = 0
        totals[:] = 0
        here = disparity[y]
        for i in range(len(weights)):
            own, plane, weight = maps[i], planes[i], weights[i]
            shift_x, shift_y = shifts[i, 0], shifts[i, 1]
            for x in range(width):
                there, at_x, at_y = _sees(y, x, np.int64(here[x]), shift_x, shift_y, own)
                if there:
                    values[x] += weight * _fetch_cubic(plane, taps, at_x, at_y)
                    totals[x] += weight
        for x in range(width):
            if totals[x] > 0:
                total = totals[x] * scale
                rounded = (2 * values[x] + total) // (2 * total)
                out[y, x] = np.uint8(min(max(rounded, np.int64(0)), np.int64(255)))
        seen = totals > 0
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
    values, totals = np.empty((2, width), np.int64), np.empty(width, np.int64)
    scale = np.int64(TAP_SUM * TAP_SUM)
    for y in range(first, last):
        values[:] = 0
        totals[:] = 0
        here = disparity[2 * y]
        for i in range(len(weights)):
            own, blue, red, weight = maps[i], planes[i, 0], planes[i, 1], weights[i]
            shift_x, shift_y = shifts[i, 0], shifts[i, 1]
            for x in range(width):
                d = np.int64(here[2 * x])
                there, _, _ = _sees(2 * y, 2 * x, d, shift_x, shift_y, own)
                if there:
                    at_x = FINE * x + ((shift_x * d + 2 * HALF_SHIFT) >> 17)
                    at_y = FINE * y + ((shift_y * d + 2 * HALF_SHIFT) >> 17)
                    values[0, x] += weight * _fetch_linear(blue, taps, at_x, at_y)
                    values[1, x] += weight * _fetch_linear(red, taps, at_x, at_y)
                    totals[x] += weight
        for x in range(width):
            if totals[x] > 0:
                total = totals[x] * scale
                out[0, y, x] = (2 * values[0, x] + total) // (2 * total)
                out[1, y, x] = (2 * values[1, x] + total) // (2 * total)
        seen = totals > 0
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

"""Planes of the picture that predicts another one, in whole numbers: the same bits everywhere.

See `mvcodec.kernels.prediction_depth`, and FORMAT.md ("Predicted pictures"). Sums are kept in float64, which
holds whole numbers of this size exactly, and whose quotients, rounded down, are those of whole numbers.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.prediction_depth import FINE, HALF_SHIFT, TOLERANCE
from mvcodec.kernels.view_vectors import fetch_colour, fetch_luma

Plane = NDArray[np.uint8]
IntMap = NDArray[np.int32]

PHASES = 16
TAP_SUM = 128
BORDER = 2
"""Pixels that planes are continued by on each side."""


@njit(cache=True, nogil=True, inline="always")
def _fine(x, shift, d, step):  # type: ignore[no-untyped-def]
    """Where a camera has column (or row) x at disparity d, in FINE-ths of a sample, `step` px wide."""
    return np.int32(FINE * x) + np.int32((np.int64(shift) * np.int64(d) + step * HALF_SHIFT) >> (15 + step))


@njit(cache=True, nogil=True, inline="always")
def _locate(y, disparity, step, shift_x, shift_y, shape, pixels, places, phases):  # type: ignore[no-untyped-def]
    """Where a camera sees a row's samples: the nearest pixel (flat index, -1 outside), and where to fetch.

    Args:
        y: the row of samples; disparity: int32, of its pixels; step: pixels from sample to sample.
        shape: (height, width) of the camera's map.
        pixels, places, phases: int32, written for each sample.
    """
    height, width = np.int32(shape[0]), np.int32(shape[1])
    stride = width // np.int32(step) + np.int32(2 * BORDER)
    half = np.int32(FINE // 2)
    for x in range(pixels.size):  # vectorised: no branch
        d = disparity[step * x]
        column = (_fine(step * x, shift_x, d, 1) + half) >> np.int32(6)
        row = (_fine(step * y, shift_y, d, 1) + half) >> np.int32(6)
        inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
        pixels[x] = row * width + column if inside else np.int32(-1)
        across = (_fine(x, shift_x, d, step) + np.int32(2)) >> np.int32(2)
        down = (_fine(y, shift_y, d, step) + np.int32(2)) >> np.int32(2)
        left, top = (across >> np.int32(4)) + np.int32(BORDER), (down >> np.int32(4)) + np.int32(BORDER)
        places[x] = top * stride + left
        phases[x] = ((down & np.int32(15)) << np.int32(4)) + (across & np.int32(15))


@njit(cache=True, nogil=True, error_model="numpy")
def _divide(values, totals, out):  # type: ignore[no-untyped-def]
    """Means of a row, rounded and kept within 0..255; 0 where no camera counted."""
    scale = float(TAP_SUM * TAP_SUM)
    for x in range(out.size):  # vectorised
        total = scale * max(totals[x], 1.0)
        out[x] = np.uint8(min(max(np.floor((2.0 * values[x] + total) / (2.0 * total)), 0.0), 255.0))


@njit(cache=True, nogil=True)
def predict_luma(
    planes: NDArray[np.int16],
    maps: NDArray[np.int32],
    shifts: NDArray[np.int32],
    weights: NDArray[np.int64],
    taps: NDArray[np.int16],
    disparity: IntMap,
    out: Plane,
    first: int,
    last: int,
) -> None:
    """Luma of a view from every camera that sees each pixel, rows first..last-1.

    A camera counts where its own disparity at the nearest pixel agrees. What none of them sees repeats
    the pixel beside its gap on the row whose disparity is the farther one.

    Args:
        planes: int16 (N, H + 4, W + 4), 0..255, continued by BORDER.
        maps: int32 (N, H, W), the cameras' own.
        shifts: int32 (N, 2), 65536ths of a pixel (x, y) from the view to the camera for each of disparity.
        weights: int64 (N,), above 0.
        taps: int16, flat: `view_vectors.SHARES` for each of PHASES down and PHASES to the right, sums of
            TAP_SUM squared.
        disparity: int32 (H, W), the view's.
        out: uint8 (H, W), rows first..last-1 overwritten.
    """
    shape = disparity.shape
    width = shape[1]
    size, stride = planes[0].size, np.uintp(planes.shape[2])
    flat, own = planes.ravel(), maps.ravel()
    values, totals = np.empty(width, np.float64), np.empty(width, np.float64)
    pixels, places, phases = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
    for y in range(first, last):
        values[:] = 0
        totals[:] = 0
        here = disparity[y]
        for i in range(len(weights)):
            weight = weights[i]
            plane, of_map = np.uintp(i * size), np.uintp(i * disparity.size)
            _locate(y, here, 1, shifts[i, 0], shifts[i, 1], shape, pixels, places, phases)
            for x in range(width):
                if pixels[x] >= 0 and abs(own[of_map + np.uintp(pixels[x])] - here[x]) <= TOLERANCE:
                    found = fetch_luma(flat, taps, plane + np.uintp(places[x]), stride, np.uintp(phases[x]))
                    values[x] += np.float64(weight * found)
                    totals[x] += np.float64(weight)
        _divide(values, totals, out[y])
        _repeat(totals, here, 1, out[y], 128)


@njit(cache=True, nogil=True)
def predict_chroma(
    planes: NDArray[np.int16],
    maps: NDArray[np.int32],
    shifts: NDArray[np.int32],
    weights: NDArray[np.int64],
    taps: NDArray[np.int16],
    disparity: IntMap,
    out: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Chroma of a view, rows first..last-1 of the half-sized planes; as `predict_luma`, fetched linearly.

    Sample (j, i) has the disparity of pixel (2j, 2i), and is seen where that is.

    Args:
        planes: int16 (N, H / 2 + 4, W / 2 + 4, 2), Cb and Cr, 0..255, continued by BORDER.
        out: uint8 (2, H / 2, W / 2), rows first..last-1 overwritten.
    """
    shape, width = disparity.shape, out.shape[2]
    size, stride = planes[0].size // 2, np.uintp(planes.shape[2])
    flat, own = planes.ravel(), maps.ravel()
    values, totals = np.empty((2, width), np.float64), np.empty(width, np.float64)
    pixels, places, phases = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
    for y in range(first, last):
        values[:] = 0
        totals[:] = 0
        here = disparity[2 * y]
        for i in range(len(weights)):
            weight = weights[i]
            plane, of_map = np.uintp(i * size), np.uintp(i * disparity.size)
            _locate(y, here, 2, shifts[i, 0], shifts[i, 1], shape, pixels, places, phases)
            for x in range(width):
                if pixels[x] >= 0 and abs(own[of_map + np.uintp(pixels[x])] - here[2 * x]) <= TOLERANCE:
                    place, phase = plane + np.uintp(places[x]), np.uintp(phases[x])
                    blue, red = fetch_colour(flat, taps, place, stride, phase)
                    values[0, x] += np.float64(weight * blue)
                    values[1, x] += np.float64(weight * red)
                    totals[x] += np.float64(weight)
        for plane_out, value in ((out[0, y], values[0]), (out[1, y], values[1])):
            _divide(value, totals, plane_out)
            _repeat(totals, here, 2, plane_out, 128)


@njit(cache=True, nogil=True)
def _repeat(totals, disparity, step, line, fallback):  # type: ignore[no-untyped-def]
    """Fill one row's gaps from the end of each whose disparity is the farther one (left where equal)."""
    width = totals.size
    x = 0
    while x < width:
        if totals[x] > 0:
            x += 1
            continue
        end = x
        while end < width and totals[end] == 0:
            end += 1
        source = -1
        if x > 0:
            source = x - 1
        if end < width and (source < 0 or disparity[step * end] < disparity[step * source]):
            source = end
        line[x:end] = line[source] if source >= 0 else fallback
        x = end

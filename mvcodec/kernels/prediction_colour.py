"""Planes of the picture that predicts another one, in whole numbers: the same bits everywhere.

See `mvcodec.kernels.prediction_depth`, and FORMAT.md ("Predicted pictures"). Sums are kept in float64, which
holds whole numbers of this size exactly, and whose quotients, rounded down, are those of whole numbers.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.prediction_planes import BORDER
from mvcodec.kernels.prediction_runs import (
    TAP_BITS,
    UNSEEN,
    look,
    look_above,
    look_beside,
    place_columns,
    place_rows,
    sample_columns,
    sample_rows,
    tint,
    tint_above,
    tint_beside,
)
from mvcodec.kernels.view_fetch import distinct

Plane = NDArray[np.uint8]
IntMap = NDArray[np.int32]

KINDS = 4
"""Numbers that say where a camera sees a pixel along one axis."""

FALLBACK = 128
"""In a row that no camera sees."""


@njit(cache=True, nogil=True)
def predict(
    cameras: NDArray[np.int64],
    shifts: NDArray[np.int32],
    weights: NDArray[np.int64],
    disparity: IntMap,
    luma: Plane,
    chroma: Plane,
    first: int,
    last: int,
) -> None:
    """Planes of a view from the cameras that see each pixel: rows first..last-1 of chroma, and those of luma.

    A camera counts where its own disparity at the nearest pixel agrees. What none of them sees repeats
    the pixel beside its gap on the row whose disparity is the farther one. Sample (j, i) of chroma has the
    disparity of pixel (2j, 2i), and is seen where that is.

    Args:
        cameras: int64 (N, 3), addresses of their first pixels in planes of luma, chroma and disparity of the
            view's size, see `prediction_planes`; round about these is memory that runs of pixels may read.
        shifts: int32 (N, 2), 65536ths of a pixel (x, y) from the view to the camera for each of disparity.
        weights: int64 (N,), above 0.
        disparity: int32 (H, W), the view's; even sizes.
        luma: uint8 (H, W); chroma: uint8 (2, H / 2, W / 2); overwritten.
    """
    height, width = disparity.shape
    count, half, room = len(weights), width // 2, (width + 2 * COUNT - 1) // (2 * COUNT) * (2 * COUNT)
    axes = distinct(shifts[:, 0]), distinct(shifts[:, 1])
    columns, rows = np.zeros(count * KINDS * room, np.int32), np.zeros(count * KINDS * room, np.int32)
    here, seen = np.zeros(room, np.int32), np.full((count, room), UNSEEN, np.int32)
    tinted = np.empty((2, count, room // 2), np.int32)
    values, totals = np.empty(width, np.float64), np.empty(width, np.float64)
    for y in range(2 * first, 2 * last):
        here[:width] = disparity[y]
        _look_at_row(y, height, width, cameras, shifts, axes, here, columns, rows, seen)
        _mix(seen, weights, here, values, totals, luma[y])
        if y % 2 == 0:
            seen[:, width:] = UNSEEN  # no sample may be fetched for these
            for x in range(half):
                here[x] = disparity[y, 2 * x]
            _tint_row(y // 2, half, cameras, shifts, axes, here, columns, rows, seen, tinted)
            for plane in range(2):
                _mix(tinted[plane], weights, here, values[:half], totals[:half], chroma[plane, y // 2])


@njit(cache=True, nogil=True, inline="always")
def _look_at_row(y, height, width, cameras, shifts, axes, here, columns, rows, seen):  # type: ignore[no-untyped-def]
    """Luma of a row's pixels as each camera has it; see `prediction_runs.look`."""
    (right, which_right), (down, which_down) = axes
    room, stride = here.size, width + 2 * BORDER
    for x in range(0, width, COUNT):
        for k in range(right.size):
            axis = np.int32(x), np.int32(width), right[k], np.int32(1)
            place_columns(here, columns, x, (k * KINDS * room + x, room), axis)
        for k in range(down.size):
            if down[k] != 0:
                axis = np.int32(y), np.int32(height), down[k], np.int32(stride)
                place_rows(here, rows, x, (k * KINDS * room + x, room), axis)
    for i in range(cameras.shape[0]):
        column, row = which_right[i] * KINDS * room, which_down[i] * KINDS * room
        camera, out = (cameras[i, 0], cameras[i, 2], stride), seen[i]
        for x in range(0, width, COUNT):
            places = y * stride + x, column + x, row + x, room
            if shifts[i, 1] == 0:
                look_beside(here, columns, rows, out, x, camera, places)
            elif shifts[i, 0] == 0:
                look_above(here, columns, rows, out, x, camera, places)
            else:
                look(here, columns, rows, out, x, camera, places)


@njit(cache=True, nogil=True, inline="always")
def _tint_row(y, width, cameras, shifts, axes, here, columns, rows, seen, tinted):  # type: ignore[no-untyped-def]
    """Chroma of a row's samples as each camera has it; see `prediction_runs.tint`."""
    (right, which_right), (down, which_down) = axes
    room, stride = here.size, width + 2 * BORDER
    for x in range(0, width, COUNT):
        for k in range(right.size):
            sample_columns(here, columns, x, (k * KINDS * room + x, room), (right[k], np.int32(1)))
        for k in range(down.size):
            if down[k] != 0:
                sample_rows(here, rows, x, (k * KINDS * room + x, room), (down[k], np.int32(stride)))
    for i in range(cameras.shape[0]):
        column, row = which_right[i] * KINDS * room, which_down[i] * KINDS * room
        camera, pixels, blue, red = (cameras[i, 1], stride), seen[i], tinted[0, i], tinted[1, i]
        for x in range(0, width, COUNT):
            places = y * stride + x, column + x, row + x, room
            if shifts[i, 1] == 0:
                tint_beside(pixels, columns, rows, blue, red, x, camera, places)
            elif shifts[i, 0] == 0:
                tint_above(pixels, columns, rows, blue, red, x, camera, places)
            else:
                tint(pixels, columns, rows, blue, red, x, camera, places)


@njit(cache=True, nogil=True, error_model="numpy")
def _mix(fetched, weights, disparity, values, totals, out):  # type: ignore[no-untyped-def]
    """Means of a row by the cameras' weights, rounded, within 0..255; gaps repeat what is beside them."""
    values[:] = 0
    totals[:] = 0
    for i in range(len(weights)):
        weight, row = np.float64(weights[i]), fetched[i]
        for x in range(out.size):  # vectorised
            part = weight if row[x] != np.int32(UNSEEN) else 0.0
            values[x] += part * np.float64(row[x])
            totals[x] += part
    scale, gaps = float(1 << 2 * TAP_BITS), 0
    for x in range(out.size):  # vectorised
        total = scale * max(totals[x], 1.0)
        out[x] = np.uint8(min(max(np.floor((2.0 * values[x] + total) / (2.0 * total)), 0.0), 255.0))
    for x in range(out.size):  # vectorised
        gaps += totals[x] == 0
    if gaps:
        _repeat(totals, disparity, out)


@njit(cache=True, nogil=True)
def _repeat(totals, disparity, line):  # type: ignore[no-untyped-def]
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
        if end < width and (source < 0 or disparity[end] < disparity[source]):
            source = end
        line[x:end] = line[source] if source >= 0 else FALLBACK
        x = end

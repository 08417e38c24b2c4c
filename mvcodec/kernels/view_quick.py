"""Colour at a virtual view at the least cost, for pictures that move: linear fetch, in whole numbers.

A pixel is four bytes: red, green, blue, and 1, which comes out as the sum of the weights.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.quick_runs import add_run, place_columns, place_rows, store_run
from mvcodec.kernels.runs import PLACES
from mvcodec.kernels.view_fetch import distinct

FloatMap = NDArray[np.float32]

WEIGHTS = 256
"""The weights of a view's cameras may sum up to this, so that no lane overflows."""


@njit(cache=True, nogil=True)
def pack(
    picture: NDArray[np.uint8], disparity: FloatMap, packed: NDArray[np.uint32], own: NDArray[np.float32]
) -> None:
    """RGB to pixels of four bytes, and a map laid out alike: both with their last row and column twice.

    Args:
        picture: uint8 (H, W, 3).
        disparity: float32 (H, W), px.
        packed: uint32 (H + 1, W + 1), overwritten; see `view_planes.reserve`.
        own: float32 (H + 1, W + 1), overwritten.
    """
    height, width, _ = picture.shape
    one = np.uint32(1) << np.uint32(24)
    for y in range(height):
        row, out = picture[y].ravel(), packed[y]
        for x in range(width):
            red, green, blue = np.uint32(row[3 * x]), np.uint32(row[3 * x + 1]), np.uint32(row[3 * x + 2])
            out[x] = red | (green << np.uint32(8)) | (blue << np.uint32(16)) | one
        own[y, :width] = disparity[y]
        packed[y, width], own[y, width] = packed[y, width - 1], own[y, width - 1]
    packed[height], own[height] = packed[height - 1], own[height - 1]


@njit(cache=True, nogil=True)
def blend(
    cameras: NDArray[np.int64],
    packed: NDArray[np.uint32],
    own: NDArray[np.float32],
    shifts: NDArray[np.float32],
    weights: NDArray[np.uint64],
    view_disparity: FloatMap,
    tolerance: float,
    out: NDArray[np.uint8],
    seen_by: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Colour of a view from every camera that sees each pixel, rows first..last-1.

    A camera counts where its own disparity at the pixel nearest to the place agrees. Places are rounded to
    1 / STEPS px, what each camera contributes to whole grey levels.

    Args:
        cameras: int64 (N,), which of the R real cameras see the view.
        packed, own: uint32 and float32 (R, H + 1, W + 1), of every real camera; see `pack`.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: uint64 (N,), above 0, in all at most WEIGHTS.
        view_disparity: float32 (H, W), known everywhere.
        tolerance: px within which disparities are one surface.
        out: uint8 (H, W, 3) RGB, C-contiguous, rows first..last-1 overwritten; black where no camera
            sees the pixel.
        seen_by: uint8 (H, W), overwritten with the number of cameras; 0 where none sees the pixel.
    """
    height, width = view_disparity.shape
    stride = width + 1
    plane = (height + 1) * stride
    flat, depths, pixels = packed.ravel(), own.ravel(), out.ravel()
    columns_apart, column_of = distinct(shifts[:, 0])
    rows_apart, row_of = distinct(shifts[:, 1])
    columns = np.empty(PLACES * columns_apart.size, np.int32)
    rows = np.empty(PLACES * rows_apart.size, np.int32)
    near, none = np.float32(tolerance), np.int32(0)
    disparity = np.full(width + COUNT, np.nan, np.float32)
    sums, seen = np.empty(width + COUNT, np.uint64), np.empty(width + COUNT, np.uint8)
    end = np.empty(3 * COUNT, np.uint8)
    for y in range(first, last):
        disparity[:width] = view_disparity[y]
        sums[:] = 0
        seen[:] = 0
        for x in range(0, width, COUNT):
            at = np.int32(x), np.int32(y)
            for i in range(columns_apart.size):
                room, size, step = PLACES * i, np.int32(width), np.int32(1)
                place_columns(disparity, columns, room, at[0], at[1], size, columns_apart[i], step, none)
            for i in range(rows_apart.size):
                room, size, step = PLACES * i, np.int32(height), np.int32(stride)
                place_rows(disparity, rows, room, at[0], at[1], size, rows_apart[i], step, none)
            for i in range(cameras.size):
                column, row = PLACES * column_of[i], PLACES * row_of[i]
                add_run(
                    flat,
                    depths,
                    disparity,
                    columns,
                    rows,
                    sums,
                    seen,
                    cameras[i] * plane,
                    stride,
                    x,
                    column,
                    row,
                    weights[i],
                    near,
                )
        seen_by[y] = seen[:width]
        rest = width % COUNT
        for x in range(0, width - rest, COUNT):
            store_run(sums, x, pixels, 3 * (y * width + x))
        if rest:
            store_run(sums, width - rest, end, 0)
            pixels[3 * ((y + 1) * width - rest) : 3 * (y + 1) * width] = end[: 3 * rest]

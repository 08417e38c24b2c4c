"""Colour at a virtual view: fetched from the real cameras that see the pixel, and blended.

Pictures are fetched as luma (cubic) and two colour differences (linear): colour is smooth where it
comes out of a 4:2:0 stream, and half the arithmetic of three cubic fetches is saved. Both are linear,
so that luma of the result is that of a cubic fetch of RGB.

What cameras see is summed in fours: weighted Y, R - Y and B - Y, and the weights.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.runs import PLACES, marked
from mvcodec.kernels.view_fetch import BORDER, CONTOUR, corner_of, distinct, phase_of, place_of
from mvcodec.kernels.view_marks import list_bits
from mvcodec.kernels.view_runs import (
    add_run,
    add_run_above,
    add_run_beside,
    place_columns,
    place_rows,
    store_run,
)
from mvcodec.kernels.view_vectors import ONE, add_edge, add_fetched

FloatMap = NDArray[np.float32]
ByteMap = NDArray[np.uint8]


# Inlined: a call would pass each array in eight parts, and count its references, for a few numbers of work.


@njit(cache=True, nogil=True, inline="always")
def _see(x, y, d, shape, cameras, planes, shifts, weights, tolerance, edge_trust, fetching, sums):  # type: ignore[no-untyped-def]
    """Sum up what the cameras see of the view's point (x, y) at disparity d."""
    pairs, colour, depths, fetchable = planes
    height, width = shape
    stride, none = width + 2 * BORDER, np.uintp(0)
    sums[0] = sums[1] = sums[2] = sums[3] = np.float32(0)
    for i in range(cameras.size):
        at_x, at_y, inside = place_of(x, y, d, shifts[i, 0], shifts[i, 1], width, height)
        if inside:
            left, top = np.int32(at_x), np.int32(at_y)
            phase = np.uintp(phase_of(at_x - np.float32(left), at_y - np.float32(top)))
            place = np.uintp((cameras[i] * (height + 2 * BORDER) + top + BORDER) * stride + left + BORDER)
            here, below, weight = fetchable[place], np.uintp(stride), weights[i]
            if here == CONTOUR:
                corner, steps = corner_of(at_x, at_y, width, height)
                corner += np.uintp(cameras[i] * height * width)
                add_edge(
                    pairs,
                    colour,
                    depths,
                    fetching,
                    sums,
                    none,
                    place,
                    below,
                    corner,
                    steps,
                    phase,
                    d,
                    tolerance,
                    weight * edge_trust,
                )
            elif abs(here - d) <= tolerance:
                add_fetched(pairs, colour, fetching, sums, none, place, below, phase, weight)


@njit(cache=True, nogil=True, inline="always")
def _surfaces(x, y, view_disparity, tolerance, surface, part):  # type: ignore[no-untyped-def]
    """Lists the surfaces of a pixel's 3 x 3 window, its own first, and their parts; how many."""
    height, width = view_disparity.shape
    surface[0], part[0] = view_disparity[y, x], np.float32(1)
    count = 1
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            d = view_disparity[v, u]
            k = 0
            while k < count and abs(surface[k] - d) > tolerance:
                k += 1
            if k == count:
                surface[k], part[k] = d, np.float32(0)
                count += 1
            if v != y or u != x:
                part[k] += np.float32(1 / 2) if v == y or u == x else np.float32(1 / 3)
    return count


@njit(cache=True, nogil=True)
def _add_surfaces(y, chosen, seen, view_disparity, seeing, tolerance, sums):  # type: ignore[no-untyped-def]
    """Turn the own sums of the chosen pixels of row y into those of every surface of their 3 x 3 windows."""
    cameras, planes, shifts, weights, edge_trust, fetching = seeing
    others, surface, part = np.empty(4, np.float32), np.empty(9, np.float32), np.empty(9, np.float32)
    for x in chosen:
        if seen[x] > 0:  # with its neighbours' colour alone it would spread that into holes beside it
            count = _surfaces(x, y, view_disparity, tolerance, surface, part)
            at = 4 * x
            scale = part[0] / sums[at + 3]
            for value in range(3):
                sums[at + value] *= scale
            sums[at + 3] = part[0]
            for k in range(1, count):
                _see(
                    x,
                    y,
                    surface[k],
                    view_disparity.shape,
                    cameras,
                    planes,
                    shifts,
                    weights,
                    tolerance,
                    edge_trust,
                    fetching,
                    others,
                )
                if others[3] > 0:
                    scale = part[k] / others[3]
                    for value in range(3):
                        sums[at + value] += scale * others[value]
                    sums[at + 3] += part[k]


@njit(cache=True, nogil=True)
def _add_edges(  # type: ignore[no-untyped-def]
    planes, fetching, camera, weight, y, shift, shape, disparity, tolerance, chosen, sums, seen
):
    """Add what a camera sees at the chosen pixels of row y, at its contours."""
    pairs, colour, own, _ = planes
    height, width = shape
    stride = width + 2 * BORDER
    start, first = camera * (height + 2 * BORDER), np.uintp(camera * height * width)
    for x in chosen:
        d = disparity[x]
        at_x, at_y, _ = place_of(x, y, d, shift[0], shift[1], width, height)
        left, top = np.int32(at_x), np.int32(at_y)
        phase = np.uintp(phase_of(at_x - np.float32(left), at_y - np.float32(top)))
        place = np.uintp((start + top + BORDER) * stride + left + BORDER)
        corner, steps = corner_of(at_x, at_y, width, height)
        at, below = np.uintp(4) * np.uintp(x), np.uintp(stride)
        corner += first
        seen[x] += add_edge(
            pairs, colour, own, fetching, sums, at, place, below, corner, steps, phase, d, tolerance, weight
        )


@njit(cache=True, nogil=True)
def _mark_contours(y, view_disparity, tolerance, high, low, marks):  # type: ignore[no-untyped-def]
    """Mark the pixels of a row whose 3 x 3 window holds more than one surface."""
    height, width = view_disparity.shape
    above, here = view_disparity[max(y - 1, 0)], view_disparity[y]
    below = view_disparity[min(y + 1, height - 1)]
    for x in range(width):
        high[x + 1] = max(max(above[x], here[x]), below[x])
        low[x + 1] = min(min(above[x], here[x]), below[x])
    for ends in (high, low):
        ends[0], ends[width + 1] = ends[1], ends[width]
    for x in range(width):
        nearest = max(max(high[x], high[x + 1]), high[x + 2])
        farthest = min(min(low[x], low[x + 1]), low[x + 2])
        marks[x] = nearest - farthest > tolerance


@njit(cache=True, nogil=True)
def blend(
    cameras: NDArray[np.int64],
    planes: tuple[NDArray[np.int16], NDArray[np.int16], NDArray[np.float32], NDArray[np.float32]],
    shifts: NDArray[np.float32],
    weights: NDArray[np.float32],
    view_disparity: FloatMap,
    tolerance: float,
    edge_trust: float,
    sharpness: float,
    fetching: NDArray[np.int16],
    out: NDArray[np.uint8],
    seen_by: ByteMap,
    first: int,
    last: int,
) -> None:
    """Colour of a view from every camera that sees each pixel, rows first..last-1.

    A camera counts where its own disparity there agrees. At a contour the surfaces of the 3 x 3 window
    are blended (weight 1 / (1 + distance^2)), which gives the soft edge that a lens gives, and pixels at
    the cameras' own contours, whose colours are mixed, count `edge_trust` as much. Places are rounded
    to 1 / 32 px between two pixels.

    Args:
        cameras: int64 (N,), which of the R real cameras see the view.
        planes: of every real camera, see `view_planes.make_room`.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: float32 (N,), above 0.
        view_disparity: float32 (H, W), known everywhere.
        tolerance: px within which disparities are one surface.
        sharpness: Keys' parameter a of the cubic fetch of luma, -1..0.
        fetching: weights of that, see `view_vectors.fetch_weights`.
        out: uint8 (H, W, 3) RGB, C-contiguous, rows first..last-1 overwritten; black where no camera
            sees the pixel.
        seen_by: uint8 (H, W), overwritten with the number of cameras; 0 where none sees the pixel.
    """
    flat = planes[0].ravel(), planes[1].ravel(), planes[2].ravel(), planes[3].ravel()
    pairs, colour, _, fetchable = flat
    height, width = view_disparity.shape
    stride, runs = width + 2 * BORDER, (width + COUNT - 1) // COUNT
    plane = (height + 2 * BORDER) * stride
    near_px, trust = np.float32(tolerance), np.float32(edge_trust)
    seeing = cameras, flat, shifts, weights, trust, fetching
    whole_sharpness = np.int32(round(sharpness * ONE))
    columns_apart, column_of = distinct(shifts[:, 0])
    rows_apart, row_of = distinct(shifts[:, 1])
    columns = np.empty(PLACES * columns_apart.size, np.int32)
    rows = np.empty(PLACES * rows_apart.size, np.int32)
    high, low = np.empty(width + 2, np.float32), np.empty(width + 2, np.float32)
    disparity, marks = np.full(width + COUNT, np.nan, np.float32), np.zeros(width + COUNT, np.uint8)
    sums, seen = np.empty(4 * COUNT * runs, np.float32), np.empty(COUNT * runs, np.uint8)
    few = np.empty(4 * width, np.float32)
    edges, edge_counts = np.empty((cameras.size, width), np.int32), np.empty(cameras.size, np.int64)
    contours, touched = np.empty(width, np.int32), np.empty(width, np.int32)
    pixels, end = out.ravel(), np.empty(3 * COUNT, np.uint8)
    for y in range(first, last):
        disparity[:width] = view_disparity[y]
        _mark_contours(y, view_disparity, near_px, high, low, marks)
        sums[:] = 0
        seen[:] = 0
        edge_counts[:] = 0
        contour_count = touched_count = 0
        for x in range(0, width, COUNT):
            bits = marked(marks, x)
            contour_count = list_bits(bits, x, contours, contour_count)
            for i in range(columns_apart.size):
                place_columns(
                    disparity,
                    columns,
                    PLACES * i,
                    np.int32(x),
                    np.int32(y),
                    np.int32(width),
                    columns_apart[i],
                    np.int32(1),
                    whole_sharpness,
                )
            for i in range(rows_apart.size):
                place_rows(
                    disparity,
                    rows,
                    PLACES * i,
                    np.int32(x),
                    np.int32(y),
                    np.int32(height),
                    rows_apart[i],
                    np.int32(stride),
                    whole_sharpness,
                )
            for i in range(cameras.size):
                start = cameras[i] * plane + BORDER * stride + BORDER
                column, row = PLACES * column_of[i], PLACES * row_of[i]
                if shifts[i, 1] == 0:
                    found = add_run_beside(
                        pairs, colour, fetchable, disparity, columns, rows, sums, seen,
                        start, stride, x, column, row, weights[i], near_px,
                    )  # fmt: skip
                elif shifts[i, 0] == 0:
                    found = add_run_above(
                        pairs, colour, fetchable, disparity, columns, rows, sums, seen,
                        start, stride, x, column, row, weights[i], near_px,
                    )  # fmt: skip
                else:
                    found = add_run(
                        pairs, colour, fetchable, disparity, columns, rows, sums, seen,
                        start, stride, x, column, row, weights[i], near_px,
                    )  # fmt: skip
                edge_counts[i] = list_bits(found, x, edges[i], edge_counts[i])
                bits |= found
            touched_count = list_bits(bits, x, touched, touched_count)
        for x in touched[:touched_count]:
            at = x // COUNT * 4 * COUNT + x % COUNT
            for value in range(4):
                few[4 * x + value] = sums[at + COUNT * value]
        for i in range(cameras.size):
            _add_edges(
                flat,
                fetching,
                cameras[i],
                weights[i] * trust,
                y,
                (shifts[i, 0], shifts[i, 1]),
                view_disparity.shape,
                disparity,
                near_px,
                edges[i, : edge_counts[i]],
                few,
                seen,
            )
        _add_surfaces(y, contours[:contour_count], seen, view_disparity, seeing, near_px, few)
        for x in touched[:touched_count]:
            at = x // COUNT * 4 * COUNT + x % COUNT
            for value in range(4):
                sums[at + COUNT * value] = few[4 * x + value]
        seen_by[y] = seen[:width]
        for x in range(0, width - COUNT + 1, COUNT):
            store_run(sums, 4 * x, pixels, 3 * (y * width + x))
        rest = width % COUNT
        if rest:
            store_run(sums, 4 * (width - rest), end, 0)
            pixels[3 * ((y + 1) * width - rest) : 3 * (y + 1) * width] = end[: 3 * rest]

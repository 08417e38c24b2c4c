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

from mvcodec.kernels.view_fetch import BORDER, CONTOUR, corner_of, phase_of, place_of
from mvcodec.kernels.view_marks import list_marked
from mvcodec.kernels.view_vectors import add_edge, add_fetched, store_colour

FloatMap = NDArray[np.float32]
ByteMap = NDArray[np.uint8]


# Inlined: a call would pass each array in eight parts, and count its references, for a few numbers of work.


@njit(cache=True, nogil=True, inline="always")
def _see(x, y, d, shape, cameras, planes, shifts, weights, tolerance, edge_trust, fetching, sums):  # type: ignore[no-untyped-def]
    """Sum up what the cameras see of the view's point (x, y) at disparity d."""
    luma, colour, depths, fetchable = planes
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
                    luma,
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
                add_fetched(luma, colour, fetching, sums, none, place, below, phase, weight)


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
def _find_contours(y, view_disparity, tolerance, high, low, marks, chosen):  # type: ignore[no-untyped-def]
    """Lists the pixels of a row whose 3 x 3 window holds more than one surface; their number."""
    height, width = view_disparity.shape
    above, here = view_disparity[max(y - 1, 0)], view_disparity[y]
    below = view_disparity[min(y + 1, height - 1)]
    for x in range(width):
        high[x + 1] = max(max(above[x], here[x]), below[x])
        low[x + 1] = min(min(above[x], here[x]), below[x])
    for ends in (high, low):
        ends[0], ends[-1] = ends[1], ends[-2]
    for x in range(width):
        nearest = max(max(high[x], high[x + 1]), high[x + 2])
        farthest = min(min(low[x], low[x + 1]), low[x + 2])
        marks[x] = nearest - farthest > tolerance
    return list_marked(marks, chosen)


@njit(cache=True, nogil=True)
def _locate(y, disparity, shift, shape, places, phases):  # type: ignore[no-untyped-def]
    """Where a camera sees one row of the view: the pixels up left of there, -1 outside, and the phases."""
    height, width = shape
    stride = np.int32(width + 2 * BORDER)
    shift_x, shift_y = shift
    for x in range(width):  # vectorised
        at_x, at_y, inside = place_of(x, y, disparity[x], shift_x, shift_y, width, height)
        left, top = np.int32(at_x), np.int32(at_y)
        phases[x] = phase_of(at_x - np.float32(left), at_y - np.float32(top))
        place = (top + np.int32(BORDER)) * stride + left + np.int32(BORDER)
        places[x] = place if inside else np.int32(-1)


@njit(cache=True, nogil=True)
def _add_clear(  # type: ignore[no-untyped-def]
    planes, fetching, first, stride, weight, disparity, tolerance, places, phases, sums, seen, edges
):
    """Add what a camera sees of a row off its contours; lists the pixels at these, and gives their number."""
    luma, colour, fetchable = planes
    count = 0
    for x in range(disparity.size):
        if places[x] < 0:
            continue
        place = first + np.uintp(places[x])
        here = fetchable[place]
        if abs(here - disparity[x]) <= tolerance:
            at = np.uintp(4) * np.uintp(x)
            add_fetched(luma, colour, fetching, sums, at, place, stride, np.uintp(phases[x]), weight)
            seen[x] += 1
        elif here == CONTOUR:
            edges[count] = x
            count += 1
    return count


@njit(cache=True, nogil=True)
def _add_edges(  # type: ignore[no-untyped-def]
    planes, fetching, first, weight, y, shift, disparity, tolerance, chosen, places, phases, sums, seen
):
    """Add what a camera sees at the chosen pixels of row y, at its contours."""
    luma, colour, own = planes
    height, width = own.shape
    flat, stride = own.ravel(), np.uintp(width + 2 * BORDER)
    for x in chosen:
        d = disparity[x]
        at_x, at_y, _ = place_of(x, y, d, shift[0], shift[1], width, height)
        corner, steps = corner_of(at_x, at_y, width, height)
        place, at, phase = first + np.uintp(places[x]), np.uintp(4) * np.uintp(x), np.uintp(phases[x])
        seen[x] += add_edge(
            luma, colour, flat, fetching, sums, at, place, stride, corner, steps, phase, d, tolerance, weight
        )


@njit(cache=True, nogil=True)
def blend(
    cameras: NDArray[np.int64],
    planes: tuple[NDArray[np.int16], NDArray[np.int16], NDArray[np.float32], NDArray[np.float32]],
    shifts: NDArray[np.float32],
    weights: NDArray[np.float32],
    view_disparity: FloatMap,
    tolerance: float,
    edge_trust: float,
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
        planes: of every real camera: luma int16 (R, H + 4, W + 4) and colour differences
            (R, H + 4, W + 4, 2); disparity float32 (R, H, W), px, and where it can be fetched
            (R, H + 4, W + 4); see `view_planes`.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: float32 (N,), above 0.
        view_disparity: float32 (H, W), known everywhere.
        tolerance: px within which disparities are one surface.
        fetching: weights of the cubic fetch of luma, see `view_vectors.fetch_weights`.
        out: uint8 (H, W, 3) RGB, C-contiguous, rows first..last-1 overwritten; black where no camera
            sees the pixel.
        seen_by: uint8 (H, W), overwritten with the number of cameras; 0 where none sees the pixel.
    """
    luma, colour, fetchable = planes[0].ravel(), planes[1].ravel(), planes[3].ravel()
    disparities = planes[2]
    shape = view_disparity.shape
    height, width = shape
    stride = width + 2 * BORDER
    plane = (height + 2 * BORDER) * stride
    near_px, trust = np.float32(tolerance), np.float32(edge_trust)
    seeing = cameras, (luma, colour, disparities.ravel(), fetchable), shifts, weights, trust, fetching
    high, low = np.empty(width + 2, np.float32), np.empty(width + 2, np.float32)
    places, phases = np.empty(width, np.int32), np.empty(width, np.int32)
    chosen = np.empty(width, np.int32)
    sums, marks = np.empty((width, 4), np.float32), np.empty(width, np.uint8)
    flat, pixels = sums.ravel(), out.ravel()
    for y in range(first, last):
        disparity, seen = view_disparity[y], seen_by[y]
        sums[:] = 0
        seen[:] = 0
        for i in range(cameras.size):
            start, shift = np.uintp(cameras[i] * plane), (shifts[i, 0], shifts[i, 1])
            _locate(y, disparity, shift, shape, places, phases)
            count = _add_clear(
                (luma, colour, fetchable),
                fetching,
                start,
                np.uintp(stride),
                weights[i],
                disparity,
                near_px,
                places,
                phases,
                flat,
                seen,
                chosen,
            )
            _add_edges(
                (luma, colour, disparities[cameras[i]]),
                fetching,
                start,
                weights[i] * trust,
                y,
                shift,
                disparity,
                near_px,
                chosen[:count],
                places,
                phases,
                flat,
                seen,
            )
        count = _find_contours(y, view_disparity, near_px, high, low, marks, chosen)
        _add_surfaces(y, chosen[:count], seen, view_disparity, seeing, near_px, flat)
        for x in range(width):
            store_colour(flat, np.uintp(4) * np.uintp(x), pixels, np.uintp(3) * np.uintp(y * width + x))

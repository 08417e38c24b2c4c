"""Colour at a virtual view: fetched from the real cameras that see the pixel, and blended.

Pictures are fetched as luma (cubic) and two colour differences (linear): colour is smooth where it
comes out of a 4:2:0 stream, and half the arithmetic of three cubic fetches is saved. Both are linear,
so that luma of the result is that of a cubic fetch of RGB.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_fetch import BORDER, CONTOUR, cubic, cubic_weights, linear, linear_edge, place_of

FloatMap = NDArray[np.float32]
ByteMap = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def _see(x, y, d, cameras, planes, shifts, weights, tolerance, edge_trust, sharpness):  # type: ignore[no-untyped-def]
    """What the cameras see of the view's point (x, y) at disparity d: sums of weight, Y, R - Y, B - Y."""
    luma, colour, disparities, fetchable = planes
    _, height, width = disparities.shape
    stride = width + 2 * BORDER
    total = grey = red = blue = np.float32(0)
    for i in range(cameras.size):
        at_x, at_y, inside = place_of(x, y, d, shifts[i, 0], shifts[i, 1], width, height)
        if not inside:
            continue
        left, top = int(at_x), int(at_y)
        part_x, part_y = at_x - np.float32(left), at_y - np.float32(top)
        place = (cameras[i] * (height + 2 * BORDER) + top + BORDER) * stride + left + BORDER
        here = fetchable[np.uintp(place)]
        part = weights[i]
        if here == CONTOUR:
            share, y_here, red_here, blue_here = linear_edge(
                luma, colour, disparities[cameras[i]], place, left, top, part_x, part_y, d, tolerance
            )
            if share == 0:
                continue
            part = share * weights[i] * edge_trust
        elif abs(here - d) > tolerance:
            continue
        else:
            y_here = cubic(
                luma,
                np.uintp(place - stride - 1),
                np.uintp(stride),
                cubic_weights(part_x, sharpness),
                cubic_weights(part_y, sharpness),
            )
            red_here, blue_here = linear(colour, np.uintp(place), np.uintp(stride), part_x, part_y)
        total += part
        grey += part * y_here
        red += part * red_here
        blue += part * blue_here
    return total, grey, red, blue


@njit(cache=True, nogil=True)
def _blend_contour(  # type: ignore[no-untyped-def]
    x,
    y,
    own,
    view_disparity,
    cameras,
    planes,
    shifts,
    weights,
    tolerance,
    edge_trust,
    sharpness,
    surface,
    part,
):
    """(Y, R - Y, B - Y) of one pixel from every surface of its 3 x 3 window.

    `own` is what `_see` gives for the pixel's own surface; `surface` and `part` are room for nine.
    """
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
                part[k] += np.float32(1) / np.float32(1 + (u - x) * (u - x) + (v - y) * (v - y))
    total = grey = red = blue = np.float32(0)
    for k in range(count):
        weight, y_here, red_here, blue_here = own
        if k > 0:
            weight, y_here, red_here, blue_here = _see(
                x, y, surface[k], cameras, planes, shifts, weights, tolerance, edge_trust, sharpness
            )
        if weight > 0:
            scale = part[k] / weight
            total += part[k]
            grey += scale * y_here
            red += scale * red_here
            blue += scale * blue_here
    return grey / total, red / total, blue / total


@njit(cache=True, nogil=True)
def _locate(y, disparity, shift, shape, places, parts):  # type: ignore[no-untyped-def]
    """Where a camera sees one row of the view: the pixels up left of there, -1 outside, and the fractions."""
    height, width = shape
    stride = np.int32(width + 2 * BORDER)
    shift_x, shift_y = shift
    for x in range(width):
        at_x, at_y, inside = place_of(x, y, disparity[x], shift_x, shift_y, width, height)
        left, top = np.int32(at_x), np.int32(at_y)
        parts[0, x], parts[1, x] = at_x - np.float32(left), at_y - np.float32(top)
        place = (top + np.int32(BORDER)) * stride + left + np.int32(BORDER)
        places[x] = place if inside else np.int32(-1)


@njit(cache=True, nogil=True)
def _choose(disparity, fetchable, first, tolerance, places, clear, edges):  # type: ignore[no-untyped-def]
    """Lists the pixels of a row whose surface the camera sees, and those at its contours; their numbers."""
    seen = contours = 0
    for x in range(disparity.size):  # without a branch: which way it would go is hard to foresee
        inside = places[x] >= 0
        here = fetchable[first + np.uintp(max(places[x], 0))]
        clear[seen] = x
        seen += inside & (abs(here - disparity[x]) <= tolerance)
        edges[contours] = x
        contours += inside & (here == CONTOUR)
    return seen, contours


@njit(cache=True, nogil=True)
def _weigh(parts, sharpness, keys):  # type: ignore[no-untyped-def]
    """The four weights of a cubic fetch across and the four down, for each pixel of a row."""
    for axis in range(2):
        part = parts[axis]
        first, second, third, fourth = keys[axis, 0], keys[axis, 1], keys[axis, 2], keys[axis, 3]
        for x in range(part.size):  # two by two, since with more arrays it does not compile to vectors
            first[x], second[x], _, _ = cubic_weights(part[x], sharpness)
        for x in range(part.size):
            _, _, third[x], fourth[x] = cubic_weights(part[x], sharpness)


@njit(cache=True, nogil=True)
def _add_clear(  # type: ignore[no-untyped-def]
    luma, colour, first, stride, weight, chosen, places, parts, keys, sums, seen
):
    """Add what a camera sees at the chosen pixels of a row, by its weight."""
    total, grey, red, blue = sums
    across, down = keys[0], keys[1]
    for k in range(chosen.size):
        x = np.uintp(chosen[k])
        place = first + np.uintp(places[x])
        grey[x] += weight * cubic(
            luma,
            place - stride - np.uintp(1),
            stride,
            (across[0, x], across[1, x], across[2, x], across[3, x]),
            (down[0, x], down[1, x], down[2, x], down[3, x]),
        )
        red_here, blue_here = linear(colour, place, stride, parts[0, x], parts[1, x])
        red[x] += weight * red_here
        blue[x] += weight * blue_here
        total[x] += weight
        seen[x] += 1


@njit(cache=True, nogil=True)
def _add_edges(  # type: ignore[no-untyped-def]
    luma, colour, own, first, disparity, weight, tolerance, chosen, places, parts, sums, seen, mixed
):
    """Add what a camera sees at the chosen pixels of a row, at its contours; weight: (own, edge_trust)."""
    total, grey, red, blue = sums
    stride = own.shape[1] + 2 * BORDER
    for x in chosen:
        mixed[x] = True
        share, y_here, red_here, blue_here = linear_edge(
            luma,
            colour,
            own,
            first + places[x],
            places[x] % stride - BORDER,
            places[x] // stride - BORDER,
            parts[0, x],
            parts[1, x],
            disparity[x],
            tolerance,
        )
        if share > 0:
            part = share * weight[0] * weight[1]
            total[x] += part
            grey[x] += part * y_here
            red[x] += part * red_here
            blue[x] += part * blue_here
            seen[x] += 1


@njit(cache=True, nogil=True, inline="always")
def _store(pixel, grey, red, blue):  # type: ignore[no-untyped-def]
    green = grey - (np.float32(0.299 / 0.587) * red + np.float32(0.114 / 0.587) * blue)
    half, low, high = np.float32(0.5), np.float32(0), np.float32(255)
    pixel[0] = min(max(grey + red + half, low), high)
    pixel[1] = min(max(green + half, low), high)
    pixel[2] = min(max(grey + blue + half, low), high)


@njit(cache=True, nogil=True)
def blend(
    cameras: NDArray[np.int64],
    planes: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    shifts: NDArray[np.float32],
    weights: NDArray[np.float32],
    view_disparity: FloatMap,
    contours: ByteMap,
    tolerance: float,
    edge_trust: float,
    sharpness: float,
    out: NDArray[np.uint8],
    seen_by: ByteMap,
    first: int,
    last: int,
) -> None:
    """Colour of a view from every camera that sees each pixel, rows first..last-1.

    A camera counts where its own disparity there agrees. At a contour the surfaces of the 3 x 3 window
    are blended (weight 1 / (1 + distance^2)), which gives the soft edge that a lens gives, and pixels at
    the cameras' own contours, whose colours are mixed, count `edge_trust` as much.

    Args:
        cameras: int64 (N,), which of the R real cameras see the view.
        planes: of every real camera: luma float32 (R, H + 4, W + 4) and colour differences
            (R, H + 4, W + 4, 2), disparity (R, H, W), px, and where it can be fetched (R, H + 4, W + 4);
            see `view_planes`.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: float32 (N,), above 0.
        view_disparity: float32 (H, W), known everywhere.
        contours: uint8 (H, W), not 0 where the 3 x 3 window holds more than one surface.
        tolerance: px within which disparities are one surface.
        sharpness: Keys' parameter a of the cubic fetch of luma.
        out: uint8 (H, W, 3) RGB, rows first..last-1 overwritten; black where no camera sees the pixel.
        seen_by: uint8 (H, W), overwritten with the number of cameras; 0 where none sees the pixel.
    """
    luma, colour, fetchable = planes[0].ravel(), planes[1].ravel(), planes[3].ravel()
    disparities = planes[2]
    shape = view_disparity.shape
    height, width = shape
    stride = width + 2 * BORDER
    plane = (height + 2 * BORDER) * stride
    near_px, trust, keys_a = np.float32(tolerance), np.float32(edge_trust), np.float32(sharpness)
    surface, part = np.empty(9, np.float32), np.empty(9, np.float32)
    keys, parts = np.empty((2, 4, width), np.float32), np.empty((2, width), np.float32)
    places, clear, edges = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
    total, grey = np.empty(width, np.float32), np.empty(width, np.float32)
    red, blue = np.empty(width, np.float32), np.empty(width, np.float32)
    sums = total, grey, red, blue
    mixed = np.empty(width, np.bool_)
    for y in range(first, last):
        disparity, seen = view_disparity[y], seen_by[y]
        for values in sums:
            values[:] = 0
        seen[:] = 0
        for x in range(width):
            mixed[x] = contours[y, x] != 0
        for i in range(cameras.size):
            start = cameras[i] * plane
            _locate(y, disparity, (shifts[i, 0], shifts[i, 1]), shape, places, parts)
            some, few = _choose(disparity, fetchable, np.uintp(start), near_px, places, clear, edges)
            _weigh(parts, keys_a, keys)
            _add_clear(
                luma,
                colour,
                np.uintp(start),
                np.uintp(stride),
                weights[i],
                clear[:some],
                places,
                parts,
                keys,
                sums,
                seen,
            )
            _add_edges(
                luma,
                colour,
                disparities[cameras[i]],
                start,
                disparity,
                (weights[i], trust),
                near_px,
                edges[:few],
                places,
                parts,
                sums,
                seen,
                mixed,
            )
        for x in range(width):
            if total[x] == 0:  # with its neighbours' colour alone it would spread that into holes beside it
                out[y, x] = 0
            elif not mixed[x]:
                scale = np.float32(1) / total[x]
                _store(out[y, x], scale * grey[x], scale * red[x], scale * blue[x])
            else:
                y_here, red_here, blue_here = _blend_contour(
                    x,
                    y,
                    (total[x], grey[x], red[x], blue[x]),
                    view_disparity,
                    cameras,
                    (luma, colour, disparities, fetchable),
                    shifts,
                    weights,
                    near_px,
                    trust,
                    keys_a,
                    surface,
                    part,
                )
                _store(out[y, x], y_here, red_here, blue_here)

"""Colour at a virtual view: fetched from the real cameras that see the pixel, and blended.

Pictures are fetched as luma (cubic) and two colour differences (linear): colour is smooth where it
comes out of a 4:2:0 stream, and half the arithmetic of three cubic fetches is saved. Both are linear,
so that luma of the result is that of a cubic fetch of RGB.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

BORDER = 2
"""Pixels that `split_luma` repeats around a picture, so that a cubic fetch never leaves it."""
CONTOUR = np.float32(-1e9)
"""Stands, in a map of fetchable disparity, for a pixel whose cubic fetch would cross a depth edge."""

FloatMap = NDArray[np.float32]
ByteMap = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def split_luma(picture: NDArray[np.uint8], luma: FloatMap, colour: NDArray[np.float32]) -> None:
    """RGB to luma and colour differences, with a border of repeated edge pixels.

    Args:
        picture: uint8 (H, W, 3).
        luma: float32 (H + 2 BORDER, W + 2 BORDER), overwritten with Y = .299 R + .587 G + .114 B.
        colour: float32 (H + 2 BORDER, W + 2 BORDER, 2), overwritten with R - Y and B - Y.
    """
    height, width, _ = picture.shape
    for y in range(height + 2 * BORDER):
        v = min(max(y - BORDER, 0), height - 1)
        for x in range(width + 2 * BORDER):
            u = min(max(x - BORDER, 0), width - 1)
            red, green, blue = picture[v, u, 0], picture[v, u, 1], picture[v, u, 2]
            grey = np.float32(0.299) * red + np.float32(0.587) * green + np.float32(0.114) * blue
            luma[y, x] = grey
            colour[y, x, 0] = red - grey
            colour[y, x, 1] = blue - grey


@njit(cache=True, nogil=True, inline="always")
def _keys(t, a):  # type: ignore[no-untyped-def]
    """The four weights of cubic convolution at fraction t (Keys 1981, equation 15, parameter a)."""
    s = np.float32(1) - t
    inner = ((a + np.float32(2)) * t - (a + np.float32(3))) * t * t + np.float32(1)
    after = ((a + np.float32(2)) * s - (a + np.float32(3))) * s * s + np.float32(1)
    return a * t * s * s, inner, after, a * s * t * t


@njit(cache=True, nogil=True, inline="always")
def _cubic(luma, place, stride, across, down):  # type: ignore[no-untyped-def]
    """Luma of the 4 x 4 window whose upper left pixel is at the flat index `place`."""
    one, two, three = np.uint32(1), np.uint32(2), np.uint32(3)
    a, b, c, d = across
    grey = down[0] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    place += stride
    grey += down[1] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    place += stride
    grey += down[2] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    place += stride
    grey += down[3] * (
        a * luma[place] + b * luma[place + one] + c * luma[place + two] + d * luma[place + three]
    )
    return grey


@njit(cache=True, nogil=True, inline="always")
def _linear(colour, place, stride, part_x, part_y):  # type: ignore[no-untyped-def]
    """(R - Y, B - Y) between the four pixels whose upper left one is at the flat index `place`."""
    one_x, one_y = np.float32(1) - part_x, np.float32(1) - part_y
    a, b, c, d = one_x * one_y, part_x * one_y, one_x * part_y, part_x * part_y
    top = np.uint32(2) * place
    low = top + np.uint32(2) * stride
    one, two, three = np.uint32(1), np.uint32(2), np.uint32(3)
    red = a * colour[top] + b * colour[top + two] + c * colour[low] + d * colour[low + two]
    blue = a * colour[top + one] + b * colour[top + three] + c * colour[low + one] + d * colour[low + three]
    return red, blue


@njit(cache=True, nogil=True)
def _fetch_edge(luma, colour, disparity, x, y, d, tolerance):  # type: ignore[no-untyped-def]
    """(share, Y, R - Y, B - Y) at (x, y) from those of the four pixels around it that lie at disparity d."""
    height, width = disparity.shape
    left, top = int(x), int(y)
    part_x, part_y = x - np.float32(left), y - np.float32(top)
    share = grey = red = blue = np.float32(0)
    for j in range(2):
        for i in range(2):
            u, v = min(left + i, width - 1), min(top + j, height - 1)
            if abs(disparity[v, u] - d) <= tolerance:
                part = (part_x if i else np.float32(1) - part_x) * (part_y if j else np.float32(1) - part_y)
                share += part
                grey += part * luma[v + BORDER, u + BORDER]
                red += part * colour[v + BORDER, u + BORDER, 0]
                blue += part * colour[v + BORDER, u + BORDER, 1]
    if share > np.float32(1e-3):
        return share, grey / share, red / share, blue / share
    return np.float32(0), grey, red, blue


@njit(cache=True, nogil=True)
def _see(x, y, d, cameras, planes, shifts, weights, tolerance, edge_trust, sharpness):  # type: ignore[no-untyped-def]
    """What the cameras see of the view's point (x, y) at disparity d: (weight, Y, R - Y, B - Y, cameras)."""
    lumas, colours, disparities, fetchable = planes
    _, height, width = disparities.shape
    stride = np.uint32(width + 2 * BORDER)
    total = grey = red = blue = np.float32(0)
    seen = 0
    for i in range(cameras.size):
        camera = cameras[i]
        at_x = np.float32(x) + shifts[i, 0] * d
        at_y = np.float32(y) + shifts[i, 1] * d
        if not (-0.5 < at_x < width - 0.5 and -0.5 < at_y < height - 0.5):
            continue
        at_x = min(max(at_x, np.float32(0)), np.float32(width - 1))
        at_y = min(max(at_y, np.float32(0)), np.float32(height - 1))
        left, top = int(at_x), int(at_y)
        here = fetchable[camera, top + BORDER, left + BORDER]
        if here > CONTOUR:
            if abs(here - d) > tolerance:
                continue
            part_x, part_y = at_x - np.float32(left), at_y - np.float32(top)
            place = np.uint32((top + BORDER) * stride + left + BORDER)
            part = weights[i]
            y_here = _cubic(
                lumas[camera].ravel(),
                place - stride - np.uint32(1),
                stride,
                _keys(part_x, sharpness),
                _keys(part_y, sharpness),
            )
            red_here, blue_here = _linear(colours[camera].ravel(), place, stride, part_x, part_y)
        else:
            share, y_here, red_here, blue_here = _fetch_edge(
                lumas[camera], colours[camera], disparities[camera], at_x, at_y, d, tolerance
            )
            if share == 0:
                continue
            part = share * weights[i] * edge_trust
        total += part
        grey += part * y_here
        red += part * red_here
        blue += part * blue_here
        seen += 1
    return total, grey, red, blue, seen


@njit(cache=True, nogil=True)
def _blend_contour(  # type: ignore[no-untyped-def]
    x, y, view_disparity, cameras, planes, shifts, weights, tolerance, edge_trust, sharpness, surface, part
):
    """(known, Y, R - Y, B - Y, cameras) of one pixel, from every surface of its 3 x 3 window."""
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
    cameras_here = 0
    for k in range(count):
        weight, y_here, red_here, blue_here, seen = _see(
            x, y, surface[k], cameras, planes, shifts, weights, tolerance, edge_trust, sharpness
        )
        if k == 0:
            if weight == 0:  # with its neighbours' colour alone it would spread that into holes beside it
                return False, grey, red, blue, 0
            cameras_here = seen
        if weight > 0:
            scale = part[k] / weight
            total += part[k]
            grey += scale * y_here
            red += scale * red_here
            blue += scale * blue_here
    return True, grey / total, red / total, blue / total, cameras_here


@njit(cache=True, nogil=True)
def _add_luma(  # type: ignore[no-untyped-def]
    y, disparity, camera, shape, shift, weight, tolerance, sharpness, places, parts, keys, slow, taken, grey
):
    """Add a camera's weighted luma to one row; `taken` says where it saw the view's surface."""
    luma, fetchable = camera
    height, width = shape
    stride = width + 2 * BORDER
    shift_x, shift_y = shift
    across, down = keys[:4], keys[4:]
    for x in range(width):
        at_x = np.float32(x) + shift_x * disparity[x]
        at_y = np.float32(y) + shift_y * disparity[x]
        inside = (
            (at_x > np.float32(-0.5))
            & (at_y > np.float32(-0.5))
            & (at_x < np.float32(width - 0.5))
            & (at_y < np.float32(height - 0.5))
        )
        at_x = min(max(at_x, np.float32(0)), np.float32(width - 1))
        at_y = min(max(at_y, np.float32(0)), np.float32(height - 1))
        left, top = np.int32(at_x), np.int32(at_y)
        parts[0, x], parts[1, x] = at_x - np.float32(left), at_y - np.float32(top)
        across[0, x], across[1, x], across[2, x], across[3, x] = _keys(parts[0, x], sharpness)
        down[0, x], down[1, x], down[2, x], down[3, x] = _keys(parts[1, x], sharpness)
        place = (top + np.int32(BORDER)) * np.int32(stride) + left + np.int32(BORDER)
        places[x] = place if inside else -1
    lines = np.uint32(stride)
    one = np.uint32(1)
    for x in range(width):
        taken[x] = 0
        if slow[x] or places[x] < 0:
            continue
        here = fetchable[np.uint32(places[x])]
        if abs(here - disparity[x]) > tolerance:
            slow[x] = here == CONTOUR
            continue
        taken[x] = weight
        grey[x] += weight * _cubic(
            luma,
            np.uint32(places[x]) - lines - one,
            lines,
            (across[0, x], across[1, x], across[2, x], across[3, x]),
            (down[0, x], down[1, x], down[2, x], down[3, x]),
        )


@njit(cache=True, nogil=True)
def _add_colour(colour, width, places, parts, slow, taken, red, blue):  # type: ignore[no-untyped-def]
    """Add a camera's weighted colour differences to one row."""
    stride = np.uint32(width + 2 * BORDER)
    for x in range(width):
        if slow[x] or taken[x] == 0:
            continue
        red_here, blue_here = _linear(colour, np.uint32(places[x]), stride, parts[0, x], parts[1, x])
        red[x] += taken[x] * red_here
        blue[x] += taken[x] * blue_here


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
            (R, H + 4, W + 4, 2), see `split_luma`; disparity (R, H, W), px; and the same with a border
            (R, H + 4, W + 4), CONTOUR where the 4 x 4 window of a fetch crosses a depth edge.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: float32 (N,), above 0.
        view_disparity: float32 (H, W), known everywhere.
        contours: uint8 (H, W), not 0 where the 3 x 3 window holds more than one surface.
        tolerance: px within which disparities are one surface.
        sharpness: Keys' parameter a of the cubic fetch of luma.
        out: uint8 (H, W, 3) RGB, rows first..last-1 overwritten; black where no camera sees the pixel.
        seen_by: uint8 (H, W), overwritten with the number of cameras; 0 where none sees the pixel.
    """
    lumas, colours, _, fetchable = planes
    shape = view_disparity.shape
    width = shape[1]
    near_px, trust, keys_a = np.float32(tolerance), np.float32(edge_trust), np.float32(sharpness)
    surface, part = np.empty(9, np.float32), np.empty(9, np.float32)
    keys, parts = np.empty((8, width), np.float32), np.empty((2, width), np.float32)
    places = np.empty(width, np.int32)
    taken, total = np.empty(width, np.float32), np.empty(width, np.float32)
    grey, red, blue = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    slow = np.empty(width, np.bool_)
    for y in range(first, last):
        disparity, seen = view_disparity[y], seen_by[y]
        grey[:] = 0
        red[:] = 0
        blue[:] = 0
        total[:] = 0
        seen[:] = 0
        for x in range(width):
            slow[x] = contours[y, x] != 0
        for i in range(cameras.size):
            camera = cameras[i]
            shift = (shifts[i, 0], shifts[i, 1])
            _add_luma(
                y,
                disparity,
                (lumas[camera].ravel(), fetchable[camera].ravel()),
                shape,
                shift,
                weights[i],
                near_px,
                keys_a,
                places,
                parts,
                keys,
                slow,
                taken,
                grey,
            )
            _add_colour(colours[camera].ravel(), width, places, parts, slow, taken, red, blue)
            for x in range(width):
                total[x] += taken[x]
                seen[x] += taken[x] > 0
        for x in range(width):
            if total[x] > 0 and not slow[x]:
                scale = np.float32(1) / total[x]
                _store(out[y, x], scale * grey[x], scale * red[x], scale * blue[x])
                continue
            known, y_here, red_here, blue_here, seen[x] = _blend_contour(
                x,
                y,
                view_disparity,
                cameras,
                planes,
                shifts,
                weights,
                near_px,
                trust,
                keys_a,
                surface,
                part,
            )
            if known:
                _store(out[y, x], y_here, red_here, blue_here)
            else:
                out[y, x] = 0

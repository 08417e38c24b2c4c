"""Colour at a virtual view at the least cost, for pictures that move: linear fetch, in whole numbers.

A pixel is one 64-bit number of four lanes of 16 bits: red, green, blue, and 1 in the uppermost. So one
multiplication weighs all of them, and the last lane comes out as the sum of the weights.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lane_vectors import add_lanes, store_lanes
from mvcodec.kernels.view_fetch import place_of

FloatMap = NDArray[np.float32]

BITS = 4
STEPS = 1 << BITS
"""Places between two pixels that a fetch tells apart. The products of both axes fill a lane's upper byte."""
WEIGHTS = 256
"""The weights of a view's cameras may sum up to this, so that no lane overflows."""


@njit(cache=True, nogil=True)
def pack(picture: NDArray[np.uint8], out: NDArray[np.uint64]) -> None:
    """RGB to lanes.

    Args:
        picture: uint8 (H, W, 3).
        out: uint64 (H + 1, W + 1), overwritten; its last row and column repeat the picture's.
    """
    height, width, _ = picture.shape
    for y in range(height):
        for x in range(width):
            red, green = np.uint64(picture[y, x, 0]), np.uint64(picture[y, x, 1])
            blue, one = np.uint64(picture[y, x, 2]), np.uint64(1)
            out[y, x] = red | (green << np.uint64(16)) | (blue << np.uint64(32)) | (one << np.uint64(48))
        out[y, width] = out[y, width - 1]
    out[height] = out[height - 1]


def _shares() -> NDArray[np.uint16]:
    """uint16 (STEPS^2, 16): what the four pixels around a place count, see `lane_vectors.add_lanes`."""
    down, right = np.mgrid[:STEPS, :STEPS][:, :, :, None]
    ones = np.ones(4, np.int64)
    above = [(STEPS - down) * (STEPS - right) * ones, (STEPS - down) * right * ones]
    below = [down * (STEPS - right) * ones, down * right * ones]
    return np.concatenate(above + below, axis=2).reshape(STEPS * STEPS, 16).astype(np.uint16)


SHARES = _shares()


@njit(cache=True, nogil=True)
def _locate(y, disparity, shift, shape, places, nearest, phases):  # type: ignore[no-untyped-def]
    """Where a camera sees one row of the view: flat index up left of there in its packed picture, -1 outside,
    flat index of the nearest pixel in its map, and which of SHARES count."""
    height, width = shape
    shift_x, shift_y = shift
    bits, last = np.int32(BITS), np.int32(STEPS - 1)
    half, one = np.int32(STEPS // 2), np.float32(STEPS)
    for x in range(width):
        at_x, at_y, inside = place_of(x, y, disparity[x], shift_x, shift_y, width, height)
        fine_x = np.int32(at_x * one + np.float32(0.5))
        fine_y = np.int32(at_y * one + np.float32(0.5))
        phases[x] = ((fine_y & last) << bits) + (fine_x & last)
        nearest[x] = ((fine_y + half) >> bits) * np.int32(width) + ((fine_x + half) >> bits)
        place = (fine_y >> bits) * np.int32(width + 1) + (fine_x >> bits)
        places[x] = place if inside else np.int32(-1)


@njit(cache=True, nogil=True)
def _add(packed, own, weight, disparity, tolerance, stride, located, lanes, seen):  # type: ignore[no-untyped-def]
    """Add what a camera sees of one row of the view, by its weight."""
    places, nearest, phases = located
    shares, below = SHARES.ravel(), np.uintp(stride)
    for x in range(disparity.size):
        if places[x] >= 0 and abs(own[np.uintp(nearest[x])] - disparity[x]) <= tolerance:
            place, phase = np.uintp(places[x]), np.uintp(phases[x])
            add_lanes(packed, shares, lanes, np.uintp(x), place, below, phase, weight)
            seen[x] += 1


@njit(cache=True, nogil=True)
def blend(
    cameras: NDArray[np.int64],
    packed: NDArray[np.uint64],
    maps: NDArray[np.float32],
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
        packed: uint64 (R, H + 1, W + 1), see `pack`.
        maps: float32 (R, H, W), px, of every real camera.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: uint64 (N,), above 0, in all at most WEIGHTS.
        view_disparity: float32 (H, W), known everywhere.
        tolerance: px within which disparities are one surface.
        out: uint8 (H, W, 3) RGB, C-contiguous, rows first..last-1 overwritten; black where no camera
            sees the pixel.
        seen_by: uint8 (H, W), overwritten with the number of cameras; 0 where none sees the pixel.
    """
    height, width = view_disparity.shape
    pixels, own = packed.ravel(), maps.ravel()
    plane, plane_map = (height + 1) * (width + 1), height * width
    near, flat = np.float32(tolerance), out.ravel()
    places, nearest = np.empty(width, np.int32), np.empty(width, np.int32)
    phases, lanes = np.empty(width, np.int32), np.empty(width, np.uint64)
    for y in range(first, last):
        disparity, seen = view_disparity[y], seen_by[y]
        lanes[:] = 0
        seen[:] = 0
        for i in range(cameras.size):
            camera = cameras[i]
            shift = shifts[i, 0], shifts[i, 1]
            _locate(y, disparity, shift, (height, width), places, nearest, phases)
            _add(
                pixels[camera * plane : (camera + 1) * plane],
                own[camera * plane_map : (camera + 1) * plane_map],
                weights[i],
                disparity,
                near,
                width + 1,
                (places, nearest, phases),
                lanes,
                seen,
            )
        for x in range(width):
            store_lanes(lanes[x], flat, np.uintp(3) * np.uintp(y * width + x))

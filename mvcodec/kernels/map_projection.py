"""Disparity maps as another camera sees them: forward mapping, the near ones in front."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]


@njit(cache=True, nogil=True)
def project(values: FloatMap, right: float, down: float, out: FloatMap) -> None:
    """Move each pixel (x, y) of disparity d to (x - right * d, y - down * d); the nearest stays.

    Both whole places beside a fractional one take it, so that slanted surfaces get no cracks.

    Args:
        values: float32 (H, W), px.
        out: float32 (H + 2, W + 2), C-contiguous, overwritten: the other camera's map with a border of
            one pixel, in which whatever leaves the picture lands; -inf where nothing comes.
    """
    height, width = values.shape
    stride = np.int32(width + 2)
    flat = out.ravel()
    flat[:] = -np.inf
    places = np.empty(width, np.int32)
    beside, below = np.empty(width, np.int32), np.empty(width, np.int32)
    chosen = np.empty(width, np.int32)
    for y in range(height):
        row = values[y]
        for x in range(width):  # vectorised: no branch
            d = np.float64(row[x])
            to_x = min(max(np.float64(x) - right * d, -1.0), np.float64(width)) + 1.0
            to_y = min(max(np.float64(y) - down * d, -1.0), np.float64(height)) + 1.0
            u, v = np.int32(to_x), np.int32(to_y)
            places[x] = v * stride + u
            beside[x] = to_x > u
            below[x] = to_y > v
        count = 0
        for x in range(width):
            d, place = row[x], np.uint32(places[x])
            flat[place] = max(flat[place], d)
            chosen[count] = x
            count += (beside[x] | below[x]) != 0
        for x in chosen[:count]:  # again where one of them is 0, which costs less than to ask
            d, down_by = row[x], np.int32(below[x] * stride)
            for step in (beside[x], down_by, np.int32(beside[x] + down_by)):
                place = np.uint32(places[x] + step)
                flat[place] = max(flat[place], d)


@njit(cache=True, nogil=True)
def merge(seen: NDArray[np.float32], agreement: float, values: FloatMap, known: Mask) -> None:
    """The nearest of several maps at each pixel, averaged with those that agree with it.

    Args:
        seen: float32 (K, H + 2, W + 2), px, see `project`.
        agreement: px; what is farther than the nearest by less agrees.
        values: float32 (H, W) out; -inf where nothing is known.
        known: bool (H, W) out.
    """
    count, height, width = len(seen), *values.shape
    nearest, total = np.empty(width, np.float32), np.empty(width, np.float32)
    agreeing = np.empty(width, np.float32)
    within = np.float32(agreement)
    for y in range(height):
        nearest[:] = seen[0, y + 1, 1:-1]
        for k in range(1, count):
            row = seen[k, y + 1, 1:-1]
            for x in range(width):
                nearest[x] = max(nearest[x], row[x])
        total[:] = 0
        agreeing[:] = 0
        for k in range(count):
            row = seen[k, y + 1, 1:-1]
            for x in range(width):
                agrees = row[x] > nearest[x] - within
                total[x] += row[x] if agrees else np.float32(0)
                agreeing[x] += np.float32(1) if agrees else np.float32(0)
        for x in range(width):
            known[y, x] = agreeing[x] > 0
            values[y, x] = total[x] / agreeing[x] if agreeing[x] > 0 else nearest[x]

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
        out: float32 (H, W), raised where something nearer comes; -inf where nothing has come yet.
    """
    height, width = values.shape
    for y in range(height):
        for x in range(width):
            d = values[y, x]
            to_x, to_y = x - right * d, y - down * d
            # The places before and behind. (A call of floor takes as long as all the rest.)
            u, v = int(to_x), int(to_y)
            u -= to_x < u
            v -= to_y < v
            u_end, v_end = u + (to_x > u), v + (to_y > v)
            if u >= 0 and v >= 0 and u_end < width and v_end < height:
                out[v, u] = max(out[v, u], d)
                if u_end > u:
                    out[v, u_end] = max(out[v, u_end], d)
                if v_end > v:
                    out[v_end, u] = max(out[v_end, u], d)
                    if u_end > u:
                        out[v_end, u_end] = max(out[v_end, u_end], d)
            else:
                for row in range(max(v, 0), min(v_end + 1, height)):
                    for col in range(max(u, 0), min(u_end + 1, width)):
                        out[row, col] = max(out[row, col], d)


@njit(cache=True, nogil=True)
def merge(seen: NDArray[np.float32], agreement: float, values: FloatMap, known: Mask) -> None:
    """The nearest of several maps at each pixel, averaged with those that agree with it.

    Args:
        seen: float32 (K, H, W), px; -inf where nothing is seen.
        agreement: px; what is farther than the nearest by less agrees.
        values: float32 (H, W) out; -inf where nothing is known.
        known: bool (H, W) out.
    """
    count, height, width = seen.shape
    for y in range(height):
        for x in range(width):
            nearest = seen[0, y, x]
            for k in range(1, count):
                nearest = max(nearest, seen[k, y, x])
            total, agreeing = np.float32(0), 0
            for k in range(count):
                if seen[k, y, x] > nearest - agreement:
                    total += seen[k, y, x]
                    agreeing += 1
            known[y, x] = agreeing > 0
            values[y, x] = total / agreeing if agreeing > 0 else nearest

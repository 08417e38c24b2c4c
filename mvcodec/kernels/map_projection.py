"""Disparity maps as another camera sees them: forward mapping, the near ones in front."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]


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
            for v in range(int(np.floor(to_y)), int(np.ceil(to_y)) + 1):
                for u in range(int(np.floor(to_x)), int(np.ceil(to_x)) + 1):
                    if 0 <= v < height and 0 <= u < width and d > out[v, u]:
                        out[v, u] = d

"""Row-wise passes over disparity maps: consistency of two maps, filling, fusion of several."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]


@njit(cache=True, nogil=True)
def consistent(
    values: FloatMap, known: Mask, other: FloatMap, other_known: Mask, sign: int, tolerance: float
) -> Mask:
    """Where a map and that of its partner agree; see `mvcodec.stereo.consistency.left_right_check`."""
    height, width = values.shape
    kept = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            if not known[y, x]:
                continue
            target = int(np.floor(x - sign * values[y, x] + 0.5))
            if 0 <= target < width and other_known[y, target]:
                kept[y, x] = abs(values[y, x] - other[y, target]) <= tolerance
    return kept


@njit(cache=True, nogil=True)
def fill_rows(values: FloatMap, valid: Mask, fallback: float) -> FloatMap:
    """Fill from the farther neighbour on the row; see `mvcodec.stereo.consistency.fill_from_farther`."""
    height, width = values.shape
    filled = values.copy()
    for y in range(height):
        x = 0
        while x < width:
            if valid[y, x]:
                x += 1
                continue
            end = x
            while end < width and not valid[y, end]:
                end += 1
            farther = np.inf
            if x > 0:
                farther = values[y, x - 1]
            if end < width:
                farther = min(farther, values[y, end])
            filled[y, x:end] = fallback if np.isinf(farther) else farther
            x = end
    return filled


@njit(cache=True, nogil=True)
def fuse_maps(
    values: NDArray[np.float32], valid: NDArray[np.bool_], weights: NDArray[np.float32], tolerance: float
) -> tuple[FloatMap, Mask]:
    """Fuse (K, H, W) maps of one camera; see `mvcodec.stereo.fusion.fuse`."""
    count, height, width = values.shape
    fused = np.empty((height, width), np.float32)
    known = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            best_weight, best_mean, farthest = 0.0, np.inf, np.inf
            for i in range(count):
                farthest = min(farthest, values[i, y, x])
                if not valid[i, y, x]:
                    continue
                weight, total = 0.0, 0.0
                for j in range(count):
                    if valid[j, y, x] and abs(values[j, y, x] - values[i, y, x]) <= tolerance:
                        weight += weights[j, y, x]
                        total += weights[j, y, x] * values[j, y, x]
                mean = total / weight
                if weight > best_weight or (weight == best_weight and mean < best_mean):
                    best_weight, best_mean = weight, mean
            known[y, x] = best_weight > 0
            fused[y, x] = best_mean if best_weight > 0 else farthest
    return fused, known

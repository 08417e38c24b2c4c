"""Disparity maps of several cameras that were moved to one place, as one map."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_depth import MARGIN, UNKNOWN

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]


@njit(cache=True, nogil=True)
def merge(seen: NDArray[np.float32], agreement: float, values: FloatMap, known: Mask) -> None:
    """The nearest of several maps at each pixel, averaged with those that agree with it.

    Args:
        seen: float32 (K, H + 2, W + 2 MARGIN), px, see `view_depth.splat`.
        agreement: px; what is farther than the nearest by less agrees.
        values: float32 (H, W) out; UNKNOWN where nothing is known.
        known: bool (H, W) out.
    """
    count, height, width = len(seen), *values.shape
    nearest, total = np.empty(width, np.float32), np.empty(width, np.float32)
    agreeing = np.empty(width, np.float32)
    within = np.float32(agreement)
    for y in range(height):
        nearest[:] = seen[0, y + 1, MARGIN:-MARGIN]
        for k in range(1, count):
            row = seen[k, y + 1, MARGIN:-MARGIN]
            for x in range(width):
                nearest[x] = max(nearest[x], row[x])
        total[:] = 0
        agreeing[:] = 0
        for k in range(count):
            row = seen[k, y + 1, MARGIN:-MARGIN]
            for x in range(width):
                agrees = (row[x] > nearest[x] - within) & (row[x] > UNKNOWN)
                total[x] += row[x] if agrees else np.float32(0)
                agreeing[x] += np.float32(1) if agrees else np.float32(0)
        for x in range(width):
            known[y, x] = agreeing[x] > 0
            values[y, x] = total[x] / agreeing[x] if agreeing[x] > 0 else nearest[x]


@njit(cache=True, nogil=True)
def to_steps(values: FloatMap, low: float, step: float, steps: NDArray[np.uint16]) -> None:
    """Disparity as whole steps (px) from `low` on, float32 (H, W) to uint16 (H, W), kept within 0..65535."""
    from_px, per_px = np.float32(low), np.float32(1 / step)
    for y in range(values.shape[0]):
        row, out = values[y], steps[y]
        for x in range(row.size):  # vectorised
            scaled = (row[x] - from_px) * per_px + np.float32(0.5)
            out[x] = np.uint16(np.int32(min(max(scaled, np.float32(0)), np.float32(65535))))


@njit(cache=True, nogil=True)
def from_steps(steps: NDArray[np.uint16], low: float, step: float, values: FloatMap) -> None:
    """The inverse of `to_steps`."""
    from_px, by_px = np.float32(low), np.float32(step)
    for y in range(values.shape[0]):
        row, out = steps[y], values[y]
        for x in range(row.size):
            out[x] = np.float32(row[x]) * by_px + from_px

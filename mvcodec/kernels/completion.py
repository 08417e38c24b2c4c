"""Which matches other cameras' maps confirm, and what the others are completed from."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.semiglobal import MAX_COST

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]
CostVolume = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def confirmed(
    disparity: FloatMap, others: NDArray[np.float32], steps: NDArray[np.float32], tolerance: float
) -> Mask:
    """Where at least one other map agrees and no more see through the point than agree.

    Args:
        disparity: float32 (H, W), px.
        others: float32 (P, H, W), maps of other cameras.
        steps: float32 (P, 2), as in `semiglobal.joint_costs`.
        tolerance: px.
    """
    height, width = disparity.shape
    kept = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            d = disparity[y, x]
            agree = through = 0
            for p in range(len(steps)):
                u = int(np.rint(x - steps[p, 0] * d))
                v = int(np.rint(y - steps[p, 1] * d))
                if 0 <= u < width and 0 <= v < height:
                    nearer = others[p, v, u] - d
                    if abs(nearer) <= tolerance:
                        agree += 1
                    elif nearer < 0:
                        through += 1
            kept[y, x] = agree > 0 and agree >= through
    return kept


@njit(cache=True, nogil=True)
def completion_costs(
    disparity: FloatMap,
    valid: Mask,
    others: NDArray[np.float32],
    others_valid: Mask,
    steps: NDArray[np.float32],
    low: int,
    slope: float,
    limit: float,
    through_cost: float,
    volume: CostVolume,
) -> None:
    """Costs that complete a map from its valid pixels.

    A valid pixel holds to its disparity (`slope` per px, at most `limit`). Any other has no evidence of
    its own but this: a place that another camera sees through is wrong (`through_cost` for each).

    Args:
        disparity, valid: (H, W), float32 px and bool.
        others, others_valid: (P, H, W), of the other cameras.
        steps: float32 (P, 2), as in `semiglobal.joint_costs`.
        low: disparity of level 0, px.
        volume: uint8 (H, W, levels), written.
    """
    height, width, levels = volume.shape
    per_px, most, through = np.float32(slope), np.float32(limit), np.float32(through_cost)
    for y in range(height):
        for x in range(width):
            here = volume[y, x]
            if valid[y, x]:
                offset = np.float32(low) - disparity[y, x]
                for level in range(levels):
                    here[level] = np.uint8(min(abs(np.float32(level) + offset) * per_px, most))
                continue
            for level in range(levels):
                cost = np.float32(0)
                for p in range(len(steps)):
                    u = int(np.rint(x - steps[p, 0] * (low + level)))
                    v = int(np.rint(y - steps[p, 1] * (low + level)))
                    inside = 0 <= u < width and 0 <= v < height
                    if inside and others_valid[p, v, u] and others[p, v, u] < low + level - 1.5:
                        cost += through
                here[level] = np.uint8(min(cost, np.float32(MAX_COST)))

"""Which matches other cameras' maps confirm, and what the others are completed from."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]
Volume = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def confirmed(
    disparity: FloatMap, others: NDArray[np.float32], steps: NDArray[np.float32], tolerance: float
) -> Mask:
    """Where at least one other map agrees and no more see through the point than agree.

    Args:
        disparity: float32 (H, W), px.
        others: float32 (P, H, W), maps of other cameras.
        steps: float32 (P, 2), as in `matching_costs.joint_costs`.
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
def _held(disparity, here, per_px, most, costs):  # type: ignore[no-untyped-def]
    for x in range(disparity.size):
        costs[x] = np.uint8(min(abs(here - disparity[x]) * per_px, most))


@njit(cache=True, nogil=True)
def _seen_through(other, other_valid, nearest, count):  # type: ignore[no-untyped-def]
    for x in range(other.size):
        count[x] += np.uint8(other_valid[x] & (other[x] < nearest))


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
    through_cost: int,
    most: int,
    volume: Volume,
) -> None:
    """Costs that complete a map from its valid pixels.

    A valid pixel holds to its disparity (`slope` per px, at most `limit`). Any other has no evidence of
    its own but this: a place that another camera sees through is wrong (`through_cost` for each).

    Args:
        disparity, valid: (H, W), float32 px and bool.
        others, others_valid: (P, H, W), of the other cameras.
        steps: float32 (P, 2), as in `matching_costs.joint_costs`.
        low: disparity of level 0, px.
        most: no cost is higher.
        volume: uint8 (H, levels, W), written.
    """
    height, levels, width = volume.shape
    per_px, held = np.float32(slope), np.float32(min(limit, most))
    count = np.empty(width, np.uint8)
    for y in range(height):
        for level in range(levels):
            costs = volume[y, level]
            _held(disparity[y], np.float32(low + level), per_px, held, costs)
            count[:] = 0
            for p in range(len(steps)):
                left = int(np.rint(steps[p, 0] * (low + level)))
                row = y - int(np.rint(steps[p, 1] * (low + level)))
                first, last = max(left, 0), min(width + left, width)
                if 0 <= row < height and first < last:
                    there = slice(first - left, last - left)
                    nearest = np.float32(low + level - 1.5)
                    _seen_through(
                        others[p, row, there], others_valid[p, row, there], nearest, count[first:last]
                    )
            for x in range(width):
                through = min(int(count[x]) * through_cost, most)
                costs[x] = costs[x] if valid[y, x] else np.uint8(through)

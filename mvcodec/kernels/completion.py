"""Which matches other cameras' maps confirm, and what the others are completed from."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]
Volume = NDArray[np.uint8]
Parts = NDArray[np.int16]

PARTS = 16
"""Parts of a px that completion counts in."""
NOWHERE = np.int16(32767)
THROUGH_PARTS = 24
"""What another camera sees is behind a place if it is farther by more."""
SLOPE_BITS = 7


@njit(cache=True, nogil=True)
def confirmed(
    disparity: FloatMap,
    asked: Mask,
    others: NDArray[np.float32],
    steps: NDArray[np.float32],
    tolerance: float,
) -> Mask:
    """Where at least one other map agrees and no more see through the point than agree.

    Args:
        disparity: float32 (H, W), px.
        asked: bool (H, W); what is not is not confirmed.
        others: float32 (P, H, W), maps of other cameras.
        steps: float32 (P, 2), as in `matching_costs.joint_costs`.
        tolerance: px.
    """
    height, width = disparity.shape
    kept = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            if not asked[y, x]:
                continue
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
def seen_through(
    disparity: FloatMap,
    asked: Mask,
    others: NDArray[np.float32],
    sure: NDArray[np.bool_],
    steps: NDArray[np.float32],
    farther: float,
) -> Mask:
    """Where another map is sure to show what is behind the point.

    Args:
        disparity, asked, others, steps: as in `confirmed`.
        sure: bool (P, H, W), what counts of the other maps.
        farther: px; what is farther by more is behind it.
    """
    height, width = disparity.shape
    found = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            if not asked[y, x]:
                continue
            d = disparity[y, x]
            for p in range(len(steps)):
                u = int(np.rint(x - steps[p, 0] * d))
                v = int(np.rint(y - steps[p, 1] * d))
                if 0 <= u < width and 0 <= v < height and sure[p, v, u]:
                    found[y, x] |= others[p, v, u] < d - farther
    return found


@njit(cache=True, nogil=True)
def unseen(disparity: FloatMap, steps: NDArray[np.float32]) -> Mask:
    """Where a pixel of its disparity leaves the pictures of all others, (H, W); steps as below."""
    height, width = disparity.shape
    outside = np.ones((height, width), np.bool_)
    for y in range(height):
        for p in range(len(steps)):
            by_x, by_y = steps[p, 0], steps[p, 1]
            for x in range(width):
                u, v = np.float32(x) - by_x * disparity[y, x], np.float32(y) - by_y * disparity[y, x]
                outside[y, x] &= (u < 0) | (u >= width) | (v < 0) | (v >= height)
    return outside


@njit(cache=True, nogil=True)
def _held(parts, level, slope, farthest, most, costs):  # type: ignore[no-untyped-def]
    for x in range(parts.size):
        off = np.uint16(max(parts[x], level) - min(parts[x], level))
        costs[x] = np.uint8(min(np.uint16(min(off, farthest) * slope) >> np.uint16(SLOPE_BITS), most))


@njit(cache=True, nogil=True)
def _add_seen_through(others, there, nearest, first, count, seen):  # type: ignore[no-untyped-def]
    for x in range(count):
        seen[first + x] = np.uint8(seen[first + x] + np.uint8(others[there + x] < nearest))


@njit(cache=True, nogil=True)
def _ruled_out(valid, seen, through_cost, most, costs):  # type: ignore[no-untyped-def]
    """What is not valid has no cost but that of being seen through."""
    for x in range(valid.size):
        held = costs[x]  # loaded before it is chosen: only that is vectorised
        through = np.uint8(min(np.uint16(np.uint16(seen[x]) * through_cost), most))
        costs[x] = held if valid[x] else through


@njit(cache=True, nogil=True)
def completion_costs(
    disparity: Parts,
    valid: Mask,
    others: Parts,
    steps: NDArray[np.float32],
    low: int,
    slope: float,
    limit: int,
    through_cost: int,
    most: int,
    start: int,
    volume: Volume,
) -> None:
    """Costs that complete a map from its valid pixels.

    A valid pixel holds to its disparity (`slope` per px, at most `limit`). Any other has no evidence of
    its own but this: a place that another camera sees through is wrong (`through_cost` for each).

    Args:
        disparity: int16 (H, W), PARTS to a px; valid: bool (H, W).
        others: int16 (P, H, W), PARTS to a px, of the other cameras; NOWHERE where not valid.
        steps: float32 (P, 2), as in `matching_costs.joint_costs`.
        low: disparity of level 0, px.
        slope: above 0.
        most: no cost is higher.
        volume: uint8 (R, levels, W'), W' >= W, written: of a band of rows; start: its first row.
    """
    (height, width), levels = disparity.shape, volume.shape[1]
    per_part = np.uint16(max(slope * (1 << SLOPE_BITS) / PARTS + 0.5, 1))
    farthest = np.uint16(65535 // per_part)
    seen = np.empty(width, np.uint8)
    for at in range(len(volume)):
        y = start + at
        for level in range(levels):
            costs = volume[at, level, :width]
            here = np.int16((low + level) * PARTS)
            _held(disparity[y], here, per_part, farthest, np.uint16(min(limit, most)), costs)
            seen[:] = 0
            for p in range(len(steps)):
                left = int(np.rint(steps[p, 0] * (low + level)))
                row = y - int(np.rint(steps[p, 1] * (low + level)))
                first, last = max(left, 0), min(width + left, width)
                if 0 <= row < height and first < last:
                    nearest = np.int16(here - THROUGH_PARTS)
                    there, count = np.uint64(first - left), np.uint64(last - first)
                    _add_seen_through(others[p, row], there, nearest, np.uint64(first), count, seen)
            _ruled_out(valid[y], seen, np.uint16(through_cost), np.uint16(most), costs)

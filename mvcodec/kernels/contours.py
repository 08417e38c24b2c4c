"""How far surfaces reach at their contours, by what their edges show to other cameras."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Grey = NDArray[np.uint8]

WINDOW = 1
"""Half the window that is compared, px."""
MOST_LEVELS = np.float32(30)
"""The most that a pixel of it counts, grey levels."""


@njit(cache=True, nogil=True)
def _is_plain(grey, y, x, down, across, depth, levels):  # type: ignore[no-untyped-def]
    """Whether the pixels from here on, `depth` of them, look as this one does."""
    height, width = grey.shape
    here, plain = np.int64(grey[y, x]), True
    for i in range(1, depth + 1):
        v, u = min(max(y + i * down, 0), height - 1), min(max(x + i * across, 0), width - 1)
        plain &= abs(np.int64(grey[v, u]) - here) < levels
    return plain


@njit(cache=True, nogil=True)
def _nearer_beside(disparity, grey, y, x, step, depth, levels):  # type: ignore[no-untyped-def]
    """The nearest disparity that a pixel could take over from beside it, or its own."""
    height, width = disparity.shape
    found = disparity[y, x]
    for down in range(-1, 2):
        for across in range(-1, 2):
            v, u = y + down, x + across
            if v < 0 or v >= height or u < 0 or u >= width:
                continue
            nearer = disparity[v, u] > max(found, disparity[y, x] + step)
            if nearer and _is_plain(grey, y, x, -down, -across, depth, levels):
                found = disparity[v, u]
    return found


@njit(cache=True, nogil=True)
def _misfit(grey, other, y, x, left, up):  # type: ignore[no-untyped-def]
    """How unlike the window around a pixel and a partner's are, the pixel being (left, up) further there.

    Negative where the partner's picture does not hold the pixel.
    """
    height, width = grey.shape
    at_x, at_y = np.float32(x) - left, np.float32(y) - up
    if at_x < 0 or at_x > width - 1 or at_y < 0 or at_y > height - 1:
        return np.float32(-1)
    first_x, first_y = int(np.floor(at_x)), int(np.floor(at_y))
    t_x, t_y = at_x - np.float32(first_x), at_y - np.float32(first_y)
    total = np.float32(0)
    for down in range(-WINDOW, WINDOW + 1):
        v = min(max(first_y + down, 0), height - 1)
        w = min(max(first_y + down + 1, 0), height - 1)
        own_y = min(max(y + down, 0), height - 1)
        for across in range(-WINDOW, WINDOW + 1):
            u = min(max(first_x + across, 0), width - 1)
            s = min(max(first_x + across + 1, 0), width - 1)
            own = np.float32(grey[own_y, min(max(x + across, 0), width - 1)])
            above = np.float32(other[v, u]) + t_x * (np.float32(other[v, s]) - np.float32(other[v, u]))
            below = np.float32(other[w, u]) + t_x * (np.float32(other[w, s]) - np.float32(other[w, u]))
            total += min(abs(above + t_y * (below - above) - own), MOST_LEVELS)
    return total


@njit(cache=True, nogil=True)
def widen(
    disparity: FloatMap,
    nearest: FloatMap,
    greys: Grey,
    camera: int,
    partners: NDArray[np.int64],
    steps: NDArray[np.float32],
    step: float,
    depth: int,
    levels: int,
    share: float,
    out: FloatMap,
) -> None:
    """Give plain pixels beside a nearer surface to that surface, where the edge between them moves with it.

    Args:
        disparity: float32 (H, W), px.
        nearest: float32 (H, W), the greatest of 3 x 3 pixels of it.
        greys: uint8 (N, H, W), of all cameras.
        camera, partners: which of them; int64 (P,).
        steps: float32 (P, 2), as in `matching_costs.joint_costs`.
        step: surfaces are further apart than this, px.
        depth: pixels beyond that must look alike,
        levels: within less than so many grey levels.
        share: of what contradicts the pixel's own disparity, at most this contradicts the nearer one.
        out: float32 (H, W), a copy of `disparity`, changed in place.
    """
    height, width = disparity.shape
    grey, apart = greys[camera], np.float32(step)
    for y in range(height):
        for x in range(width):
            own = disparity[y, x]
            if nearest[y, x] - own <= apart:
                continue
            nearer = _nearer_beside(disparity, grey, y, x, apart, depth, levels)
            if nearer == own:
                continue
            against_own, against_nearer = np.float32(0), np.float32(0)
            for p in range(len(partners)):
                other, by_x, by_y = greys[partners[p]], steps[p, 0], steps[p, 1]
                one = _misfit(grey, other, y, x, by_x * own, by_y * own)
                two = _misfit(grey, other, y, x, by_x * nearer, by_y * nearer)
                if one >= 0 and two >= 0:
                    against_own += one
                    against_nearer += two
            if against_own > 0 and against_nearer <= np.float32(share) * against_own:
                out[y, x] = nearer

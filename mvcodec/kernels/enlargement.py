"""Disparity maps of half size brought back to the size of their pictures, along the pictures' edges."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Pictures = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def enlarge(
    small: FloatMap, picture: Pictures, small_picture: Pictures, tolerance: float, step: float, out: FloatMap
) -> None:
    """Double a map's size: bilinear on surfaces, and at their edges by the colours of the picture.

    Sample (v, u) stands in the middle of pixels 2v, 2v + 1 and 2u, 2u + 1. Between four samples that agree
    the value is bilinear. Elsewhere, of the 3 x 3 samples around a pixel, the one wins whose colour
    difference (sum over R, G, B) / `step` + squared distance (in samples) is the smallest; what
    agrees with it is averaged with weights of 1 / (1 + that)^2.

    Args:
        small: float32 (h, w), px.
        picture: uint8 (H, W, 3), H in 2h - 1 .. 2h and W likewise, or smaller.
        small_picture: uint8 (h, w, 3), the mean colour around each sample.
        tolerance: samples agree that differ by no more, px.
        step: the colour difference that counts as much as one sample of distance.
        out: float32 (H, W), written.
    """
    height, width = out.shape
    rows, columns = small.shape
    near, far = np.float32(0.75), np.float32(0.25)
    costs = np.empty(9, np.float32)
    values = np.empty(9, np.float32)
    agree, per_step = np.float32(tolerance), np.float32(1 / step)
    for v in range(-1, rows):
        top, bottom = max(v, 0), min(v + 1, rows - 1)
        for u in range(-1, columns):
            left, right = max(u, 0), min(u + 1, columns - 1)
            a, b, c, d = small[top, left], small[top, right], small[bottom, left], small[bottom, right]
            even = max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) <= agree
            for y in range(max(2 * v + 1, 0), min(2 * v + 3, height)):
                up = near if y == 2 * v + 1 else far
                for x in range(max(2 * u + 1, 0), min(2 * u + 3, width)):
                    leftward = near if x == 2 * u + 1 else far
                    if even:
                        above = leftward * a + (1 - leftward) * b
                        below = leftward * c + (1 - leftward) * d
                        out[y, x] = up * above + (1 - up) * below
                        continue
                    best = np.float32(np.inf)
                    chosen = a
                    count = 0
                    for j in range(max(y // 2 - 1, 0), min(y // 2 + 2, rows)):
                        dy = np.float32(j - v) - (1 - up)
                        for i in range(max(x // 2 - 1, 0), min(x // 2 + 2, columns)):
                            dx = np.float32(i - u) - (1 - leftward)
                            difference = np.int32(0)
                            for channel in range(3):
                                difference += abs(
                                    np.int32(picture[y, x, channel]) - np.int32(small_picture[j, i, channel])
                                )
                            cost = difference * per_step + dy * dy + dx * dx
                            costs[count], values[count] = cost, small[j, i]
                            count += 1
                            if cost < best:
                                best, chosen = cost, small[j, i]
                    total, weights = np.float32(0), np.float32(0)
                    for k in range(count):
                        if abs(values[k] - chosen) <= agree:
                            weight = 1 / ((1 + costs[k]) * (1 + costs[k]))
                            total += weight * values[k]
                            weights += weight
                    out[y, x] = total / weights

"""Disparity maps of half size brought back to the size of their pictures, along the pictures' edges."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Pictures = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def _between(upper, lower, up, line):  # type: ignore[no-untyped-def]
    """One row bilinearly, from column -1 on, out of the samples above and below it from column -1 on."""
    near, far = np.float32(0.75), np.float32(0.25)
    for k in range(upper.size - 1):  # vectorised
        above = near * upper[k] + (1 - near) * upper[k + 1]
        below = near * lower[k] + (1 - near) * lower[k + 1]
        line[2 * k] = up * above + (1 - up) * below
        above = far * upper[k] + (1 - far) * upper[k + 1]
        below = far * lower[k] + (1 - far) * lower[k + 1]
        line[2 * k + 1] = up * above + (1 - up) * below


@njit(cache=True, nogil=True, inline="always")  # a call would count the references of its arrays
def _at_edge(small, picture, small_picture, y, x, dy, dx, agree, per_step, costs, values):  # type: ignore[no-untyped-def]
    """The disparity of one pixel by its colour; dy, dx: from it to sample (0, 0), in samples.

    Choices are selections, not branches: at an edge no processor foresees them.
    """
    rows, columns = small.shape
    zero, one = np.float32(0), np.float32(1)
    red, green, blue = np.int32(picture[y, x, 0]), np.int32(picture[y, x, 1]), np.int32(picture[y, x, 2])
    best, chosen = np.float32(np.inf), zero
    count = 0
    for j in range(max(y // 2 - 1, 0), min(y // 2 + 2, rows)):
        down = (np.float32(j) + dy) * (np.float32(j) + dy)
        for i in range(max(x // 2 - 1, 0), min(x // 2 + 2, columns)):
            difference = np.int32(
                abs(red - np.int32(small_picture[j, i, 0]))
                + abs(green - np.int32(small_picture[j, i, 1]))
                + abs(blue - np.int32(small_picture[j, i, 2]))
            )
            aside = (np.float32(i) + dx) * (np.float32(i) + dx)
            cost, value = np.float32(difference) * per_step + (down + aside), small[j, i]
            costs[count], values[count] = cost, value
            count += 1
            better = cost < best
            best, chosen = cost if better else best, value if better else chosen
    total, weights = zero, zero
    for k in range(count):
        more = one + costs[k]
        weight = one / (more * more) if abs(values[k] - chosen) <= agree else zero
        total += weight * values[k]
        weights += weight
    return total / weights


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
    costs, values = np.empty(9, np.float32), np.empty(9, np.float32)
    agree, per_step = np.float32(tolerance), np.float32(1 / step)
    upper, lower = np.empty(columns + 2, np.float32), np.empty(columns + 2, np.float32)
    line, uneven = np.empty(2 * columns + 2, np.float32), np.empty(columns + 1, np.bool_)
    for v in range(-1, rows):
        for samples, row in ((upper, small[max(v, 0)]), (lower, small[min(v + 1, rows - 1)])):
            samples[1:-1] = row
            samples[0], samples[-1] = row[0], row[-1]
        for k in range(columns + 1):
            nearest = max(max(upper[k], upper[k + 1]), max(lower[k], lower[k + 1]))
            farthest = min(min(upper[k], upper[k + 1]), min(lower[k], lower[k + 1]))
            uneven[k] = nearest - farthest > agree
        for y in range(max(2 * v + 1, 0), min(2 * v + 3, height)):
            _between(upper, lower, np.float32(0.75) if y == 2 * v + 1 else np.float32(0.25), line)
            out[y] = line[1 : width + 1]
            for k in range(columns + 1):
                if uneven[k]:
                    for x in range(max(2 * k - 1, 0), min(2 * k + 1, width)):
                        dy, dx = (
                            np.float32(0.25) - np.float32(0.5) * y,
                            np.float32(0.25) - np.float32(0.5) * x,
                        )
                        out[y, x] = _at_edge(
                            small, picture, small_picture, y, x, dy, dx, agree, per_step, costs, values
                        )

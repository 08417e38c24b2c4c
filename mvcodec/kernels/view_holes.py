"""Colour where no real camera sees a virtual view: painted from the background around it."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.view_marks import list_marked

FloatMap = NDArray[np.float32]
ByteMap = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def paint_holes(
    picture: NDArray[np.uint8],
    disparity: FloatMap,
    seen_by: ByteMap,
    tolerance: float,
    reach: int,
    first: int,
    last: int,
) -> None:
    """Paint pixels that no camera sees, in place, from the background around them, rows first..last-1.

    Of the first seen pixels in eight directions (up to `reach` px away), those on the farthest surface
    are averaged by inverse square distance.
    """
    height, width = disparity.shape
    found = np.empty((8, 3), np.int64)
    marks, chosen = np.empty(width, np.uint8), np.empty(width, np.int32)
    for y in range(first, last):
        for x in range(width):
            marks[x] = seen_by[y, x] == 0
        for x in chosen[: list_marked(marks, chosen)]:
            count = 0
            farthest = np.float32(np.inf)
            for direction in range(9):
                step_x, step_y = direction % 3 - 1, direction // 3 - 1
                if step_x == 0 and step_y == 0:
                    continue
                for distance in range(1, reach + 1):
                    u, v = x + step_x * distance, y + step_y * distance
                    if u < 0 or v < 0 or u >= width or v >= height:
                        break
                    if seen_by[v, u]:
                        found[count, 0], found[count, 1] = v, u
                        found[count, 2] = distance * distance * (step_x * step_x + step_y * step_y)
                        count += 1
                        farthest = min(farthest, disparity[v, u])
                        break
            red = green = blue = total = 0.0
            for k in range(count):
                v, u = found[k, 0], found[k, 1]
                if disparity[v, u] <= farthest + tolerance:
                    weight = 1.0 / found[k, 2]
                    red += weight * picture[v, u, 0]
                    green += weight * picture[v, u, 1]
                    blue += weight * picture[v, u, 2]
                    total += weight
            if total > 0:
                picture[y, x, 0] = int(red / total + 0.5)
                picture[y, x, 1] = int(green / total + 0.5)
                picture[y, x, 2] = int(blue / total + 0.5)

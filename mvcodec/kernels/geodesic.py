"""Carry disparities from where they are known along the shortest ways that cross the least contrast."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]

UNREACHED = np.float32(1e30)


@njit(cache=True, nogil=True)
def _relax(planes, distance, disparity, x, y, u, v, edge_cost, length):  # type: ignore[no-untyped-def]
    """Come to (x, y) by (u, v) if that is shorter; whether it was."""
    contrast = np.float32(0)
    for channel in range(3):
        contrast = max(contrast, abs(planes[channel, y, x] - planes[channel, v, u]))
    found = distance[v, u] + length + edge_cost * contrast
    if found < distance[y, x]:
        distance[y, x] = found
        disparity[y, x] = disparity[v, u]
        return True
    return False


@njit(cache=True, nogil=True)
def carry(
    planes: NDArray[np.float32], known: Mask, edge_cost: float, row_cost: float, disparity: FloatMap
) -> FloatMap:
    """Give each pixel the disparity of the known pixel that is nearest by geodesic distance.

    A step to one of the eight neighbours costs its length, px, the rows being `row_cost` px apart, and
    `edge_cost` for each grey level of the channel that changes most. Distances are exact: raster scans
    (Toivanen 1996) go on until none shortens.

    Args:
        planes: float32 (3, H, W), the picture.
        known: bool (H, W).
        disparity: float32 (H, W), px; overwritten where not known. Stays where no pixel is known.

    Returns:
        float32 (H, W): the distance, 0 where known, UNREACHED where no pixel is known.
    """
    height, width = known.shape
    cost = np.float32(edge_cost)
    along, across = np.float32(1), np.float32(row_cost)
    diagonal = np.sqrt(along + across * across)
    distance = np.empty((height, width), np.float32)
    for y in range(height):
        for x in range(width):
            distance[y, x] = 0 if known[y, x] else UNREACHED
    backwards = False
    quiet = 0
    while quiet < 2:
        changed = False
        way = -1 if backwards else 1
        for row in range(height):
            y = height - 1 - row if backwards else row
            behind = y - way
            inside = 0 <= behind < height
            for col in range(width):
                x = width - 1 - col if backwards else col
                if known[y, x]:
                    continue
                if 0 <= x - way < width:
                    changed |= _relax(planes, distance, disparity, x, y, x - way, y, cost, along)
                if inside:
                    changed |= _relax(planes, distance, disparity, x, y, x, behind, cost, across)
                    if x > 0:
                        changed |= _relax(planes, distance, disparity, x, y, x - 1, behind, cost, diagonal)
                    if x < width - 1:
                        changed |= _relax(planes, distance, disparity, x, y, x + 1, behind, cost, diagonal)
        backwards = not backwards
        quiet = 0 if changed else quiet + 1
    return distance

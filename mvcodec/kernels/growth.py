"""Growing of regions over a picture: which seed reaches each pixel at the least cost."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

_ROUNDS = 4
"""Passes down and up. More change next to nothing on pictures; a maze would need them."""


@njit(cache=True, nogil=True)
def nearest_seeds(
    seeds: NDArray[np.bool_], row_costs: NDArray[np.float32], column_costs: NDArray[np.float32]
) -> NDArray[np.int32]:
    """The seed that each pixel is cheapest to reach from, by steps to the four neighbours.

    Args:
        seeds: bool (H, W).
        row_costs: float32 (H, W), of the step between (y, x - 1) and (y, x); infinite where there is none.
        column_costs: float32 (H, W), of the step between (y - 1, x) and (y, x).

    Returns:
        int32 (H, W): index of the seed in the flattened picture; -1 where none was reached.
    """
    height, width = seeds.shape
    distance = np.where(seeds, np.float32(0), np.float32(np.inf))
    nearest = np.full((height, width), -1, np.int32)
    for y in range(height):
        for x in range(width):
            if seeds[y, x]:
                nearest[y, x] = y * width + x
    for _ in range(_ROUNDS):
        for y in range(height):
            for x in range(width):
                if x > 0:
                    _step(distance, nearest, y, x, y, x - 1, row_costs[y, x])
                if y > 0:
                    _step(distance, nearest, y, x, y - 1, x, column_costs[y, x])
        for y in range(height - 1, -1, -1):
            for x in range(width - 1, -1, -1):
                if x < width - 1:
                    _step(distance, nearest, y, x, y, x + 1, row_costs[y, x + 1])
                if y < height - 1:
                    _step(distance, nearest, y, x, y + 1, x, column_costs[y + 1, x])
    return nearest


@njit(cache=True, nogil=True, inline="always")
def _step(
    distance: NDArray[np.float32],
    nearest: NDArray[np.int32],
    y: int,
    x: int,
    from_y: int,
    from_x: int,
    cost: np.float32,
) -> None:
    reached = distance[from_y, from_x] + cost
    if reached < distance[y, x]:
        distance[y, x] = reached
        nearest[y, x] = nearest[from_y, from_x]

"""Repair of a disparity map: votes of crosses, directed interpolation, edges, sub-pixels (Mei et al.)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.cost_volume import Arms, Volume

Levels = NDArray[np.int32]
"""int32 (H, W): whole disparity less the lowest one, px; -1 where unknown."""


@njit(cache=True, nogil=True)
def vote(levels: Levels, arms: Arms, count: int, least_votes: int, least_share: float) -> Levels:
    """Give each unknown pixel the level that most known ones of its cross region have (section 2.4).

    Args:
        levels: int32 (H, W), below `count`.
        least_votes: tau_S; more known pixels than this must be in the region.
        least_share: tau_H; the winner's share of them must be larger.

    Returns:
        int32 (H, W); every vote is on the map as it came in.
    """
    height, width = levels.shape
    voted = levels.copy()
    votes = np.zeros(count, np.int32)
    for y in range(height):
        for x in range(width):
            if levels[y, x] >= 0:
                continue
            votes[:] = 0
            voters = 0
            for row in range(y - arms[y, x, 2], y + arms[y, x, 3] + 1):
                for column in range(x - arms[row, x, 0], x + arms[row, x, 1] + 1):
                    if levels[row, column] >= 0:
                        votes[levels[row, column]] += 1
                        voters += 1
            winner = votes.argmax()
            if voters > least_votes and votes[winner] > least_share * voters:
                voted[y, x] = winner
    return voted


@njit(cache=True, nogil=True)
def interpolate(
    levels: Levels, hidden: NDArray[np.bool_], picture: NDArray[np.uint8], directions: NDArray[np.float64]
) -> Levels:
    """Fill each unknown pixel from the nearest known ones in several directions.

    Args:
        levels: int32 (H, W).
        hidden: bool (H, W); such pixels take the lowest level found (the background's), the others that of
            the pixel of the most similar colour, the first of equals.
        picture: uint8 (H, W, 3).
        directions: float64 (N, 2), (dy, dx) of the steps to take.

    Returns:
        int32 (H, W); -1 remains where no direction meets a known pixel.
    """
    height, width = levels.shape
    filled = levels.copy()
    for y in range(height):
        for x in range(width):
            if levels[y, x] >= 0:
                continue
            best_colour = np.int32(1 << 30)
            for direction in range(directions.shape[0]):
                step_y, step_x = directions[direction, 0], directions[direction, 1]
                distance = 1
                while True:
                    row, column = round(y + distance * step_y), round(x + distance * step_x)
                    if not (0 <= row < height and 0 <= column < width):
                        break
                    level = levels[row, column]
                    if level < 0:
                        distance += 1
                        continue
                    if hidden[y, x]:
                        if filled[y, x] < 0 or level < filled[y, x]:
                            filled[y, x] = level
                    else:
                        colour = np.int32(0)
                        for channel in range(3):
                            step = abs(np.int32(picture[y, x, channel]) - picture[row, column, channel])
                            colour = max(colour, step)
                        if colour < best_colour:
                            best_colour = colour
                            filled[y, x] = level
                    break
    return filled


@njit(cache=True, nogil=True)
def settle_edges(levels: Levels, edges: NDArray[np.bool_], volume: Volume) -> Levels:
    """On edges of the map, take over the level of the left or right neighbour where that is cheaper.

    Args:
        levels: int32 (H, W), all known.
        edges: bool (H, W), the pixels to look at.
        volume: float32 (H, W, levels).
    """
    height, width = levels.shape
    settled = levels.copy()
    for y in range(height):
        for x in range(1, width - 1):
            if not edges[y, x]:
                continue
            for neighbour in (levels[y, x - 1], levels[y, x + 1]):
                if volume[y, x, neighbour] < volume[y, x, settled[y, x]]:
                    settled[y, x] = neighbour
    return settled


@njit(cache=True, nogil=True)
def parabola_peaks(levels: Levels, volume: Volume) -> NDArray[np.float32]:
    """Refine each level by the parabola through its cost and those of its two neighbours.

    Returns:
        float32 (H, W), levels; whole where the level is the first or last, or not the cheapest of three.
    """
    height, width = levels.shape
    refined = levels.astype(np.float32)
    last = volume.shape[2] - 1
    for y in range(height):
        for x in range(width):
            level = levels[y, x]
            if not 0 < level < last:
                continue
            below, here, above = volume[y, x, level - 1], volume[y, x, level], volume[y, x, level + 1]
            bend = below + above - 2 * here
            if bend > 0 and here <= below and here <= above:
                refined[y, x] = level + np.float32(0.5) * (below - above) / bend
    return refined

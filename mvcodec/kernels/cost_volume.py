"""Cost volumes of one pair: AD-Census costs, aggregation over crosses, scanlines, winners (Mei et al. 2011).

A volume is float32 (H, W, levels): the cost of disparity low + level at a pixel of the first picture,
which is at ``x - low - level`` in the second one. Functions that take start and stop work on that band of
rows (columns, where they say so) and write nothing else, so that bands can run side by side.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.census import hamming

Volume = NDArray[np.float32]
Arms = NDArray[np.int16]
"""int16 (H, W, 4): how far the cross of a pixel reaches to the left, right, up and down, px."""


@njit(cache=True, nogil=True)
def ad_census_costs(
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    first_census: NDArray[np.uint64],
    second_census: NDArray[np.uint64],
    low: int,
    difference_costs: NDArray[np.float32],
    census_costs: NDArray[np.float32],
    outside_cost: float,
    start: int,
    stop: int,
    volume: Volume,
) -> None:
    """Equation 3 of Mei et al.: truncated colour difference plus truncated census distance.

    Args:
        first, second: uint8 (H, W, 3).
        first_census, second_census: uint64 (H, W).
        low: disparity of level 0, px.
        difference_costs: float32 (766,), by sum of absolute differences over the channels.
        census_costs: float32 (65,), by Hamming distance.
        outside_cost: where the pixel would lie outside the second picture.
        volume: float32 (H, W, levels), written.
    """
    width, levels = volume.shape[1], volume.shape[2]
    for y in range(start, stop):
        for x in range(width):
            red, green, blue = np.int32(first[y, x, 0]), np.int32(first[y, x, 1]), np.int32(first[y, x, 2])
            bits = first_census[y, x]
            for level in range(levels):
                target = x - low - level
                if not 0 <= target < width:
                    volume[y, x, level] = outside_cost
                    continue
                difference = abs(red - second[y, target, 0])
                difference += abs(green - second[y, target, 1])
                difference += abs(blue - second[y, target, 2])
                distance = hamming(bits, second_census[y, target])
                volume[y, x, level] = difference_costs[difference] + census_costs[distance]


@njit(cache=True, nogil=True, inline="always")
def _colour_distance(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> np.int32:
    distance = abs(np.int32(a[0]) - np.int32(b[0]))
    distance = max(distance, abs(np.int32(a[1]) - np.int32(b[1])))
    return max(distance, abs(np.int32(a[2]) - np.int32(b[2])))


@njit(cache=True, nogil=True)
def cross_arms(picture: NDArray[np.uint8], reach: int, near_reach: int, colour: int, far_colour: int) -> Arms:
    """How far the cross of each pixel reaches before the colour changes (Mei et al., section 2.2).

    Args:
        picture: uint8 (H, W, 3).
        reach: L1; an arm ends before this distance, px.
        near_reach: L2; beyond this distance `far_colour` applies, px.
        colour: tau1; largest channel difference to the centre and from pixel to pixel stays below.
        far_colour: tau2.

    Returns:
        int16 (H, W, 4): left, right, up, down, px; 0 .. reach - 1.
    """
    height, width = picture.shape[0], picture.shape[1]
    arms = np.zeros((height, width, 4), np.int16)
    steps = ((0, -1), (0, 1), (-1, 0), (1, 0))
    for y in range(height):
        for x in range(width):
            for side in range(4):
                step_y, step_x = steps[side]
                length = 0
                for distance in range(1, reach):
                    row, column = y + step_y * distance, x + step_x * distance
                    if not (0 <= row < height and 0 <= column < width):
                        break
                    to_centre = _colour_distance(picture[row, column], picture[y, x])
                    to_last = _colour_distance(picture[row, column], picture[row - step_y, column - step_x])
                    if to_centre >= colour or to_last >= colour:
                        break
                    if distance > near_reach and to_centre >= far_colour:
                        break
                    length = distance
                arms[y, x, side] = length
    return arms


# Both directions are one text; inlined where `along_rows` is a constant, each is as fast as if written alone.


@njit(cache=True, nogil=True, inline="always")
def _sum_along(
    volume: Volume,
    arms: Arms,
    counts: NDArray[np.float32],
    along_rows: bool,
    start: int,
    stop: int,
    sums: Volume,
) -> None:
    height, width, levels = volume.shape
    length, side = (width, 0) if along_rows else (height, 2)
    # Double precision: differences of long sums must not lose what tells two disparities apart.
    running = np.zeros((length + 1, levels), np.float64)
    for line in range(start, stop):
        for place in range(length):
            y, x = (line, place) if along_rows else (place, line)
            for level in range(levels):
                running[place + 1, level] = running[place, level] + volume[y, x, level]
        for place in range(length):
            y, x = (line, place) if along_rows else (place, line)
            begin, end = place - arms[y, x, side], place + arms[y, x, side + 1] + 1
            share = 1.0 / counts[y, x]
            for level in range(levels):
                sums[y, x, level] = (running[end, level] - running[begin, level]) * share


@njit(cache=True, nogil=True)
def sum_along_rows(
    volume: Volume, arms: Arms, counts: NDArray[np.float32], start: int, stop: int, sums: Volume
) -> None:
    """Sum the costs over each pixel's left and right arm, divided by its count; rows start .. stop - 1."""
    _sum_along(volume, arms, counts, True, start, stop, sums)


@njit(cache=True, nogil=True)
def sum_along_columns(
    volume: Volume, arms: Arms, counts: NDArray[np.float32], start: int, stop: int, sums: Volume
) -> None:
    """Sum the costs over each pixel's upper and lower arm, by its count; columns start .. stop - 1."""
    _sum_along(volume, arms, counts, False, start, stop, sums)


@njit(cache=True, nogil=True, inline="always")
def _follow(
    volume: Volume,
    first_edges: NDArray[np.bool_],
    second_edges: NDArray[np.bool_],
    low: int,
    penalties: NDArray[np.float32],
    along_rows: bool,
    backward: bool,
    start: int,
    stop: int,
    total: Volume,
) -> None:
    height, width, levels = volume.shape
    # In a row, the first pixel has no edge before it.
    length, first_target = (width, 1) if along_rows else (height, 0)
    before, path = np.empty(levels + 2, np.float32), np.empty(levels + 2, np.float32)
    for line in range(start, stop):
        before[:] = np.inf
        for step in range(length):
            place = length - 1 - step if backward else step
            border = place + 1 if backward else place
            y, x = (line, place) if along_rows else (place, line)
            edge_y, edge_x = (line, border) if along_rows else (border, line)
            first_edge = step > 0 and first_edges[edge_y, edge_x]
            least = before[1:-1].min() if step > 0 else np.float32(0)
            path[0] = path[levels + 1] = np.inf
            for level in range(levels):
                cost = volume[y, x, level]
                if step > 0:
                    target = edge_x - low - level
                    inside = first_target <= target < width
                    second_edge = second_edges[edge_y, target] if inside else first_edge
                    row = np.int64(first_edge) + np.int64(second_edge)
                    reached = min(before[level], before[level + 2]) + penalties[row, 0]
                    reached = min(reached, before[level + 1], least + penalties[row, 1])
                    cost += reached - least
                path[level + 1] = cost
                total[y, x, level] += cost
            before, path = path, before


@njit(cache=True, nogil=True)
def follow_rows(
    volume: Volume,
    first_edges: NDArray[np.bool_],
    second_edges: NDArray[np.bool_],
    low: int,
    penalties: NDArray[np.float32],
    backward: bool,
    start: int,
    stop: int,
    total: Volume,
) -> None:
    """Add the path costs along rows to `total`, rows start .. stop - 1 (Mei et al., section 2.3).

    Args:
        first_edges, second_edges: bool (H, W), whether the colour changes between x - 1 and x.
        penalties: float32 (3, 2): of a disparity step of one and of more, where no, one or both
            pictures change colour.
        backward: paths run from right to left.
        total: float32 (H, W, levels), added to.
    """
    _follow(volume, first_edges, second_edges, low, penalties, True, backward, start, stop, total)


@njit(cache=True, nogil=True)
def follow_columns(
    volume: Volume,
    first_edges: NDArray[np.bool_],
    second_edges: NDArray[np.bool_],
    low: int,
    penalties: NDArray[np.float32],
    backward: bool,
    start: int,
    stop: int,
    total: Volume,
) -> None:
    """Add the path costs along columns start .. stop - 1 to `total`.

    Args:
        first_edges, second_edges: bool (H, W), whether the colour changes between y - 1 and y.
        backward: paths run from bottom to top.
        The others as in `follow_rows`.
    """
    _follow(volume, first_edges, second_edges, low, penalties, False, backward, start, stop, total)


@njit(cache=True, nogil=True)
def cheapest_levels(volume: Volume, start: int, stop: int, levels_found: NDArray[np.int32]) -> None:
    """Winner takes all: the cheapest level of each pixel (the lowest of equals), rows start .. stop - 1."""
    width, levels = volume.shape[1], volume.shape[2]
    for y in range(start, stop):
        for x in range(width):
            best = 0
            for level in range(1, levels):
                if volume[y, x, level] < volume[y, x, best]:
                    best = level
            levels_found[y, x] = best

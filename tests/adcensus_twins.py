"""Plain twins of the AD-Census kernels: one pixel after the other, as the paper words them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import Mask, Picture

Volume = NDArray[np.float32]
Levels = NDArray[np.int32]
Arms = NDArray[np.int16]


def census_transform(grey: NDArray[np.uint8], radius_x: int, radius_y: int) -> NDArray[np.uint64]:
    padded = np.pad(grey, ((radius_y, radius_y), (radius_x, radius_x)), mode="edge")
    bits = np.zeros(grey.shape, np.uint64)
    for y, x in np.ndindex(grey.shape):
        window = padded[y : y + 2 * radius_y + 1, x : x + 2 * radius_x + 1].ravel()
        neighbours = np.delete(window, window.size // 2)
        digits = "".join("1" if neighbour < grey[y, x] else "0" for neighbour in neighbours)
        bits[y, x] = int("0" + digits, 2)
    return bits


def ad_census_costs(
    first: Picture,
    second: Picture,
    first_census: NDArray[np.uint64],
    second_census: NDArray[np.uint64],
    low: int,
    difference_costs: NDArray[np.float32],
    census_costs: NDArray[np.float32],
    outside_cost: float,
    levels: int,
) -> Volume:
    height, width = first.shape[:2]
    volume = np.full((height, width, levels), outside_cost, np.float32)
    for y, x, level in np.ndindex(volume.shape):
        target = x - low - level
        if 0 <= target < width:
            difference = int(np.abs(first[y, x].astype(int) - second[y, target]).sum())
            distance = (int(first_census[y, x]) ^ int(second_census[y, target])).bit_count()
            volume[y, x, level] = difference_costs[difference] + census_costs[distance]
    return volume


def cross_arms(picture: Picture, reach: int, near_reach: int, colour: int, far_colour: int) -> Arms:
    height, width = picture.shape[:2]
    wide = picture.astype(int)
    arms = np.zeros((height, width, 4), np.int16)
    for y, x in np.ndindex(height, width):
        rays = wide[y, x::-1], wide[y, x:], wide[y::-1, x], wide[y:, x]
        for side, ray in enumerate(rays):
            to_centre = np.abs(ray[1:reach] - ray[0]).max(axis=1)
            to_last = np.abs(np.diff(ray[:reach], axis=0)).max(axis=1)
            far = np.arange(1, len(to_centre) + 1) > near_reach
            ends = (to_centre >= colour) | (to_last >= colour) | (far & (to_centre >= far_colour))
            arms[y, x, side] = ends.argmax() if ends.any() else len(ends)
    return arms


def sums(volume: Volume, arms: Arms, counts: NDArray[np.float32], along_rows: bool) -> Volume:
    result = np.empty_like(volume)
    for y, x in np.ndindex(volume.shape[:2]):
        left, right, up, down = (int(arm) for arm in arms[y, x])
        part = volume[y, x - left : x + right + 1] if along_rows else volume[y - up : y + down + 1, x]
        result[y, x] = part.astype(np.float64).sum(axis=0) / counts[y, x]
    return result


def follow(
    volume: Volume,
    first_edges: Mask,
    second_edges: Mask,
    low: int,
    penalties: NDArray[np.float32],
    backward: bool,
    along_rows: bool,
) -> NDArray[np.float64]:
    """Path costs of one direction; equation 4 of the paper, with the border x | x + 1 kept at x + 1."""
    height, width, levels = volume.shape
    paths = np.empty(volume.shape, np.float64)
    step = (0, 1) if along_rows else (1, 0)
    sign = -1 if backward else 1
    order = sorted(np.ndindex(height, width), key=lambda place: sign * (place[1] if along_rows else place[0]))
    for y, x in order:
        last = y - sign * step[0], x - sign * step[1]
        if not (0 <= last[0] < height and 0 <= last[1] < width):
            paths[y, x] = volume[y, x]
            continue
        border = max(y, last[0]), max(x, last[1])
        before = paths[last]
        for level in range(levels):
            target = border[1] - low - level
            inside = (0 < target < width) if along_rows else (0 <= target < width)
            first_edge = bool(first_edges[border])
            second_edge = bool(second_edges[border[0], target]) if inside else first_edge
            small, large = penalties[int(first_edge) + int(second_edge)]
            reached = [before[level], before.min() + large]
            reached += [before[other] + small for other in (level - 1, level + 1) if 0 <= other < levels]
            paths[y, x, level] = volume[y, x, level] + min(reached) - before.min()
    return paths


def vote(levels: Levels, arms: Arms, least_votes: int, least_share: float) -> Levels:
    voted = levels.copy()
    for y, x in np.argwhere(levels < 0):
        region = [
            levels[row, x - arms[row, x, 0] : x + arms[row, x, 1] + 1]
            for row in range(y - arms[y, x, 2], y + arms[y, x, 3] + 1)
        ]
        known = np.concatenate(region)
        known = known[known >= 0]
        if known.size > least_votes:
            votes = np.bincount(known)
            if votes.max() > least_share * known.size:
                voted[y, x] = votes.argmax()
    return voted


def interpolate(levels: Levels, hidden: Mask, picture: Picture, directions: NDArray[np.float64]) -> Levels:
    height, width = levels.shape
    filled = levels.copy()
    for y, x in np.argwhere(levels < 0):
        met = []
        for step_y, step_x in directions:
            for distance in range(1, height + width):
                row, column = round(y + distance * step_y), round(x + distance * step_x)
                if not (0 <= row < height and 0 <= column < width):
                    break
                if levels[row, column] >= 0:
                    colours = np.abs(picture[y, x].astype(int) - picture[row, column])
                    met.append((int(colours.max()), int(levels[row, column])))
                    break
        if met and hidden[y, x]:
            filled[y, x] = min(level for _, level in met)
        elif met:
            filled[y, x] = min(met, key=lambda found: found[0])[1]
    return filled


def settle_edges(levels: Levels, edges: Mask, volume: Volume) -> Levels:
    settled = levels.copy()
    for y, x in np.argwhere(edges):
        if 0 < x < levels.shape[1] - 1:
            choices = levels[y, x], levels[y, x - 1], levels[y, x + 1]
            settled[y, x] = min(choices, key=lambda level: volume[y, x, level])
    return settled


def parabola_peaks(levels: Levels, volume: Volume) -> NDArray[np.float64]:
    refined = levels.astype(np.float64)
    for y, x in np.ndindex(levels.shape):
        level = levels[y, x]
        if 0 < level < volume.shape[2] - 1:
            below, here, above = (float(c) for c in volume[y, x, level - 1 : level + 2])
            curve = np.polyfit([-1, 0, 1], [below, here, above], 2)
            if curve[0] > 0 and here <= min(below, above) and not math.isclose(curve[0], 0, abs_tol=1e-12):
                refined[y, x] -= curve[1] / (2 * curve[0])
    return refined

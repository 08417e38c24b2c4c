"""Plain twins of the semi-global matching kernels: one pixel after the other, as they are described."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask
from mvcodec.kernels.semiglobal import PARTS

Costs = NDArray[np.uint8]
Sums = NDArray[np.float32]
Census = NDArray[np.uint64]

# (x, y) steps of the eight paths: four lead right or down, four the opposite way.
FORTH = ((1, 0), (1, 1), (0, 1), (-1, 1))
BACK = ((-1, 0), (-1, -1), (0, -1), (1, -1))


def sampling_interval(picture: NDArray[np.float32], step_x: int, step_y: int) -> NDArray[np.float32]:
    height, width = picture.shape[1:]
    padded = np.pad(picture, ((0, 0), (1, 1), (1, 1)), mode="edge")
    before = padded[:, 1 - step_y : 1 - step_y + height, 1 - step_x : 1 - step_x + width]
    after = padded[:, 1 + step_y : 1 + step_y + height, 1 + step_x : 1 + step_x + width]
    samples = np.stack([picture, (picture + before) / 2, (picture + after) / 2])
    return np.stack([samples.min(axis=0), samples.max(axis=0)])


def pair_cost(
    colours: NDArray[np.float32],
    bits: int,
    bounds: NDArray[np.float32],
    other_bits: int,
    limits: tuple[float, float, float],
) -> int:
    """Of a pixel, colours (3,), against a pixel of a partner, bounds (2, 3)."""
    colour_limit, bit_cost, bit_limit = limits
    below, above = bounds[0] - colours, colours - bounds[1]
    colour = float(np.maximum(np.maximum(below, above), 0).sum())
    structure = (bits ^ other_bits).bit_count() * bit_cost
    return int(min(colour, colour_limit) + min(structure, bit_limit))


def joint_costs(
    picture: NDArray[np.float32],
    census: Census,
    bounds: NDArray[np.float32],
    other_census: Census,
    steps: NDArray[np.float32],
    low: int,
    limits: tuple[float, float, float],
    lone_cost: int,
    outside_cost: int,
    levels: int,
) -> Costs:
    height, width = census.shape
    volume = np.empty((height, width, levels), np.uint8)
    for y, x, level in np.ndindex(volume.shape):
        found = []
        for partner, (by_x, by_y) in enumerate(steps):
            u, v = x - round(float(by_x) * (low + level)), y - round(float(by_y) * (low + level))
            if 0 <= u < width and 0 <= v < height:
                there = bounds[partner, :, :, v, u]
                other_bits = int(other_census[partner, v, u])
                found.append(pair_cost(picture[:, y, x], int(census[y, x]), there, other_bits, limits))
        found.sort()
        if not found:
            volume[y, x, level] = outside_cost
        elif len(steps) == 1:
            volume[y, x, level] = found[0]
        else:
            pair = [(found[0] + found[1]) // 2] if len(found) > 1 else []
            volume[y, x, level] = min([found[0] + lone_cost, 254, *pair])
    return volume


def path_costs(
    costs: Costs,
    grey: FloatMap,
    step: tuple[int, int],
    penalties: tuple[float, float, float, float],
) -> Sums:
    """Equation 13 of Hirschmueller 2008 along one path; penalties: P1, P2, least P2, contrast."""
    small, large, least_large, contrast = penalties
    height, width, levels = costs.shape
    path = np.zeros((height, width, levels))
    by_x, by_y = step
    for y in range(height)[:: 1 if by_y >= 0 else -1]:
        for x in range(width)[:: 1 if by_x >= 0 else -1]:
            path[y, x] = costs[y, x]
            u, v = x - by_x, y - by_y
            if not (0 <= u < width and 0 <= v < height):
                continue
            last = path[v, u]
            difference = abs(float(grey[y, x]) - float(grey[v, u]))
            jump = np.floor(max(large / (1 + difference / contrast), least_large) * PARTS + 0.5) / PARTS
            for level in range(levels):
                ways = [last[level], last.min() + jump]
                ways += [last[beside] + small for beside in (level - 1, level + 1) if 0 <= beside < levels]
                path[y, x, level] += min(ways) - last.min()
    return path.astype(np.float32)


def aggregate(
    costs: Costs,
    grey: FloatMap,
    steps: Sequence[tuple[int, int]],
    penalties: tuple[float, float, float, float],
) -> Sums:
    total = np.zeros(costs.shape, np.float32)
    for step in steps:
        total += path_costs(costs, grey, step, penalties)
    return total


def winners(sums: NDArray[np.uint16], low: int) -> FloatMap:
    levels = sums.shape[2]
    disparity = np.empty(sums.shape[:2], np.float32)
    for y, x in np.ndindex(*disparity.shape):
        here = sums[y, x].astype(float)
        best = int(here.argmin())
        offset = 0.0
        if 0 < best < levels - 1:
            left, right = here[best - 1] - here[best], here[best + 1] - here[best]
            # Two lines of equal slope, that of the steeper side, meet here.
            offset = (left - right) / (2 * max(left, right)) if max(left, right) > 0 else 0.0
        disparity[y, x] = low + best + offset
    return disparity


def seen_at(x: int, y: int, step: NDArray[np.float32], disparity: float) -> tuple[int, int]:
    return round(x - float(step[0]) * disparity), round(y - float(step[1]) * disparity)


def confirmed(
    disparity: FloatMap, others: NDArray[np.float32], steps: NDArray[np.float32], tolerance: float
) -> Mask:
    height, width = disparity.shape
    kept = np.zeros((height, width), np.bool_)
    for y, x in np.ndindex(height, width):
        votes = []
        for other, step in zip(others, steps, strict=True):
            u, v = seen_at(x, y, step, float(disparity[y, x]))
            if 0 <= u < width and 0 <= v < height:
                votes.append(float(other[v, u] - disparity[y, x]))
        agree = sum(abs(vote) <= tolerance for vote in votes)
        through = sum(vote < -tolerance for vote in votes)
        kept[y, x] = agree >= max(through, 1)
    return kept


def completion_costs(
    disparity: FloatMap,
    valid: Mask,
    others: NDArray[np.float32],
    others_valid: Mask,
    steps: NDArray[np.float32],
    low: int,
    slope: float,
    limit: float,
    through_cost: float,
    levels: int,
) -> Costs:
    height, width = disparity.shape
    volume = np.zeros((height, width, levels), np.uint8)
    for y, x, level in np.ndindex(volume.shape):
        d = low + level
        if valid[y, x]:
            volume[y, x, level] = int(min(abs(d - float(disparity[y, x])) * slope, limit))
            continue
        through = 0
        for other, other_valid, step in zip(others, others_valid, steps, strict=True):
            u, v = seen_at(x, y, step, d)
            inside = 0 <= u < width and 0 <= v < height
            through += bool(inside and other_valid[v, u] and other[v, u] < d - 1.5)
        volume[y, x, level] = int(min(through * through_cost, 254))
    return volume

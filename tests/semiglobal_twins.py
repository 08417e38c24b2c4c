"""Plain twins of the semi-global matching kernels: one pixel after the other, as they are described."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask

Bytes = NDArray[np.uint8]
Costs = NDArray[np.uint8]

# (x, y) steps of the eight paths: four lead right or down, four the opposite way.
FORTH = ((1, 0), (1, 1), (0, 1), (-1, 1))
BACK = ((-1, 0), (-1, -1), (0, -1), (1, -1))


def sampling_interval(planes: Bytes, *, along_rows: bool) -> Bytes:
    """(H, C, W) to (H, 2, C, W)."""
    height, _, width = planes.shape
    whole = planes.astype(int)
    padded = np.pad(whole, ((1, 1), (0, 0), (1, 1)), mode="edge")
    before = padded[1 : 1 + height, :, :width] if along_rows else padded[:height, :, 1 : 1 + width]
    after = padded[1 : 1 + height, :, 2:] if along_rows else padded[2:, :, 1 : 1 + width]
    between = np.stack([2 * whole, whole + before, whole + after]) / 2
    least, most = np.floor(between.min(axis=0)), np.ceil(between.max(axis=0))
    return np.stack([least, most], axis=1).astype(np.uint8)


def census_rows(grey: Bytes, radius_x: int, radius_y: int) -> Bytes:
    height, width = grey.shape
    found = np.zeros((height, -(-((2 * radius_x + 1) * (2 * radius_y + 1) - 1) // 8), width), np.uint8)
    for y, x in np.ndindex(height, width):
        place = 0
        for dy in range(-radius_y, radius_y + 1):
            for dx in range(-radius_x, radius_x + 1):
                if (dx, dy) != (0, 0):
                    there = grey[min(max(y + dy, 0), height - 1), min(max(x + dx, 0), width - 1)]
                    found[y, place // 8, x] |= int(there < grey[y, x]) << place % 8
                    place += 1
    return found


def pair_cost(
    here: Bytes, bits: Bytes, bounds: Bytes, other_bits: Bytes, limits: tuple[int, int, int]
) -> int:
    """Of a pixel (C,) with its census (B,) against one of a partner, bounds (2, C) and census (B,)."""
    colour_limit, bit_cost, most_bits = limits
    least, most = bounds.astype(int)
    beyond = np.maximum(np.maximum(here - most, least - here.astype(int)), 0)
    colour = min(int(beyond.sum()), 255) // 2
    distance = sum(int(a ^ b).bit_count() for a, b in zip(bits, other_bits, strict=True))
    return min(colour, colour_limit) + min(distance, most_bits) * bit_cost


def joint_costs(
    planes: Bytes,
    census: Bytes,
    bounds: Bytes,
    blind: Bytes,
    across: NDArray[np.bool_],
    steps: NDArray[np.float32],
    low: int,
    limits: tuple[int, int, int],
    lone_cost: int,
    outside_cost: int,
    levels: int,
) -> Costs:
    """Of camera 0 against all others, which are its partners in turn: (H, W, levels)."""
    height, width = planes.shape[1], planes.shape[3]
    volume = np.empty((height, width, levels), np.uint8)
    for y, x, level in np.ndindex(volume.shape):
        plain, found = [], []
        for partner, (by_x, by_y) in enumerate(steps, 1):
            u, v = x - round(float(by_x) * (low + level)), y - round(float(by_y) * (low + level))
            if 0 <= u < width and 0 <= v < height:
                side = 0 if across[partner - 1] else 1
                interval, there = bounds[side, partner, v, :, :, u], census[partner, v, :, u]
                plain.append(pair_cost(planes[0, y, :, x], census[0, y, :, x], interval, there, limits))
                found.append(plain[-1] + int(blind[side, y, x]))
        found.sort()
        if not found:
            volume[y, x, level] = outside_cost
            continue
        alone = lone_cost if len(steps) > 1 else 0
        other = (found[0] + found[1] + 1) // 2 if len(found) > 1 else plain[0] + alone + 10
        volume[y, x, level] = min(found[0] + alone, other)
    return volume


def path_costs(
    costs: Costs, grey: Bytes, jumps: Bytes, small: int, step: tuple[int, int]
) -> NDArray[np.int64]:
    """Equation 13 of Hirschmueller 2008 along one path of an (H, W, levels) volume."""
    height, width, levels = costs.shape
    path = np.zeros((height, width, levels), np.int64)
    by_x, by_y = step
    for y in range(height)[:: 1 if by_y >= 0 else -1]:
        for x in range(width)[:: 1 if by_x >= 0 else -1]:
            path[y, x] = costs[y, x]
            u, v = x - by_x, y - by_y
            if not (0 <= u < width and 0 <= v < height):
                continue
            last = path[v, u]
            jump = int(jumps[abs(int(grey[y, x]) - int(grey[v, u]))])
            for level in range(levels):
                ways = [last[level], last.min() + jump]
                ways += [last[beside] + small for beside in (level - 1, level + 1) if 0 <= beside < levels]
                path[y, x, level] += min(ways) - last.min()
    return path


def added_up(
    costs: Costs, grey: Bytes, jumps: Bytes, small: int, steps: Sequence[tuple[int, int]]
) -> NDArray[np.uint16]:
    paths = [path_costs(costs, grey, jumps, small, step) for step in steps]
    return np.asarray(np.sum(paths, axis=0), np.uint16)


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


def decided_sums(
    costs: Costs,
    grey: Bytes,
    jumps: Bytes,
    small: int,
    steps: Sequence[tuple[int, int]],
    band: int,
    ahead: int,
) -> NDArray[np.uint16]:
    """Bands of rows, each as if the picture ended `ahead` rows below it."""
    sums = np.empty(costs.shape, np.uint16)
    for start in range(0, len(costs), band):
        stop = start + band
        cut = slice(0, stop + ahead)
        sums[start:stop] = added_up(costs[cut], grey[cut], jumps, small, steps)[start:stop]
    return sums


def partner_winners(sums: NDArray[np.uint16], low: int, step: tuple[float, float]) -> FloatMap:
    height, width, levels = sums.shape
    least = np.full((height, width), 65535)
    disparity = np.full((height, width), np.inf, np.float32)
    for y in range(height):
        for level in range(levels):
            for x in range(width):
                u, v = x - round(step[0] * (low + level)), y - round(step[1] * (low + level))
                found = sums[y, x, level], low + level
                if 0 <= u < width and 0 <= v < height and found < (least[v, u], disparity[v, u]):
                    least[v, u], disparity[v, u] = found
    return disparity


def seen_at(x: int, y: int, step: NDArray[np.float32], disparity: float) -> tuple[int, int]:
    return round(x - float(step[0]) * disparity), round(y - float(step[1]) * disparity)


def confirmed(
    disparity: FloatMap,
    asked: Mask,
    others: NDArray[np.float32],
    steps: NDArray[np.float32],
    tolerance: float,
) -> Mask:
    height, width = disparity.shape
    kept = np.zeros((height, width), np.bool_)
    for y, x in zip(*np.nonzero(asked), strict=True):
        votes = []
        for other, step in zip(others, steps, strict=True):
            u, v = seen_at(x, y, step, float(disparity[y, x]))
            if 0 <= u < width and 0 <= v < height:
                votes.append(float(other[v, u] - disparity[y, x]))
        agree = sum(abs(vote) <= tolerance for vote in votes)
        through = sum(vote < -tolerance for vote in votes)
        kept[y, x] = agree >= max(through, 1)
    return kept


def seen_through(
    disparity: FloatMap,
    asked: Mask,
    others: NDArray[np.float32],
    sure: NDArray[np.bool_],
    steps: NDArray[np.float32],
    farther: float,
) -> Mask:
    height, width = disparity.shape
    found = np.zeros((height, width), np.bool_)
    for y, x in zip(*np.nonzero(asked), strict=True):
        for other, known, step in zip(others, sure, steps, strict=True):
            u, v = seen_at(x, y, step, float(disparity[y, x]))
            if 0 <= u < width and 0 <= v < height and known[v, u]:
                found[y, x] |= other[v, u] < disparity[y, x] - farther
    return found


def completion_costs(
    disparity: NDArray[np.int16],
    valid: Mask,
    others: NDArray[np.int16],
    steps: NDArray[np.float32],
    low: int,
    slope: float,
    limit: int,
    through_cost: int,
    most: int,
    levels: int,
) -> Costs:
    height, width = disparity.shape
    per_part = int(slope * 128 / 16 + 0.5)
    volume = np.zeros((height, width, levels), np.uint8)
    for y, x, level in np.ndindex(volume.shape):
        d = low + level
        if valid[y, x]:
            volume[y, x, level] = min(abs(16 * d - int(disparity[y, x])) * per_part // 128, limit, most)
            continue
        through = 0
        for other, step in zip(others, steps, strict=True):
            u, v = x - round(float(step[0]) * d), y - round(float(step[1]) * d)
            inside = 0 <= u < width and 0 <= v < height
            through += bool(inside and other[v, u] < 16 * d - 24)
        volume[y, x, level] = min(through * through_cost, most)
    return volume

"""Semi-global matching of one camera against all its partners at once (Hirschmueller 2008).

A volume is (H, W, levels): the cost of disparity low + level at each pixel of the camera. Level loops
are innermost and free of branches, so that they run on vectors.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.census import hamming

FloatMap = NDArray[np.float32]
Mask = NDArray[np.bool_]
CostVolume = NDArray[np.uint8]
SumVolume = NDArray[np.uint16]

OUTSIDE = np.uint8(255)
MAX_COST = 254

PARTS_BITS = 3
PARTS = 1 << PARTS_BITS
"""Sums count eighths of a grey level; so eight paths of MAX_COST + MAX_PENALTY still fit into 16 bits."""
MAX_PENALTY = 600
BEYOND = np.uint16(60000)
"""Stands beside the first and the last level: more than any path costs, and with a penalty no overflow."""


@njit(cache=True, nogil=True)
def sampling_interval(picture: NDArray[np.float32], step_x: int, step_y: int) -> NDArray[np.float32]:
    """Least and greatest value within half a pixel either way (Birchfield and Tomasi 1998).

    Args:
        picture: float32 (3, H, W).
        step_x, step_y: 1 along the baseline, 0 across it.

    Returns:
        float32 (2, 3, H, W): least, greatest.
    """
    _, height, width = picture.shape
    bounds = np.empty((2, 3, height, width), np.float32)
    for channel in range(3):
        plane = picture[channel]
        for y in range(height):
            above, below = max(y - step_y, 0), min(y + step_y, height - 1)
            for x in range(width):
                here = plane[y, x]
                before = np.float32(0.5) * (here + plane[above, max(x - step_x, 0)])
                after = np.float32(0.5) * (here + plane[below, min(x + step_x, width - 1)])
                bounds[0, channel, y, x] = min(here, min(before, after))
                bounds[1, channel, y, x] = max(here, max(before, after))
    return bounds


@njit(cache=True, nogil=True)
def _pair_row(  # type: ignore[no-untyped-def]
    y, picture, census, bounds, other_census, by_x, by_y, low, colour_limit, bit_cost, bit_limit, costs
):
    """Costs (levels, W) of one row against one partner; OUTSIDE where the partner's picture ends."""
    _, height, width = picture.shape
    red, green, blue = picture[0, y], picture[1, y], picture[2, y]
    zero = np.float32(0)
    for level in range(costs.shape[0]):
        line = costs[level]
        line[:] = OUTSIDE
        left = int(np.rint(by_x * (low + level)))
        row = y - int(np.rint(by_y * (low + level)))
        if row < 0 or row >= height:
            continue
        first, last = max(left, 0), min(width + left, width)
        count = last - first
        if count <= 0:
            continue
        there = slice(first - left, last - left)
        least_red, most_red = bounds[0, 0, row, there], bounds[1, 0, row, there]
        least_green, most_green = bounds[0, 1, row, there], bounds[1, 1, row, there]
        least_blue, most_blue = bounds[0, 2, row, there], bounds[1, 2, row, there]
        bits, other_bits = census[y, first:last], other_census[row, there]
        here_red, here_green, here_blue = red[first:last], green[first:last], blue[first:last]
        part = line[first:last]
        for x in range(count):
            colour = max(max(here_red[x] - most_red[x], least_red[x] - here_red[x]), zero)
            colour += max(max(here_green[x] - most_green[x], least_green[x] - here_green[x]), zero)
            colour += max(max(here_blue[x] - most_blue[x], least_blue[x] - here_blue[x]), zero)
            structure = min(bit_cost * np.float32(hamming(bits[x], other_bits[x])), bit_limit)
            part[x] = np.uint8(min(colour, colour_limit) + structure)


@njit(cache=True, nogil=True)
def joint_costs(
    picture: NDArray[np.float32],
    census: NDArray[np.uint64],
    bounds: NDArray[np.float32],
    other_census: NDArray[np.uint64],
    steps: NDArray[np.float32],
    low: int,
    colour_limit: float,
    bit_cost: float,
    bit_limit: float,
    lone_cost: int,
    outside_cost: int,
    volume: CostVolume,
) -> None:
    """Costs of one camera against its P partners.

    Against each: colour difference insensitive to sampling, summed over channels and truncated, plus
    truncated census distance. The two best partners count, half each; where one is hidden from the
    other, the better alone, `lone_cost` dearer.

    Args:
        picture: float32 (3, H, W); census: uint64 (H, W).
        bounds: float32 (P, 2, 3, H, W), see `sampling_interval`; other_census: uint64 (P, H, W).
        steps: float32 (P, 2): a pixel of disparity d is at (x - steps[p, 0] * d, y - steps[p, 1] * d)
            of partner p; rounded.
        low: disparity of level 0, px.
        outside_cost: where no partner's picture holds the pixel.
        volume: uint8 (H, W, levels), written.
    """
    height, width, levels = volume.shape
    partners = len(steps)
    rows = np.empty((partners, levels, width), np.uint8)
    best = np.empty((levels, width), np.uint8)
    for y in range(height):
        for p in range(partners):
            _pair_row(
                y,
                picture,
                census,
                bounds[p],
                other_census[p],
                steps[p, 0],
                steps[p, 1],
                low,
                np.float32(colour_limit),
                np.float32(bit_cost),
                np.float32(bit_limit),
                rows[p],
            )
        for level in range(levels):
            for x in range(width):
                least, second = OUTSIDE, OUTSIDE
                for p in range(partners):
                    cost = rows[p, level, x]
                    second = min(second, max(least, cost))
                    least = min(least, cost)
                if least == OUTSIDE:
                    best[level, x] = outside_cost
                elif partners == 1:
                    best[level, x] = least
                elif second == OUTSIDE:
                    best[level, x] = np.uint8(min(int(least) + lone_cost, MAX_COST))
                else:
                    alone, both = int(least) + lone_cost, (int(least) + int(second)) // 2
                    best[level, x] = np.uint8(min(alone, both, MAX_COST))
        for x in range(width):
            for level in range(levels):
                volume[y, x, level] = best[level, x]


@njit(cache=True, nogil=True)
def _follow(costs, before, least_before, small, jump, path, sums, fresh):  # type: ignore[no-untyped-def]
    """One pixel of one path (equation 13 of Hirschmueller 2008); its least cost. All but `costs` in PARTS.

    `before` and `path` have one place more at either end, which holds BEYOND. 16 bits throughout: twice as
    many levels fit into a vector as with 32.
    """
    levels = len(costs)
    highest = np.uint16(least_before + jump)
    for level in range(levels):
        beside = np.uint16(min(before[level], before[level + 2]) + small)
        way = np.uint16(min(min(before[level + 1], beside), highest) - least_before)
        cost = np.uint16(way + np.uint16(costs[level] << np.uint8(PARTS_BITS)))
        path[level + 1] = cost
        sums[level] = cost if fresh else np.uint16(sums[level] + cost)
    least = BEYOND
    for level in range(levels):
        least = min(least, path[level + 1])
    return least


@njit(cache=True, nogil=True, inline="always")
def _jump_cost(large, least_large, contrast_px, difference):  # type: ignore[no-untyped-def]
    """Cost of a jump between two pixels: less where the picture has an edge too."""
    return np.uint16(
        max(large / (np.float32(1) + abs(difference) / contrast_px), least_large) + np.float32(0.5)
    )


@njit(cache=True, nogil=True)
def aggregate(
    costs: CostVolume,
    grey: FloatMap,
    small: float,
    large: float,
    least_large: float,
    contrast: float,
    sums: SumVolume,
    downwards: bool,
) -> None:
    """Sum costs along four of the eight paths: those that come from above (or all the opposite ones).

    Args:
        costs: uint8 (H, W, levels), at most MAX_COST.
        grey: float32 (H, W), of the camera.
        small: penalty of a step of one level (P1); large: of a jump (P2), lessened to `least_large` where
            the picture steps by much more than `contrast` grey levels; all in 0..MAX_PENALTY.
        sums: uint16 (H, W, levels), PARTS of a grey level; overwritten when `downwards`, else added to.
    """
    height, width, levels = costs.shape
    p1, free = np.uint16(small * PARTS + 0.5), np.uint16(0)
    p2, p2_least, soft = np.float32(large * PARTS), np.float32(least_large * PARTS), np.float32(contrast)
    rows = np.full((2, 3, width, levels + 2), BEYOND, np.uint16)
    least = np.zeros((2, 3, width), np.uint16)
    line = np.full((2, levels + 2), BEYOND, np.uint16)
    nothing = np.zeros(levels + 2, np.uint16)
    step = 1 if downwards else -1
    row_order = range(height) if downwards else range(height - 1, -1, -1)
    now = 0
    for y in row_order:
        now = 1 - now
        begins = y == (0 if downwards else height - 1)
        at, least_on_line = 0, free
        for i in range(width):
            x = i if downwards else width - 1 - i
            here, total = costs[y, x], sums[y, x]
            at = 1 - at
            if i == 0:
                least_on_line = _follow(here, nothing, free, p1, free, line[at], total, downwards)
            else:
                jump = _jump_cost(p2, p2_least, soft, grey[y, x] - grey[y, x - step])
                least_on_line = _follow(
                    here, line[1 - at], least_on_line, p1, jump, line[at], total, downwards
                )
            for k in range(3):
                u = x + k - 1
                if begins or u < 0 or u >= width:
                    least[now, k, x] = _follow(here, nothing, free, p1, free, rows[now, k, x], total, False)
                else:
                    jump = _jump_cost(p2, p2_least, soft, grey[y, x] - grey[y - step, u])
                    least[now, k, x] = _follow(
                        here,
                        rows[1 - now, k, u],
                        least[1 - now, k, u],
                        p1,
                        jump,
                        rows[now, k, x],
                        total,
                        False,
                    )


@njit(cache=True, nogil=True)
def winners(sums: SumVolume, low: int, disparity: FloatMap) -> None:
    """Least sum of each pixel, sub-pixel by fitting two lines of equal slope (Shimizu and Okutomi 2001).

    Args:
        sums: uint16 (H, W, levels), see `aggregate`.
        low: disparity of level 0, px.
        disparity: float32 (H, W), px, overwritten.
    """
    height, width, levels = sums.shape
    for y in range(height):
        for x in range(width):
            here = sums[y, x]
            least = here[0]
            for level in range(levels):
                least = min(least, here[level])
            best = 0
            while here[best] > least:
                best += 1
            offset = np.float32(0)
            if 0 < best < levels - 1:
                before, after = np.float32(here[best - 1] - least), np.float32(here[best + 1] - least)
                if before + after > 0:
                    offset = np.float32(0.5) * (before - after) / max(before, after)
            disparity[y, x] = np.float32(low + best) + offset

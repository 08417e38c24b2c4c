"""What it costs that a pixel of one camera shows the same as pixels of its partners.

Rows of pixels are the innermost loops, in 8 bits and free of branches.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.census import count_bits

Bytes = NDArray[np.uint8]
Volume = NDArray[np.uint8]

OUTSIDE = np.uint8(255)
"""Marks where a partner's picture ends."""


@njit(cache=True, nogil=True)
def sampling_interval(planes: Bytes, along_rows: bool, bounds: Bytes) -> None:
    """Least and greatest value within half a pixel either way (Birchfield and Tomasi 1998).

    Args:
        planes: uint8 (H, C, W).
        along_rows: whether the baseline is horizontal, else vertical.
        bounds: uint8 (H, 2, C, W), written: least, rounded down, and greatest, rounded up.
    """
    height, channels, width = planes.shape
    before, after = np.empty(width, np.uint8), np.empty(width, np.uint8)
    for y in range(height):
        for channel in range(channels):
            here = planes[y, channel]
            if not along_rows:
                before[:], after[:] = planes[max(y - 1, 0), channel], planes[min(y + 1, height - 1), channel]
            else:
                before[0], after[width - 1] = here[0], here[width - 1]
                before[1:], after[:-1] = here[:-1], here[1:]
            least, greatest = bounds[y, 0, channel], bounds[y, 1, channel]
            for x in range(width):
                one = np.uint16(np.uint16(here[x]) + np.uint16(before[x]))
                two = np.uint16(np.uint16(here[x]) + np.uint16(after[x]))
                low, high = np.uint8(min(one, two) >> 1), np.uint8((max(one, two) + 1) >> 1)
                least[x] = min(low, here[x])
                greatest[x] = max(high, here[x])


@njit(cache=True, nogil=True)
def _add_colour(planes, here, bounds, least, most, count, difference):  # type: ignore[no-untyped-def]
    """Add how far a channel is outside of its interval; what is beyond 255 is cut off."""
    for x in range(count):
        value = planes[here + x]
        above = np.uint8(max(value, bounds[most + x]) - bounds[most + x])
        below = np.uint8(max(bounds[least + x], value) - value)
        room = np.uint8(np.uint8(255) - difference[x])
        difference[x] = np.uint8(difference[x] + min(max(above, below), room))


@njit(cache=True, nogil=True)
def _add_bits(census, here, other, there, count, bits):  # type: ignore[no-untyped-def]
    for x in range(count):
        bits[x] = np.uint8(bits[x] + count_bits(census[here + x] ^ other[there + x]))


@njit(cache=True, nogil=True)
def _combine(difference, bits, limits, first, count, least, second):  # type: ignore[no-untyped-def]
    """The two least costs of each pixel, with one partner more."""
    colour_limit, bit_cost, most_bits = limits
    for x in range(count):
        colour = min(np.uint8(difference[x] >> np.uint8(1)), colour_limit)
        cost = np.uint8(colour + np.uint8(min(bits[x], most_bits) * bit_cost))
        second[first + x] = min(second[first + x], max(least[first + x], cost))
        least[first + x] = min(least[first + x], cost)


@njit(cache=True, nogil=True)
def _decide(least, second, several, lone_cost, outside_cost, costs):  # type: ignore[no-untyped-def]
    """Both partners' mean, or the better alone."""
    for x in range(least.size):
        alone = np.uint8(least[x] + lone_cost) if several else least[x]
        both = np.uint8((np.uint16(least[x]) + np.uint16(second[x])) >> np.uint16(1))
        cost = alone if second[x] == OUTSIDE else min(alone, both)
        costs[x] = outside_cost if least[x] == OUTSIDE else cost


@njit(cache=True, nogil=True)
def joint_costs(
    camera: int,
    partners: NDArray[np.int64],
    planes: Bytes,
    census: Bytes,
    across: NDArray[np.bool_],
    bounds: Bytes,
    steps: NDArray[np.float32],
    low: int,
    colour_limit: int,
    bit_cost: int,
    most_bits: int,
    lone_cost: int,
    outside_cost: int,
    start: int,
    volume: Volume,
) -> None:
    """Costs of one of N cameras against its P partners, in units of two grey levels.

    Against each: colour difference insensitive to sampling, summed over channels and truncated, plus
    truncated census distance. The two best partners count, half each; where one is hidden from the
    other, the better alone, `lone_cost` dearer.

    Args:
        camera, partners: which of the N cameras they are; int64 (P,).
        planes: uint8 (N, H, C, W); census: uint8 (N, H, B, W), see `census.census_rows`.
        across: bool (P,), whether a partner stands beside the camera, else above or below it.
        bounds: uint8 (2, N, H, 2, C, W), see `sampling_interval`; first those along rows, then along columns.
        steps: float32 (P, 2): a pixel of disparity d is at (x - steps[p, 0] * d, y - steps[p, 1] * d)
            of partner p; rounded.
        low: disparity of level 0, px.
        colour_limit: most that colour counts; bit_cost: of each bit of the census, of which `most_bits` count
            at most. colour_limit + bit_cost * most_bits + lone_cost is below OUTSIDE.
        outside_cost: where no partner's picture holds the pixel.
        volume: uint8 (R, levels, W), written: of a band of rows; start: its first row.
    """
    _, height, channels, width = planes.shape
    levels, words = volume.shape[1], census.shape[2]
    limits = np.uint8(colour_limit), np.uint8(bit_cost), np.uint8(most_bits)
    least, second = np.empty((2, levels, width), np.uint8)
    difference, bits = np.empty(width, np.uint8), np.empty(width, np.uint8)
    # Flat arrays by unsigned indexes: slices would take longer to make than rows take to compare.
    flat_planes, flat_census = planes[camera].reshape(-1), census[camera].reshape(-1)
    for at in range(len(volume)):
        y = start + at
        least[:], second[:] = OUTSIDE, OUTSIDE
        # Levels in turn, so that loops are of nearly the same length as the ones before.
        for p in range(len(steps)):
            interval = bounds[0 if across[p] else 1, partners[p]].reshape(-1)
            other = census[partners[p]].reshape(-1)
            for level in range(levels):
                left = int(np.rint(steps[p, 0] * (low + level)))
                row = y - int(np.rint(steps[p, 1] * (low + level)))
                first, last = max(left, 0), min(width + left, width)
                if row < 0 or row >= height or last <= first:
                    continue
                count, begin = np.uint64(last - first), first - left
                difference[:], bits[:] = 0, 0
                for c in range(channels):
                    here = np.uint64((y * channels + c) * width + first)
                    least_there = np.uint64((row * 2 * channels + c) * width + begin)
                    most_there = np.uint64((row * 2 * channels + channels + c) * width + begin)
                    _add_colour(flat_planes, here, interval, least_there, most_there, count, difference)
                for w in range(words):
                    here = np.uint64((y * words + w) * width + first)
                    there = np.uint64((row * words + w) * width + begin)
                    _add_bits(flat_census, here, other, there, count, bits)
                _combine(difference, bits, limits, np.uint64(first), count, least[level], second[level])
        for level in range(levels):
            _decide(
                least[level],
                second[level],
                len(steps) > 1,
                np.uint8(lone_cost),
                np.uint8(outside_cost),
                volume[at, level],
            )

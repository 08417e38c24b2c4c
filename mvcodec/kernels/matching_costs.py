"""What it costs that a pixel of one camera shows the same as pixels of its partners.

Pixels are compared 64 at a time, in 8 bits and without branches.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.byte_vectors import (
    LANES,
    bits,
    choose,
    differing,
    fill,
    halved,
    least,
    load,
    mean,
    minus,
    minus_down_to_0,
    most,
    plus,
    plus_up_to_255,
    store,
    times,
)

Bytes = NDArray[np.uint8]
Volume = NDArray[np.uint8]

OUTSIDE = np.uint8(255)
"""Marks where a partner's picture ends."""

ONLY_BLIND_COST = 10
"""The most that counts of `blind` where one partner alone holds the pixel."""


@njit(cache=True, nogil=True)
def _interval(here, before, after, down, up, x):  # type: ignore[no-untyped-def]
    """Of 64 pixels of a row: half way to each neighbour, rounded down and rounded up."""
    near, far = least(before, after), most(before, after)
    # What is rounded down is the sum less what is rounded up, also where the sum is beyond 8 bits.
    store(down, x, least(minus(plus(here, near), mean(here, near)), here))
    store(up, x, most(mean(here, far), here))


@njit(cache=True, nogil=True)
def sampling_interval(planes: Bytes, along_rows: bool, bounds: Bytes) -> None:
    """Least and greatest value within half a pixel either way (Birchfield and Tomasi 1998).

    Args:
        planes: uint8 (H, C, W).
        along_rows: whether the baseline is horizontal, else vertical.
        bounds: uint8 (H, 2, C, W), written: least, rounded down, and greatest, rounded up.
    """
    height, channels, width = planes.shape
    # Rows are copied by loops, and to room for whole vectors: assigning slices costs more than all the rest.
    room = max(width, LANES)
    wide = np.zeros(room + 2, np.uint8)
    above, below = np.zeros(room, np.uint8), np.zeros(room, np.uint8)
    down, up = np.empty(room, np.uint8), np.empty(room, np.uint8)
    one, two = np.uint64(1), np.uint64(2)
    for y in range(height):
        for channel in range(channels):
            here = planes[y, channel]
            over, under = planes[max(y - 1, 0), channel], planes[min(y + 1, height - 1), channel]
            for x in range(width):
                wide[x + 1], above[x], below[x] = here[x], over[x], under[x]
            wide[0], wide[width + 1] = here[0], here[width - 1]
            for start in range(0, room, LANES):
                at = np.uint64(min(start, room - LANES))  # the last vector overlaps the one before it
                if along_rows:
                    _interval(load(wide, at + one), load(wide, at), load(wide, at + two), down, up, at)
                else:
                    _interval(load(wide, at + one), load(above, at), load(below, at), down, up, at)
            low, high = bounds[y, 0, channel], bounds[y, 1, channel]
            for x in range(width):
                low[x], high[x] = down[x], up[x]


@njit(cache=True, nogil=True)
def _difference(planes, here, bounds, there, channels, stride):  # type: ignore[no-untyped-def]
    """How far 64 pixels are outside of a partner's intervals, summed over channels; 255 at most."""
    difference = fill(np.uint8(0))
    for _ in range(channels):
        value = load(planes, here)
        above = minus_down_to_0(value, load(bounds, np.uint64(there + channels * stride)))
        below = minus_down_to_0(load(bounds, there), value)
        difference = plus_up_to_255(difference, most(above, below))
        here, there = np.uint64(here + stride), np.uint64(there + stride)
    return difference


@njit(cache=True, nogil=True)
def _distance(census, here, other, there, words, stride):  # type: ignore[no-untyped-def]
    """How many bits of the census of 64 pixels differ."""
    distance = fill(np.uint8(0))
    for _ in range(words):
        distance = plus(distance, bits(differing(load(census, here), load(other, there))))
        here, there = np.uint64(here + stride), np.uint64(there + stride)
    return distance


@njit(cache=True, nogil=True)
def joint_costs(
    camera: int,
    partners: NDArray[np.int64],
    planes: Bytes,
    census: Bytes,
    across: NDArray[np.bool_],
    bounds: Bytes,
    blind: Bytes,
    width: int,
    steps: NDArray[np.float32],
    low: int,
    colour_limit: int,
    bit_cost: int,
    most_bits: int,
    lone_cost: int,
    outside_cost: int,
    places: NDArray[np.int64],
    volume: Volume,
) -> None:
    """Costs of one of N cameras against its P partners, in units of two grey levels.

    Against each: colour difference insensitive to sampling, summed over channels and truncated, plus
    truncated census distance. The two best partners count, half each; where one is hidden from the
    other, the better alone, `lone_cost` dearer.

    Args:
        camera, partners: which of the N cameras they are; int64 (P,).
        planes: uint8 (N, H, C, W''); census: uint8 (N, H, B, W''), see `census.census_rows`. Rows stand
            between LANES columns on either side that do not count: W'' = LANES + W' + LANES.
        across: bool (P,), whether a partner stands beside the camera, else above or below it.
        bounds: uint8 (2, N, H, 2, C, W''), see `sampling_interval`; first those along rows, then those
            along columns.
        blind: uint8 (2, H, W''), what a pixel's match costs more against partners along rows, and along
            columns, see `mvcodec.stereo.matching_view.blindness`.
        width: W, of the pictures.
        steps: float32 (P, 2): a pixel of disparity d is at (x - steps[p, 0] * d, y - steps[p, 1] * d)
            of partner p; rounded.
        low: disparity of level 0, px.
        colour_limit: most that colour counts; bit_cost: of each bit of the census, of which `most_bits` count
            at most. colour_limit + bit_cost * most_bits + lone_cost is below OUTSIDE.
        outside_cost: where no partner's picture holds the pixel.
        places: int64 (V, 2), the row and the column of the picture where each vector of LANES columns of the
            volume begins. All its rows are in the picture, and its first column.
        volume: uint8 (R, levels, V * LANES), written: of a band of rows, or of windows side by side.
    """
    _, height, channels, padded = planes.shape
    levels, words, columns = volume.shape[1], np.uint64(census.shape[2]), volume.shape[2]
    stride, plane_count = np.uint64(padded), np.uint64(channels)
    zero, nowhere = fill(np.uint8(0)), fill(OUTSIDE)
    limit, most_distance = fill(np.uint8(colour_limit)), fill(np.uint8(most_bits))
    each_bit = fill(np.uint8(bit_cost))
    alone = fill(np.uint8(lone_cost)) if len(steps) > 1 else zero
    only_cost = plus(alone, fill(np.uint8(ONLY_BLIND_COST)))
    outside = np.full(padded, OUTSIDE, np.uint8)
    outside[LANES : LANES + width] = 0
    left, up = np.empty((2, len(steps), levels), np.int64)
    for p in range(len(steps)):
        for level in range(levels):
            left[p, level] = int(np.rint(steps[p, 0] * (low + level)))
            up[p, level] = int(np.rint(steps[p, 1] * (low + level)))
    sides = np.array([0 if along else 1 for along in across])
    flat_planes, flat_census, flat_bounds = planes.reshape(-1), census.reshape(-1), bounds.reshape(-1)
    flat, flat_blind = volume.reshape(-1), blind.reshape(-1)
    for at in range(len(volume)):
        for v in range(len(places)):
            y, x = places[v, 0] + at, places[v, 1]
            plane_here = np.uint64(((camera * height + y) * channels) * padded + LANES + x)
            census_here = np.uint64((camera * height + y) * census.shape[2] * padded + LANES + x)
            for level in range(levels):
                best, second, plain = nowhere, nowhere, nowhere
                for p in range(len(steps)):
                    row, column = y - up[p, level], x - left[p, level]
                    if row < 0 or row >= height or column <= -LANES or column >= width:
                        continue
                    begin = LANES + column
                    there = (sides[p] * len(planes) + partners[p]) * height + row
                    plane_there = np.uint64(there * 2 * channels * padded + begin)
                    difference = _difference(
                        flat_planes, plane_here, flat_bounds, plane_there, plane_count, stride
                    )
                    census_there = np.uint64((partners[p] * height + row) * census.shape[2] * padded + begin)
                    distance = _distance(flat_census, census_here, flat_census, census_there, words, stride)
                    distance = times(least(distance, most_distance), each_bit)
                    cost = plus(least(halved(difference), limit), distance)
                    plain = least(plain, most(cost, load(outside, np.uint64(begin))))
                    blind_here = np.uint64((sides[p] * height + y) * padded + LANES + x)
                    cost = plus(cost, load(flat_blind, blind_here))
                    cost = most(cost, load(outside, np.uint64(begin)))
                    second = least(second, most(best, cost))
                    best = least(best, cost)
                lone = plus(best, alone)
                # One partner alone holds the pixel: what it tells is all there is.
                only = least(lone, plus(plain, only_cost))
                cost = choose(second, nowhere, only, least(lone, mean(best, second)))
                cost = choose(best, nowhere, fill(np.uint8(outside_cost)), cost)
                store(flat, np.uint64((at * levels + level) * columns + v * LANES), cost)

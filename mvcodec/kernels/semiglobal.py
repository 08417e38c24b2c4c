"""Semi-global matching of one camera against all its partners at once (Hirschmueller 2008).

A volume is (H, levels, W'): the cost of disparity low + level at each pixel of the camera; W' is the width,
rounded up to whole vectors. A vector holds many pixels of a row, in 8 bits, and goes through all levels in
turn, so that what lies below and above is in registers: paths from row to row do so with the pixels of a
row, and paths along rows on turned bands of rows.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.byte_vectors import LANES, fill, least, load, minus, plus, plus_up_to_255, store, widen

Bytes = NDArray[np.uint8]
FloatMap = NDArray[np.float32]
Volume = NDArray[np.uint8]
SumVolume = NDArray[np.uint16]
SumMap = NDArray[np.uint16]

MAX_SUM = 255
"""Most that a cost, a jump (P2) and a small step (P1) may add up to: a path of 8 bits holds no more."""


@njit(cache=True, nogil=True)
def _follow(costs, at, stride, rows, there, here, row, levels, least_before, jump, small):  # type: ignore[no-untyped-def]
    """64 pixels of one path (equation 13 of Hirschmueller 2008); returns their least costs.

    Args:
        costs: flat; at, stride: where the costs of level 0 are, and how far the next level's are.
        rows: flat; there: where level 0 of where the path comes from is in it; here: where level 0 goes to,
            the same place or another row; row: how far apart levels are.
        least_before, jump, small: vectors: the least costs where the path comes from, and penalties of a
            jump and of a step of one level. Where a path begins, no jump costs anything.
    """
    highest = plus(least_before, jump)
    lower, same = load(rows, np.uint64(there - row)), load(rows, there)
    found_least = fill(np.uint8(MAX_SUM))
    for _ in range(levels):
        there = np.uint64(there + row)
        upper = load(rows, there)
        beside = plus_up_to_255(least(lower, upper), small)
        way = minus(least(least(same, beside), highest), least_before)
        found = plus(way, load(costs, at))
        store(rows, here, found)
        found_least = least(found_least, found)
        lower, same = same, upper
        here, at = np.uint64(here + row), np.uint64(at + stride)
    return found_least


def path_size(levels: int, width: int) -> int:
    """Bytes that a path's row takes: all levels and one beside either end of them.

    Levels are an odd number of vectors apart, for caches to hold them all, with LANES columns before each.
    """
    return (levels + 2) * _apart(width) + LANES


@njit(cache=True, nogil=True)
def _apart(width: int) -> int:
    vectors = width // LANES + 1
    return int((vectors + 1 - vectors % 2) * LANES)


@njit(cache=True, nogil=True)
def _advance(costs, at, row_jumps, upwards, rows, least_costs, now, small, x):  # type: ignore[no-untyped-def]
    """All paths of 64 pixels from one row to the next.

    Args:
        costs: flat; at: where the row's begin; x: the first of the pixels.
        row_jumps: uint8 (paths, LANES + W' + LANES), see `sum_downwards`, of the step to this row.
        rows, least_costs: see `sum_downwards`; now: which of the two is this row.
    """
    _, paths, size = rows.shape
    width = least_costs.shape[2] - 2 * LANES
    flat, row, stride = rows.reshape(-1), np.uint64(_apart(width)), np.uint64(width)
    levels = np.uint64(np.uint64(size - LANES) // row - np.uint64(2))
    lanes = np.uint64(LANES)
    for k in range(paths):
        shift = k - 1 if paths == 3 else 0
        beside = np.uint64(x + np.uint64(LANES + shift))
        # Upwards the step is the one that leads downwards the other way round.
        jump = load(row_jumps[paths - 1 - k], beside) if upwards else load(row_jumps[k], np.uint64(x + lanes))
        found = _follow(
            costs,
            np.uint64(at + x),
            stride,
            flat,
            np.uint64(np.uint64(((1 - now) * paths + k) * size) + row + beside),
            np.uint64(np.uint64((now * paths + k) * size) + row + lanes + x),
            row,
            levels,
            load(least_costs[1 - now, k], beside),
            jump,
            fill(np.uint8(small)),
        )
        store(least_costs[now, k], np.uint64(x + lanes), found)


@njit(cache=True, nogil=True)
def _paths_there(rows, here, apart, several):  # type: ignore[no-untyped-def]
    """The sum of the paths of 64 pixels at one level."""
    total = widen(load(rows, here))
    if several:
        total = plus(total, widen(load(rows, np.uint64(here + apart))))
        total = plus(total, widen(load(rows, np.uint64(here + apart + apart))))
    return total


@njit(cache=True, nogil=True)
def sum_downwards(
    costs: Volume,
    jumps: Bytes,
    small: int,
    rows: Bytes,
    least_costs: Bytes,
    along: Bytes,
    sums: SumVolume,
) -> None:
    """Sums of a band of rows along paths that go down from row to row, and of those along rows.

    Args:
        costs: uint8 (R, levels, W'), contiguous, of the band. W' is the picture's width, rounded up to LANES;
            what the columns beyond hold does not matter.
        jumps: uint8 (paths, R, LANES + W' + LANES), penalty of a jump (P2) on the way to each pixel: 0 where
            a path begins. One path is vertical, three come from the upper left, above and the upper right.
        small: penalty of a step of one level (P1). The highest cost, jump and small step add up to
            MAX_SUM at most.
        rows: uint8 (2, paths, `path_size`), the row before and the row now. Before the first row all MAX_SUM.
        least_costs: uint8 (2, paths, LANES + W' + LANES), their least costs. Before the first row all 0.
        along: uint8 (2, R, levels, W'), both paths along rows.
        sums: uint16 (R, levels, W'), written.
    """
    count, levels, width = costs.shape
    paths = rows.shape[1]
    flat, flat_rows, flat_along, flat_sums = (
        costs.reshape(-1),
        rows.reshape(-1),
        along.reshape(-1),
        sums.reshape(-1),
    )
    row, apart, back = np.uint64(_apart(width)), np.uint64(rows.shape[2]), np.uint64(along.size // 2)
    now = 0
    for at in range(count):
        now = 1 - now
        begin = np.uint64(at * levels * width)
        for x in range(np.uint64(0), np.uint64(width), np.uint64(LANES)):
            _advance(flat, begin, jumps[:, at], False, rows, least_costs, now, small, x)
            here = np.uint64(np.uint64(now * paths) * apart + row + np.uint64(LANES) + x)
            there = np.uint64(begin + x)
            for _ in range(np.uint64(levels)):
                both = plus(widen(load(flat_along, there)), widen(load(flat_along, np.uint64(back + there))))
                store(flat_sums, there, plus(both, _paths_there(flat_rows, here, apart, paths == 3)))
                here, there = np.uint64(here + row), np.uint64(there + np.uint64(width))
    if now == 1:
        rows[0], least_costs[0] = rows[1], least_costs[1]


@njit(cache=True, nogil=True)
def decide_upwards(
    costs: Volume,
    jumps: Bytes,
    small: int,
    rows: Bytes,
    least_costs: Bytes,
    sums: SumVolume,
    start: int,
    low: int,
    disparity: FloatMap,
    steps: FloatMap,
    seen: SumVolume,
) -> None:
    """Add the paths that go up to the sums of a band, and take the levels of least sums.

    Args:
        costs: uint8 (R', levels, W'), of the band's R rows and of those below it, where paths begin.
        jumps, small, rows, least_costs: as in `sum_downwards`, before the first row; `jumps` has R' + 1 rows,
            of which the last is below all others.
        sums: uint16 (R, levels, W'), of `sum_downwards`; start: the band's first row.
        low, disparity: see `winners`, of the band.
        steps: float32 (P, 2), of partners; seen: uint16 (P, 2, H, W), see `take_partner_winners`.
    """
    count, levels, width = costs.shape
    paths = rows.shape[1]
    flat, flat_rows, flat_sums = costs.reshape(-1), rows.reshape(-1), sums.reshape(-1)
    totals = np.empty((1, levels, width), np.uint16)
    flat_totals = totals.reshape(-1)
    row, apart = np.uint64(_apart(width)), np.uint64(rows.shape[2])
    now = 0
    for at in range(count - 1, -1, -1):
        now = 1 - now
        begin = np.uint64(at * levels * width)
        for x in range(np.uint64(0), np.uint64(width), np.uint64(LANES)):
            _advance(flat, begin, jumps[:, at + 1], True, rows, least_costs, now, small, x)
            if at < len(sums):
                here = np.uint64(np.uint64(now * paths) * apart + row + np.uint64(LANES) + x)
                there = np.uint64(x)
                for _ in range(np.uint64(levels)):
                    before = load(flat_sums, np.uint64(begin + there))
                    store(flat_totals, there, plus(before, _paths_there(flat_rows, here, apart, paths == 3)))
                    here, there = np.uint64(here + row), np.uint64(there + np.uint64(width))
        if at < len(sums):
            winners(totals, low, disparity[at : at + 1])
            for p in range(len(steps)):
                take_partner_winners(
                    totals, start + at, low, steps[p, 0], steps[p, 1], seen[p, 0], seen[p, 1]
                )


@njit(cache=True, nogil=True)
def turned_path(costs: Volume, jumps: Bytes, small: int, forwards: bool, state: Bytes, path: Volume) -> None:
    """The costs along paths through turned rows: pixel by pixel, LANES rows at once.

    Args:
        costs: uint8 (levels, W', LANES), contiguous.
        jumps: uint8 (W + 1, LANES), W' >= W, penalty of a jump on the way from the pixel before: 0 before the
            first pixel and after the last.
        small: as in `sum_downwards`.
        forwards: from the first pixel to the last, else from the last to the first.
        state: uint8 ((levels + 2) * LANES,), overwritten.
        path: uint8 (levels, W', LANES), written.
    """
    levels, padded, _ = costs.shape
    width = len(jumps) - 1
    flat, flat_path = costs.reshape(-1), path.reshape(-1)
    state[:] = MAX_SUM
    small_step, least_before, lanes = fill(np.uint8(small)), fill(np.uint8(0)), np.uint64(LANES)
    stride = np.uint64(padded * LANES)
    for i in range(width):
        x = i if forwards else width - 1 - i
        at = np.uint64(x * LANES)
        least_before = _follow(
            flat,
            at,
            stride,
            state,
            lanes,
            lanes,
            lanes,
            np.uint64(levels),
            least_before,
            load(jumps[x if forwards else x + 1], np.uint64(0)),
            small_step,
        )
        here = lanes
        for _ in range(levels):
            store(flat_path, at, load(state, here))
            here, at = np.uint64(here + lanes), np.uint64(at + stride)


@njit(cache=True, nogil=True)
def _cheapest(sums, least, best):  # type: ignore[no-untyped-def]
    """Least sum of each pixel of a row, and the (first) level that has it."""
    levels, width = sums.shape
    least[:], best[:] = sums[0], 0
    for level in range(1, levels):
        here = sums[level]
        number = np.uint16(level)
        for x in range(width):
            # Everything is loaded before anything is chosen: only that is vectorised.
            value, lowest, at = here[x], least[x], best[x]
            lower = value < lowest
            least[x] = value if lower else lowest
            best[x] = number if lower else at


@njit(cache=True, nogil=True)
def winners(sums: SumVolume, low: int, disparity: FloatMap) -> None:
    """Least sum of each pixel, sub-pixel by fitting two lines of equal slope (Shimizu and Okutomi 2001).

    Args:
        sums: uint16 (H, levels, W'), W' >= W.
        low: disparity of level 0, px.
        disparity: float32 (H, W), px, overwritten.
    """
    height, levels, padded = sums.shape
    width = disparity.shape[1]
    least, best = np.empty(padded, np.uint16), np.empty(padded, np.uint16)
    for y in range(height):
        here = sums[y]
        _cheapest(here, least, best)
        for x in range(width):
            level = np.int64(best[x])
            offset = np.float32(0)
            if 0 < level < levels - 1:
                before = np.float32(here[level - 1, x] - least[x])
                after = np.float32(here[level + 1, x] - least[x])
                if before + after > 0:
                    offset = np.float32(0.5) * (before - after) / max(before, after)
            disparity[y, x] = np.float32(low + level) + offset


@njit(cache=True, nogil=True)
def _take_lower(sums, here, level, count, there, least, best):  # type: ignore[no-untyped-def]
    for x in range(count):
        # Everything is loaded before anything is chosen: only that is vectorised.
        value, lowest, at = sums[here + x], least[there + x], best[there + x]
        lower = (value < lowest) | ((value == lowest) & (level < at))
        least[there + x] = value if lower else lowest
        best[there + x] = level if lower else at


@njit(cache=True, nogil=True)
def take_partner_winners(
    sums: SumVolume, start: int, low: int, step_x: float, step_y: float, least: SumMap, best: SumMap
) -> None:
    """What a partner's pixels are by the sums of this camera: of all levels that land there the cheapest,
    of equal ones the farthest.

    Args:
        sums: uint16 (R, levels, W'), of a band of rows of this camera, contiguous; start: its first row.
        low: disparity of level 0, px.
        step_x, step_y: a pixel of disparity d is at (x - step_x * d, y - step_y * d) of the partner; rounded.
        least, best: uint16 (H, W), least sums so far and their levels, updated. They begin at 65535.
    """
    count, levels, padded = sums.shape
    width = least.shape[1]
    flat, flat_least, flat_best = sums.reshape(-1), least.reshape(-1), best.reshape(-1)
    for at in range(count):
        for level in range(levels):
            left = int(np.rint(step_x * (low + level)))
            row = start + at - int(np.rint(step_y * (low + level)))
            first, last = max(left, 0), min(width + left, width)
            if 0 <= row < len(least) and first < last:
                here = np.uint64((at * levels + level) * padded + first)
                there = np.uint64(row * width + first - left)
                _take_lower(
                    flat, here, np.uint16(level), np.uint64(last - first), there, flat_least, flat_best
                )

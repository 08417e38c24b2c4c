"""What the last picture of a place adds to the predicted one: found by motion, in whole numbers.

FORMAT.md ("Predicted pictures", the past) says what these kernels compute; a change of any makes a new
predictor. Planes have a border of PAD repeated pixels on each side, so that no window leaves them.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.past_blocks import blend_block, blend_samples, slopes, unlike

Plane = NDArray[np.uint8]
Padded = NDArray[np.int16]
Motion = NDArray[np.int32]

LEVELS = 3
"""Full, half and quarter size."""

BLOCK = COUNT
"""Pixels of a block's side at full size: one motion for each. A step compares as many at every level."""

REACH = 6
"""The search goes so many pixels of quarter size each way."""

MOTION_COST = 4
"""What a pixel of motion costs beside absolute differences of the search."""

FINE = 16
"""Motion is counted in these parts of a pixel."""

FARTHEST = 32
"""Pixels of full size that motion is cut at."""

STILL = 64
"""Added to the squared slopes of a window: where it shows nothing, nothing moves."""

PAD = FARTHEST + 2 * BLOCK


@njit(cache=True, nogil=True)
def widen(plane: Plane, out: Padded) -> None:
    """A plane, uint8 (H, W), in the middle of `out`, int16 (H + 2 PAD, W + 2 PAD); the edges repeated."""
    height, width = plane.shape
    for y in range(-PAD, height + PAD):
        row, line = plane[min(max(y, 0), height - 1)], out[y + PAD]
        for x in range(width):  # vectorised
            line[x + PAD] = np.int16(row[x])
        line[:PAD] = line[PAD]
        line[width + PAD :] = line[width + PAD - 1]


@njit(cache=True, nogil=True)
def halve(plane: Padded, out: Padded) -> None:
    """Means of 2 x 2 pixels of a padded plane, rounded; `out` is padded, half the size, rounded up."""
    height, width = out.shape[0] - 2 * PAD, out.shape[1] - 2 * PAD
    for y in range(-PAD, height + PAD):
        inner = 2 * min(max(y, 0), height - 1) + PAD
        above, below, line = plane[inner], plane[inner + 1], out[y + PAD]
        for x in range(width):  # vectorised
            left = np.int32(above[2 * x + PAD]) + np.int32(below[2 * x + PAD])
            right = np.int32(above[2 * x + PAD + 1]) + np.int32(below[2 * x + PAD + 1])
            line[x + PAD] = np.int16((left + right + np.int32(2)) >> np.int32(2))
        line[:PAD] = line[PAD]
        line[width + PAD :] = line[width + PAD - 1]


@njit(cache=True, nogil=True)
def search(now: Padded, past: Padded, motion: Motion, first: int, last: int) -> None:
    """Whole pixels that blocks of quarter size have moved by, from now to the past: rows first..last-1.

    Args:
        now, past: padded, of quarter size.
        motion: int32 (blocks down, blocks across, 2), (y, x) in FINE-ths, overwritten.
    """
    stride, here, there = now.shape[1], now.ravel(), past.ravel()
    best = np.empty(motion.shape[1] + 2, np.int32)
    for row in range(first, last):
        line = (PAD + 4 * row - 2) * stride + PAD - 2
        for col in range(0, motion.shape[1], 3):
            place = line + 4 * col
            best[col], best[col + 1], best[col + 2] = unlike(here, there, (place, place), stride)
        motion[row] = 0
        for down in range(-REACH, REACH + 1):
            for right in range(-REACH, REACH + 1):
                way, dear = down * stride + right, np.int32(MOTION_COST * (abs(down) + abs(right)))
                for col in range(0, motion.shape[1], 3):
                    place = line + 4 * col
                    three = unlike(here, there, (place, place + way), stride)
                    for k in range(3):
                        if three[k] + dear < best[col + k]:
                            best[col + k] = three[k] + dear
                            if col + k < motion.shape[1]:
                                motion[row, col + k, 0], motion[row, col + k, 1] = FINE * down, FINE * right


@njit(cache=True, nogil=True)
def follow(now: Padded, past: Padded, level: int, motion: Motion, first: int, last: int) -> None:
    """One step towards where a window looks alike, by its slopes, if it does more there: rows first..last-1.

    Args:
        now, past: padded, of 1 / 2^level of the size.
        motion: as `search`, of this level, in place.
    """
    side, farthest, stride = BLOCK >> level, (FARTHEST * FINE) >> level, now.shape[1]
    here, there = now.ravel(), past.ravel()
    for row in range(first, last):
        for col in range(motion.shape[1]):
            place = (PAD + row * side + (side - BLOCK) // 2) * stride + PAD + col * side + (side - BLOCK) // 2
            y, x = motion[row, col, 0], motion[row, col, 1]
            before, yy, xy, xx, ty, tx = _slopes_at(here, there, place, stride, y, x)
            yy, xy, xx = np.int64(yy) + STILL, np.int64(xy), np.int64(xx) + STILL
            area = yy * xx - xy * xy
            down = (2 * (xy * tx - xx * ty) + (area >> 1)) // area
            right = (2 * (xy * ty - yy * tx) + (area >> 1)) // area
            y = min(max(y + min(max(down, -FINE), FINE), -farthest), farthest)
            x = min(max(x + min(max(right, -FINE), FINE), -farthest), farthest)
            if _slopes_at(here, there, place, stride, y, x)[0] < before:
                motion[row, col, 0], motion[row, col, 1] = y, x


@njit(cache=True, nogil=True, inline="always")
def _slopes_at(here, there, place, stride, y, x):  # type: ignore[no-untyped-def]
    moved = place + (y >> 4) * stride + (x >> 4)
    return slopes(here, there, (place, moved), stride, (np.int32(y & 15), np.int32(x & 15)))


@njit(cache=True, nogil=True)
def blend(
    now: Padded,
    past: Padded,
    taps: NDArray[np.int32],
    motion: Motion,
    share: tuple[int, int, int, int],
    luma: Plane,
    shares: NDArray[np.int32],
    first: int,
    last: int,
) -> None:
    """Luma with its share of the past, rows first..last-1 of blocks.

    Args:
        now, past: padded, of full size.
        taps: int32 (FINE, 4), in 128ths.
        motion: as `search`, of full size.
        share: (most, limit, shift, least): the past's share in 64ths of a quarter of a block is what its
            absolute differences lack to `limit`, times `most`, shifted right by `shift`, at most `most`;
            there is none where motion is less than `least` both down and across.
        luma: uint8 (BLOCK * blocks down, BLOCK * blocks across), overwritten.
        shares: int32 (2 blocks down, 2 blocks across), overwritten: the past's share of each part, in 64ths.
    """
    strides = now.shape[1], luma.shape[1]
    most, limit, shift, least = np.int32(share[0]), np.int32(share[1]), np.int32(share[2]), share[3]
    here, there, out = now.ravel(), past.ravel(), luma.ravel()
    for row in range(first, last):
        for col in range(motion.shape[1]):
            y, x = motion[row, col]
            place, at = (PAD + BLOCK * row) * strides[0] + PAD + BLOCK * col, BLOCK * (row * strides[1] + col)
            places = place, place + (y >> 4) * strides[0] + (x >> 4), at
            across, along = taps[x & 15], taps[y & 15]
            some = most if max(abs(y), abs(x)) >= least else np.int32(0)
            four = blend_block(
                here,
                there,
                out,
                places,
                strides,
                (across[0], across[1], across[2], across[3]),
                (along[0], along[1], along[2], along[3]),
                (some, limit, shift),
            )
            shares[2 * row, 2 * col], shares[2 * row, 2 * col + 1] = four[0], four[1]
            shares[2 * row + 1, 2 * col], shares[2 * row + 1, 2 * col + 1] = four[2], four[3]


@njit(cache=True, nogil=True)
def blend_chroma(
    now: Padded, past: Padded, motion: Motion, shares: NDArray[np.int32], chroma: Plane, first: int, last: int
) -> None:
    """One of chroma's planes with its share of the past, rows first..last-1 of blocks.

    Args:
        now, past: padded planes.
        motion, shares: as `blend` has them.
        chroma: uint8 (BLOCK / 2 * blocks down, BLOCK / 2 * blocks across), overwritten.
    """
    side, strides = BLOCK // 2, (now.shape[1], chroma.shape[1])
    here, there, out = now.ravel(), past.ravel(), chroma.ravel()
    for row in range(first, last):
        for col in range(motion.shape[1]):
            down, right = (motion[row, col, 0] + 1) >> 1, (motion[row, col, 1] + 1) >> 1
            place, at = (side * row + PAD) * strides[0] + side * col + PAD, side * (row * strides[1] + col)
            places = place, place + (down >> 4) * strides[0] + (right >> 4), at
            beyond = np.int32(down & 15), np.int32(right & 15)
            above, below = shares[2 * row], shares[2 * row + 1]
            four = above[2 * col], above[2 * col + 1], below[2 * col], below[2 * col + 1]
            blend_samples(here, there, out, places, strides, beyond, four)

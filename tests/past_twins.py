"""A plain twin of the past's share in a prediction, by FORMAT.md's words: sample by sample, in Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from prediction_twins import CUBIC

Ints = NDArray[np.int64]


def at(plane: Ints, y: int, x: int) -> int:
    """A sample; edges go on."""
    return int(plane[min(max(y, 0), plane.shape[0] - 1), min(max(x, 0), plane.shape[1] - 1)])


def window(plane: Ints, y: int, x: int, height: int, width: int) -> Ints:
    rows = np.clip(np.arange(y, y + height), 0, plane.shape[0] - 1)
    columns = np.clip(np.arange(x, x + width), 0, plane.shape[1] - 1)
    return plane[rows][:, columns]


def halved(plane: Ints) -> Ints:
    rows, columns = -(-plane.shape[0] // 2), -(-plane.shape[1] // 2)
    out = np.empty((rows, columns), np.int64)
    for y, x in np.ndindex(rows, columns):
        out[y, x] = (int(window(plane, 2 * y, 2 * x, 2, 2).sum()) + 2) // 4
    return out


def moved(plane: Ints, y: int, x: int, v: int, u: int, size: int) -> Ints:
    """Sums in 1 / 256: bilinear at (v, u) 16ths from a window."""
    low, far = v % 16, u % 16
    four = window(plane, y + v // 16, x + u // 16, size + 1, size + 1)
    above = (16 - far) * four[:-1, :-1] + far * four[:-1, 1:]
    below = (16 - far) * four[1:, :-1] + far * four[1:, 1:]
    return (16 - low) * above + low * below


def motion_of(now: list[Ints], past: list[Ints], row: int, col: int) -> tuple[int, int]:
    y, x = 4 * row - 2, 4 * col - 2
    own = window(now[2], y, x, 8, 8)
    choices = [(0, 0), *((v, u) for v in range(-6, 7) for u in range(-6, 7))]
    costs = [
        int(np.abs(own - window(past[2], y + v, x + u, 8, 8)).sum()) + 4 * (abs(v) + abs(u))
        for v, u in choices
    ]
    v, u = (16 * each for each in choices[costs.index(min(costs))])
    for level in (2, 1, 0):
        side = 16 >> level
        y, x = side * row + (side - 16) // 2, side * col + (side - 16) // 2
        wide = window(now[level], y - 1, x - 1, 18, 18)
        own, g, h = wide[1:-1, 1:-1], wide[2:, 1:-1] - wide[:-2, 1:-1], wide[1:-1, 2:] - wide[1:-1, :-2]

        def differences(v: int, u: int) -> Ints:
            return ((moved(past[level], y, x, v, u, 16) + 8) >> 4) - 16 * own  # noqa: B023

        t = differences(v, u)
        a, b, c = int((g * g).sum()) + 64, int((g * h).sum()), int((h * h).sum()) + 64
        of_g, of_h = int((g * t).sum()), int((h * t).sum())
        d, most = a * c - b * b, 512 >> level
        new_v = v + min(max((2 * (b * of_h - c * of_g) + (d >> 1)) // d, -16), 16)
        new_u = u + min(max((2 * (b * of_g - a * of_h) + (d >> 1)) // d, -16), 16)
        new_v, new_u = min(max(new_v, -most), most), min(max(new_u, -most), most)
        if np.abs(differences(new_v, new_u)).sum() < np.abs(t).sum():
            v, u = new_v, new_u
        if level:
            v, u = 2 * v, 2 * u
    return v, u


def blended(
    planes: list[NDArray[np.uint8]], past: list[NDArray[np.uint8]], m: int
) -> list[NDArray[np.uint8]]:
    """Y, Cb and Cr of a prediction with a share of the past."""
    n, limit, k = {1: (24, 768, 9), 2: (32, 1536, 10)}[m]
    (now, *chroma), (before, *earlier) = (
        [plane.astype(np.int64) for plane in each] for each in (planes, past)
    )
    levels = [now, halved(now), halved(halved(now))], [before, halved(before), halved(halved(before))]
    height, width = now.shape
    out = [np.zeros_like(plane) for plane in planes]

    def put(plane: int, y: int, x: int, grey: int, share: int, fetched: int) -> None:
        mixed = 64 * grey + ((share * (fetched - 64 * grey) + 32) >> 6)
        out[plane][y, x] = min(max((mixed + 32) >> 6, 0), 255)

    for row, col in np.ndindex(-(-height // 16), -(-width // 16)):
        v, u = motion_of(*levels, row, col)
        y, x = 16 * row, 16 * col
        source = window(before, y + v // 16 - 1, x + u // 16 - 1, 19, 19)
        fetched = np.empty((16, 16), np.int64)
        for i, j in np.ndindex(16, 16):
            four = source[i : i + 4, j : j + 4]
            fetched[i, j] = (int(CUBIC[v % 16] @ four @ CUBIC[u % 16]) + 128) >> 8
        apart = np.abs(fetched - 64 * window(now, y, x, 16, 16))
        smooth = [moved(each, y // 2, x // 2, (v + 1) >> 1, (u + 1) >> 1, 8) for each in earlier]
        for i, j in np.ndindex(16, 16):
            unlike = int(apart[i // 8 * 8 : i // 8 * 8 + 8, j // 8 * 8 : j // 8 * 8 + 8].sum()) >> 6
            share = min(max((limit - unlike) * n >> k, 0), n) if max(abs(v), abs(u)) >= 4 else 0
            if y + i >= height or x + j >= width:
                continue
            put(0, y + i, x + j, at(now, y + i, x + j), share, int(fetched[i, j]))
            if i % 2 == j % 2 == 0:
                for plane, (samples, found) in enumerate(zip(chroma, smooth, strict=True), 1):
                    p, q = (y + i) // 2, (x + j) // 2
                    put(plane, p, q, at(samples, p, q), share, (int(found[i // 2, j // 2]) + 2) >> 2)
    return out

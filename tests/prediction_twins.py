"""Plain twins of the kernels that predict pictures, by FORMAT.md's words: pixel by pixel, in Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int32]
UNKNOWN = -(1 << 24)


def _cubic() -> NDArray[np.int64]:
    """(16, 4): Keys' cubic in 128ths at sixteenths of a pixel; the second tap takes what rounding leaves."""
    rows = []
    for t in np.arange(16) / 16:
        near, *far = (1 - t, 1 + t, 2 - t)
        first, fourth = (-0.7 * s**3 + 3.5 * s**2 - 5.6 * s + 2.8 for s in far)
        third = 1.3 * near**3 - 2.3 * near**2 + 1
        taps = [int(np.floor(128 * tap + 0.5)) for tap in (first, third, fourth)]
        rows.append([taps[0], 128 - sum(taps), taps[1], taps[2]])
    return np.array(rows, np.int64)


CUBIC = _cubic()
LINEAR = np.array([[128 - 8 * phase, 8 * phase] for phase in range(16)], np.int64)


def enlarge(small: Ints, luma: NDArray[np.uint8], shape: tuple[int, int]) -> Ints:
    rows, columns = small.shape
    out = np.empty(shape, np.int32)
    padded = np.pad(luma, ((0, luma.shape[0] % 2), (0, luma.shape[1] % 2)), mode="edge").astype(int)
    for y, x in np.ndindex(*shape):
        total = 0
        four = []
        for v, weigh_v in (((y - 1) // 2, 1 + 2 * (y % 2)), ((y + 1) // 2, 3 - 2 * (y % 2))):
            for u, weigh_u in (((x - 1) // 2, 1 + 2 * (x % 2)), ((x + 1) // 2, 3 - 2 * (x % 2))):
                value = int(small[min(max(v, 0), rows - 1), min(max(u, 0), columns - 1)])
                four.append(value)
                total += weigh_v * weigh_u * value
        if max(four) - min(four) <= 192:
            out[y, x] = (total + 8) // 16
            continue
        best = None
        for v in range(y // 2 - 1, y // 2 + 2):
            for u in range(x // 2 - 1, x // 2 + 2):
                if not (0 <= v < rows and 0 <= u < columns):
                    continue
                mean = (int(padded[2 * v : 2 * v + 2, 2 * u : 2 * u + 2].sum()) + 2) // 4
                place = (4 * v + 1 - 2 * y) ** 2 + (4 * u + 1 - 2 * x) ** 2
                cost = 6 * abs(int(luma[y, x]) - mean) + 5 * place
                if best is None or cost < best[0]:
                    best = cost, small[v, u]
        assert best is not None
        out[y, x] = best[1]
    return out


def splat(disparity: Ints, shift_x: int, shift_y: int) -> Ints:
    height, width = disparity.shape
    out = np.full(disparity.shape, UNKNOWN, np.int32)
    for y, x in np.ndindex(height, width):
        d = int(disparity[y, x])
        at_x, at_y = 64 * x - (shift_x * d + 32768) // 65536, 64 * y - (shift_y * d + 32768) // 65536
        for v in range((at_y - 35) // 64, (at_y + 35) // 64 + 2):
            for u in range((at_x - 35) // 64, (at_x + 35) // 64 + 2):
                near = abs(64 * u - at_x) <= 35 and abs(64 * v - at_y) <= 35
                if near and 0 <= u < width and 0 <= v < height:
                    out[v, u] = max(out[v, u], d)
    return out


def vote(moved: NDArray[np.int32], weights: NDArray[np.int64]) -> Ints:
    out = np.full(moved.shape[1:], UNKNOWN, np.int32)
    for y, x in np.ndindex(*out.shape):
        known = [(int(d), int(w)) for d, w in zip(moved[:, y, x], weights, strict=True) if d != UNKNOWN]
        known.sort(key=lambda each: -each[0])
        strength = None
        while known:
            group = [each for each in known if known[0][0] - each[0] <= 96]
            known = known[len(group) :]
            total = sum(w for _, w in group)
            if strength is None or 10 * total > 13 * strength:
                out[y, x], strength = sum(d * w for d, w in group) // total, total
    return out


def fill(disparity: Ints, fallback: int) -> Ints:
    out = disparity.copy()
    for row, source in zip(out, disparity, strict=True):
        known = np.flatnonzero(source != UNKNOWN)
        for x in np.flatnonzero(source == UNKNOWN):
            ends = [source[known[known < x][-1]]] if (known < x).any() else []
            ends += [source[known[known > x][0]]] if (known > x).any() else []
            row[x] = min(ends, default=fallback)
    return out


def predict(
    planes: NDArray[np.uint8],
    maps: NDArray[np.int32],
    shifts: NDArray[np.int64],
    weights: NDArray[np.int64],
    taps: NDArray[np.int64],
    disparity: Ints,
    step: int,
) -> NDArray[np.uint8]:
    """A plane: luma with `step` 1 and four taps, chroma with `step` 2 and two."""
    height, width = disparity.shape
    out = np.zeros((height // step, width // step), np.uint8)
    for y in range(out.shape[0]):
        seen = []
        for x in range(out.shape[1]):
            d, value, total = int(disparity[step * y, step * x]), 0, 0
            for i, (by_x, by_y) in enumerate(shifts.tolist()):
                luma_x = 64 * step * x + (by_x * d + 32768) // 65536
                luma_y = 64 * step * y + (by_y * d + 32768) // 65536
                u, v = (luma_x + 32) // 64, (luma_y + 32) // 64
                if not (0 <= u < width and 0 <= v < height) or abs(int(maps[i, v, u]) - d) > 96:
                    continue
                half = 32768 * step
                at_x = 64 * x + (by_x * d + half) // (65536 * step)
                at_y = 64 * y + (by_y * d + half) // (65536 * step)
                fine_x, fine_y, reach = (at_x + 2) // 4, (at_y + 2) // 4, taps.shape[1] // 2
                left, top = fine_x // 16 + 3 - reach, fine_y // 16 + 3 - reach
                window = planes[i, top : top + 2 * reach, left : left + 2 * reach].astype(np.int64)
                fetched = int(taps[fine_y % 16] @ window @ taps[fine_x % 16])
                value += int(weights[i]) * fetched
                total += int(weights[i])
            seen.append(total > 0)
            if total:
                out[y, x] = min(max((2 * value + total * 16384) // (2 * total * 16384), 0), 255)
        known = np.flatnonzero(seen)
        far = disparity[step * y, ::step]
        for hole in np.flatnonzero(~np.array(seen)).tolist():
            ends = [*known[known < hole][-1:], *known[known > hole][:1]]
            out[y, hole] = out[y, min(ends, key=lambda end: int(far[end]))] if ends else 128
    return out

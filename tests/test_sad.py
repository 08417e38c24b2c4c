"""The compiled SAD against the equations written out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mvcodec.frames import Picture
from mvcodec.kernels.sad import sad_band


def plain_costs(left: Picture, right: Picture, low: int, levels: int, radius: int) -> NDArray[np.int64]:
    """Equation 3.4 for every pixel of the left picture and every disparity: (levels, H, W)."""
    height, width = left.shape[:2]
    columns = np.arange(width)
    costs = []
    for disparity in range(low, low + levels):
        moved = right[:, (columns - disparity).clip(0, width - 1)]
        difference = np.abs(left.astype(np.int64) - moved).sum(axis=2)
        padded = np.pad(difference, radius, mode="edge")
        size = 2 * radius + 1
        windows = np.lib.stride_tricks.sliding_window_view(padded, (size, size))
        costs.append(windows.sum(axis=(2, 3)))
    return np.stack(costs).reshape(levels, height, width)


def plain_winner(costs: NDArray[np.int64], low: int, right: bool) -> NDArray[np.float32]:
    levels, height, width = costs.shape
    winner = np.full((height, width), np.nan, np.float32)
    for y in range(height):
        for x in range(width):
            candidates = {}
            for disparity in range(low, low + levels):
                in_left, in_right = (x + disparity, x) if right else (x, x - disparity)
                if 0 <= in_left < width and 0 <= in_right < width:
                    candidates[disparity] = costs[disparity - low, y, in_left]
            if candidates:
                winner[y, x] = min(candidates, key=lambda d: (candidates[d], d))
    return winner


@pytest.mark.parametrize("low", [-5, 0, 3])
@pytest.mark.parametrize("radius", [0, 1, 4])
@pytest.mark.parametrize("size", [(9, 14), (3, 5), (1, 20)], ids=str)
def test_equals_its_plain_twin(low: int, radius: int, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    left, right = rng.integers(0, 256, (2, *size, 3), np.uint8)
    levels = 7
    found = np.empty((2, *size), np.float32)
    middle = size[0] // 2
    sad_band(left, right, low, levels, radius, False, 0, middle, found[0], found[1])
    sad_band(left, right, low, levels, radius, False, middle, size[0], found[0], found[1])
    costs = plain_costs(left, right, low, levels, radius)
    np.testing.assert_array_equal(found[0], plain_winner(costs, low, right=False))
    np.testing.assert_array_equal(found[1], plain_winner(costs, low, right=True))


def test_parabola_stays_within_half_a_pixel_of_the_winner() -> None:
    rng = np.random.default_rng(2)
    left, right = rng.integers(0, 256, (2, 12, 30, 3), np.uint8)
    whole, refined = np.empty((2, 2, 12, 30), np.float32)
    for maps, subpixel in ((whole, False), (refined, True)):
        sad_band(left, right, -3, 9, 2, subpixel, 0, 12, maps[0], maps[1])
    assert np.abs(whole - refined).max() <= 0.5
    assert (whole != refined).mean() > 0.5

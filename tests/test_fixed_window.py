"""The fixed-window matchers against the thesis's equations written out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from stereo_scene import Planes, linear_or_grid

from mvcodec.frames import Picture
from mvcodec.stereo.fixed_window import MEASURES, FixedWindow, FixedWindowSettings

Windows = NDArray[np.float64]
"""float64 (H, W, size * size, C): the pixels of each window."""


def windows_of(pixels: NDArray[np.float64], radius: int) -> Windows:
    padded = np.pad(pixels, ((radius, radius), (radius, radius), (0, 0)), mode="edge")
    size = 2 * radius + 1
    views = np.lib.stride_tricks.sliding_window_view(padded, (size, size), axis=(0, 1))
    height, width, channels = pixels.shape
    return views.transpose(0, 1, 3, 4, 2).reshape(height, width, size * size, channels)


def grey(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    import cv2

    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)[..., None], np.float64)


def census_bits(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    luma = grey(picture)
    neighbours = windows_of(luma, 2)[..., 0]
    return np.asarray(neighbours < luma, np.float64)


def correlation(left: Windows, right: Windows) -> NDArray[np.float64]:
    left, right = (w - w.mean(axis=2, keepdims=True) for w in (left, right))
    variances = [np.maximum((w * w).mean(axis=(2, 3)), 1) for w in (left, right)]
    return np.asarray((left * right).mean(axis=(2, 3)) / np.sqrt(variances[0] * variances[1]))


Feature = Callable[[NDArray[np.uint8]], NDArray[np.float64]]
Distance = Callable[[Windows, Windows], NDArray[np.float64]]

PLAIN: dict[str, tuple[Feature, Distance]] = {
    "sad": (lambda p: p.astype(np.float64), lambda a, b: np.abs(a - b).sum(axis=(2, 3))),
    "ssd": (lambda p: p.astype(np.float64), lambda a, b: ((a - b) ** 2).sum(axis=(2, 3))),
    "ncc": (grey, lambda a, b: -correlation(a, b)),
    "census": (census_bits, lambda a, b: np.abs(a - b).sum(axis=(2, 3))),
}


def plain_costs(name: str, left: Picture, right: Picture, disparity: int, radius: int) -> NDArray[np.float64]:
    """Pairs of pixels in windows: the left one's, and `disparity` to the left in the right picture."""
    feature, distance = PLAIN[name]
    width = left.shape[1]
    first, second = feature(left), feature(right)
    moved = second[:, (np.arange(width) - disparity).clip(0, width - 1)]
    return distance(windows_of(first, radius), windows_of(moved, radius))


def plain_winner(costs: dict[int, NDArray[np.float64]], right: bool) -> NDArray[np.float32]:
    height, width = next(iter(costs.values())).shape
    winner = np.full((height, width), np.nan, np.float32)
    for y in range(height):
        for x in range(width):
            candidates = {}
            for disparity, plane in costs.items():
                in_left, in_right = (x + disparity, x) if right else (x, x - disparity)
                if 0 <= in_left < width and 0 <= in_right < width:
                    candidates[disparity] = plane[y, in_left]
            if candidates:
                winner[y, x] = min(candidates, key=lambda d: (candidates[d], d))
    return winner


@pytest.mark.parametrize("name", list(MEASURES))
@pytest.mark.parametrize("low", [-5, 0, 3])
@pytest.mark.parametrize("radius", [0, 1, 3])
@pytest.mark.parametrize("size", [(9, 14), (3, 5), (1, 20)], ids=str)
def test_costs_and_winners_equal_their_plain_twins(
    name: str, low: int, radius: int, size: tuple[int, int]
) -> None:
    rng = np.random.default_rng(1)
    left, right = rng.integers(0, 256, (2, *size, 3), np.uint8)
    costs = {d: plain_costs(name, left, right, d, radius) for d in range(low, low + 7)}
    costs_at = MEASURES[name](left, right, 2 * radius + 1)
    for disparity, expected in costs.items():
        # Borders: costs are repeated there, the windows above repeat pixels, which is the same thing.
        np.testing.assert_allclose(costs_at(disparity), expected, rtol=1e-5, atol=1e-4)
    if name == "ncc" or (name == "census" and radius == 0):
        return  # near ties are decided by rounding
    settings = FixedWindowSettings(name, 2 * radius + 1)
    (found_left, left_known), (found_right, right_known) = FixedWindow(settings).raw_pair(
        left, right, (float(low), float(low + 6))
    )
    for found, known, is_right in ((found_left, left_known, False), (found_right, right_known, True)):
        expected_px = plain_winner({d: costs[d] for d in costs if abs(d) < size[1]}, is_right)
        np.testing.assert_array_equal(known, np.isfinite(expected_px))
        np.testing.assert_array_equal(found[known], expected_px[known])


@pytest.mark.parametrize("name", list(MEASURES))
def test_parabola_resolves_parts_of_a_pixel(name: str) -> None:
    array = linear_or_grid(1, 2, 120, 60)
    pictures = Planes(array, 2.4, 2.4).pictures()
    whole, refined = (
        FixedWindow(FixedWindowSettings(name, 9, median_size=5, subpixel=subpixel)).match_pair(
            pictures[0, 0], pictures[0, 1], (0.0, 6.0)
        )[0]
        for subpixel in (False, True)
    )
    inside = np.s_[15:-15, 20:-20]
    assert np.abs(refined.values_px[inside] - 2.4).mean() < 0.15
    assert np.abs(whole.values_px[inside] - 2.4).mean() > 0.3


@pytest.mark.parametrize("name", list(MEASURES))
def test_parabola_stays_within_half_a_pixel_of_the_winner(name: str) -> None:
    left, right = np.random.default_rng(2).integers(0, 256, (2, 12, 30, 3), np.uint8)
    whole, refined = (
        FixedWindow(FixedWindowSettings(name, 5, subpixel=subpixel)).raw_pair(left, right, (-3.0, 5.0))
        for subpixel in (False, True)
    )
    for (coarse, known), (fine, fine_known) in zip(whole, refined, strict=True):
        assert (known == fine_known).all()
        assert np.abs(coarse - fine).max() <= 0.5
        assert (coarse != fine).mean() > 0.5


def test_correlation_forgives_gain_and_offset() -> None:
    array = linear_or_grid(1, 2, 100, 50)
    pictures = Planes(array, 5, 5).pictures()
    darker = np.rint(pictures[0, 1] * 0.4 + 20).astype(np.uint8)
    by_ncc, by_sad = (
        FixedWindow(FixedWindowSettings(name, 9)).match_pair(pictures[0, 0], darker, (0.0, 12.0))[0]
        for name in ("ncc", "sad")
    )
    seen = np.s_[:, 10:]
    assert np.mean(np.abs(by_ncc.values_px[seen] - 5) > 0.5) == 0
    assert np.mean(np.abs(by_sad.values_px[seen] - 5) > 0.5) > 0.02

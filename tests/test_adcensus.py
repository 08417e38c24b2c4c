"""AD-Census: every kernel against its plain twin, and the repair steps on maps made for them."""

from __future__ import annotations

import adcensus_twins as twins
import numpy as np
import pytest
from numpy.typing import NDArray
from stereo_scene import Planes, linear_or_grid

from mvcodec.kernels import census, cost_volume, disparity_repair
from mvcodec.stereo.adcensus import AdCensus
from mvcodec.stereo.fixed_window import FixedWindow
from mvcodec.stereo.matcher import PairMatcher

SIZES = [(9, 13), (1, 1), (1, 17), (6, 1), (4, 5)]
LEVELS = 5
PENALTIES = np.array([[1, 3], [0.25, 0.75], [0.1, 0.3]], np.float32)

size_parameter = pytest.mark.parametrize("size", SIZES, ids=str)


def blotchy(size: tuple[int, int], seed: int) -> NDArray[np.uint8]:
    """A picture with runs of similar colours, so that crosses have arms of all lengths."""
    rng = np.random.default_rng(seed)
    base = np.repeat(np.repeat(rng.integers(0, 256, (8, 8, 3)), 4, axis=0), 5, axis=1)
    picture = base[: size[0], : size[1]] + rng.integers(0, 9, (*size, 3))
    return np.asarray(picture.clip(0, 255), np.uint8)


def arms_of(picture: NDArray[np.uint8]) -> NDArray[np.int16]:
    return cost_volume.cross_arms(picture, 7, 3, 20, 6)


def random_volume(size: tuple[int, int], seed: int) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(0, 2, (*size, LEVELS)).astype(np.float32)


def random_levels(size: tuple[int, int], unknown: float) -> NDArray[np.int32]:
    rng = np.random.default_rng(4)
    levels = rng.integers(0, LEVELS, size, np.int32)
    levels[rng.uniform(size=size) < unknown] = -1
    return levels


@size_parameter
@pytest.mark.parametrize("radii", [(4, 3), (2, 2), (0, 0), (1, 0)], ids=str)
def test_census_equals_its_plain_twin(size: tuple[int, int], radii: tuple[int, int]) -> None:
    grey = np.random.default_rng(0).integers(0, 256, size, np.uint8)
    found = census.census_transform(grey, *radii)
    np.testing.assert_array_equal(found, twins.census_transform(grey, *radii))


def test_hamming_counts_bits() -> None:
    values = np.random.default_rng(0).integers(0, 2**64, 64, np.uint64)
    for first, second in zip(values[::2], values[1::2], strict=True):
        assert census.hamming(first, second) == (int(first) ^ int(second)).bit_count()
        assert census.hamming(first, first) == 0
    assert census.hamming(np.uint64(0), np.uint64(2**64 - 1)) == 64


@size_parameter
@pytest.mark.parametrize("low", [-3, 0, 2])
def test_costs_equal_their_plain_twin(size: tuple[int, int], low: int) -> None:
    rng = np.random.default_rng(1)
    first, second = rng.integers(0, 256, (2, *size, 3), np.uint8)
    bits, other_bits = rng.integers(0, 2**64, (2, *size), np.uint64)
    table, bit_table = rng.uniform(size=766).astype(np.float32), rng.uniform(size=65).astype(np.float32)
    found = np.full((*size, LEVELS), np.nan, np.float32)
    middle = size[0] // 2
    for start, stop in ((0, middle), (middle, size[0])):
        cost_volume.ad_census_costs(
            first, second, bits, other_bits, low, table, bit_table, 1.0, start, stop, found
        )
    expected = twins.ad_census_costs(first, second, bits, other_bits, low, table, bit_table, 1.0, LEVELS)
    np.testing.assert_array_equal(found, expected)


@size_parameter
@pytest.mark.parametrize("settings", [(7, 3, 20, 6), (34, 17, 20, 6), (1, 1, 20, 6), (5, 2, 0, 0)], ids=str)
def test_arms_equal_their_plain_twin(size: tuple[int, int], settings: tuple[int, int, int, int]) -> None:
    picture = blotchy(size, 2)
    np.testing.assert_array_equal(
        cost_volume.cross_arms(picture, *settings), twins.cross_arms(picture, *settings)
    )


@size_parameter
@pytest.mark.parametrize("along_rows", [True, False])
def test_sums_equal_their_plain_twin(size: tuple[int, int], along_rows: bool) -> None:
    volume, arms = random_volume(size, 3), arms_of(blotchy(size, 3))
    counts = np.random.default_rng(5).uniform(1, 9, size).astype(np.float32)
    found = np.full_like(volume, np.nan)
    sum_along = cost_volume.sum_along_rows if along_rows else cost_volume.sum_along_columns
    length = size[0] if along_rows else size[1]
    for start, stop in ((0, length // 2), (length // 2, length)):
        sum_along(volume, arms, counts, start, stop, found)
    np.testing.assert_allclose(found, twins.sums(volume, arms, counts, along_rows), rtol=1e-6)


@size_parameter
@pytest.mark.parametrize("along_rows", [True, False])
@pytest.mark.parametrize("backward", [True, False])
@pytest.mark.parametrize("low", [-2, 1])
def test_paths_equal_their_plain_twin(
    size: tuple[int, int], along_rows: bool, backward: bool, low: int
) -> None:
    volume = random_volume(size, 6)
    edges, other_edges = np.random.default_rng(7).uniform(size=(2, *size)) < 0.4
    found = np.ones_like(volume)
    follow = cost_volume.follow_rows if along_rows else cost_volume.follow_columns
    length = size[0] if along_rows else size[1]
    for start, stop in ((0, length // 2), (length // 2, length)):
        follow(volume, edges, other_edges, low, PENALTIES, backward, start, stop, found)
    expected = twins.follow(volume, edges, other_edges, low, PENALTIES, backward, along_rows)
    np.testing.assert_allclose(found, 1 + expected, rtol=1e-5)


@size_parameter
def test_winners_are_the_first_of_the_cheapest(size: tuple[int, int]) -> None:
    volume = np.random.default_rng(8).integers(0, 3, (*size, LEVELS)).astype(np.float32)
    found = np.full(size, -1, np.int32)
    cost_volume.cheapest_levels(volume, 0, size[0], found)
    np.testing.assert_array_equal(found, volume.argmin(axis=2))


@size_parameter
@pytest.mark.parametrize("unknown", [0.0, 0.3, 1.0])
def test_votes_equal_their_plain_twin(size: tuple[int, int], unknown: float) -> None:
    levels, arms = random_levels(size, unknown), arms_of(blotchy(size, 3))
    found = disparity_repair.vote(levels, arms, LEVELS, 2, 0.3)
    np.testing.assert_array_equal(found, twins.vote(levels, arms, 2, 0.3))


@size_parameter
@pytest.mark.parametrize("unknown", [0.0, 0.6, 1.0])
def test_interpolation_equals_its_plain_twin(size: tuple[int, int], unknown: float) -> None:
    levels, picture = random_levels(size, unknown), blotchy(size, 4)
    hidden = np.random.default_rng(9).uniform(size=size) < 0.5
    angles = np.arange(16) * (2 * np.pi / 16)
    directions = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    found = disparity_repair.interpolate(levels, hidden, picture, directions)
    np.testing.assert_array_equal(found, twins.interpolate(levels, hidden, picture, directions))


@size_parameter
def test_edges_and_sub_pixels_equal_their_plain_twins(size: tuple[int, int]) -> None:
    volume, levels = random_volume(size, 10), random_levels(size, 0.0)
    edges = np.random.default_rng(11).uniform(size=size) < 0.7
    found = disparity_repair.settle_edges(levels, edges, volume)
    np.testing.assert_array_equal(found, twins.settle_edges(levels, edges, volume))
    cheapest = volume.argmin(axis=2).astype(np.int32)
    for chosen in (cheapest, levels):
        refined = disparity_repair.parabola_peaks(chosen, volume)
        np.testing.assert_allclose(refined, twins.parabola_peaks(chosen, volume), atol=1e-5)
        assert np.abs(refined - chosen).max() <= 0.5


def mean_error(far: float, near: float, matcher: PairMatcher | None = None) -> float:
    scene = Planes(linear_or_grid(1, 2, 120, 60), far, near)
    pictures = scene.pictures()
    left = (matcher or AdCensus()).match_pair(pictures[0, 0], pictures[0, 1], (0.0, 16.0))[0]
    return float(np.abs(left.values_px - scene.disparity_px((0, 0)))[:, 18:].mean())


def test_resolves_parts_of_a_pixel() -> None:
    assert mean_error(3.4, 3.4) < 0.25  # whole pixels would be 0.4 off


def test_hidden_pixels_take_the_background() -> None:
    """Left of the square lies what the right camera does not see."""
    array = linear_or_grid(1, 2, 150, 60)
    pictures = Planes(array, 2, 14).pictures()
    left, _ = AdCensus().match_pair(pictures[0, 0], pictures[0, 1], (0.0, 20.0))
    hidden = np.s_[20:40, 150 // 3 - 10 : 150 // 3 - 3]
    assert left.valid[hidden].mean() < 0.5
    assert np.abs(left.values_px[hidden] - 2).mean() < 1


def test_contours_are_sharper_than_fixed_windows() -> None:
    assert mean_error(2, 9) < 0.25 < mean_error(2, 9, FixedWindow())

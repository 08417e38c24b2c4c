"""Depth layers: the thesis's worked examples, invalid pixels, negative and absurd disparities."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mvcodec.frames import DisparityMap
from mvcodec.layers.dils_split import average_px, runs, split, split_levels
from mvcodec.layers.splits import LAYER_SPLITS


def ones(text: str) -> NDArray[np.bool_]:
    return np.array([character == "1" for character in text.replace(" ", "")])


def map_of(counts: dict[int, int], width: int = 25) -> DisparityMap:
    """A map in which each disparity occurs as often as `counts` says; the rest of its last row is invalid."""
    values = np.repeat(np.array(list(counts), np.float32), list(counts.values()))
    height = -(-values.size // width)
    padded = np.zeros(height * width, np.float32)
    padded[: values.size] = values
    valid = np.arange(height * width) < values.size
    return DisparityMap(padded.reshape(height, width), valid.reshape(height, width))


@pytest.mark.parametrize(
    ("samples", "first_layer"),
    [
        ("1 1 1 1 0 0 1", (1, 4)),
        ("0 1 0 1 0 0 1", (2, 4)),
        ("0 1 0 1 1 1 0 0", (2, 6)),
        ("0 1 0 1 0 1 0 0", (2, 6)),
    ],
)
def test_first_run_of_figure_4_12(samples: str, first_layer: tuple[int, int]) -> None:
    first, last = runs(ones(samples))[0]
    assert (first + 1, last + 1) == first_layer


def test_table_4_1_from_a_map() -> None:
    frequent = [4, 5, 9, 10, 11, 12, 17, 19, 20, 21, 25, 27, 28, 30]
    counts = {level: 21 if level in frequent else 20 for level in range(1, 31)}
    stack = split(map_of(counts))
    assert stack.bounds_px == ((4, 5), (9, 12), (17, 21), (25, 30))


def test_threshold_itself_is_not_enough() -> None:
    assert split(map_of({3: 20, 7: 21})).bounds_px == ((7, 7),)
    assert split(map_of({3: 20, 7: 21}), threshold=19).bounds_px == ((3, 3), (7, 7))


def test_masks_hold_what_lies_between_the_bounds() -> None:
    disparity = map_of({2: 30, 3: 5, 4: 30, 9: 7, 12: 40})
    stack = split(disparity)
    assert stack.bounds_px == ((2, 4), (12, 12))
    values, valid = disparity.values_px, disparity.valid
    for number, (d_min, d_max) in enumerate(stack.bounds_px, start=1):
        np.testing.assert_array_equal(stack.labels == number, valid & (values >= d_min) & (values <= d_max))
    np.testing.assert_array_equal(stack.labels == 0, ~valid | (values == 9))


def test_negative_disparities_are_levels_like_others() -> None:
    assert split(map_of({-9: 30, -8: 30, -1: 30, 1: 30, 2: 30})).bounds_px == ((-9, -8), (-1, 2))
    assert average_px((-9, -8)) == -9
    assert average_px((-1, 2)) == 0


def test_fractions_are_rounded_to_whole_disparities() -> None:
    values = np.full((10, 10), 4.0, np.float32)
    values[:5] = 6.5
    values[5:] = -2.5
    stack = split(DisparityMap(values, np.ones((10, 10), np.bool_)))
    assert stack.bounds_px == ((-2, -2), (7, 7))


def test_every_level_a_layer() -> None:
    stack = split_levels(map_of({2: 30, 3: 5, 4: 30, 12: 40}))
    assert stack.bounds_px == ((2, 2), (4, 4), (12, 12))
    assert (stack.labels == 0).sum() == 5 + stack.labels.size - 105


@pytest.mark.parametrize("name", LAYER_SPLITS)
def test_nothing_valid_is_all_occluded(name: str) -> None:
    disparity = DisparityMap(np.full((6, 7), 3, np.float32), np.zeros((6, 7), np.bool_))
    stack = LAYER_SPLITS[name](disparity, 0)
    assert stack.bounds_px == ()
    assert stack.labels.shape == (6, 7)
    assert not stack.labels.any()


@pytest.mark.parametrize("name", LAYER_SPLITS)
def test_absurd_disparities_are_occluded(name: str) -> None:
    values = np.full((10, 10), 5, np.float32)
    values[:4] = 3e38
    values[4:6] = -1e9
    stack = LAYER_SPLITS[name](DisparityMap(values, np.ones((10, 10), np.bool_)), 0)
    assert stack.bounds_px == ((5, 5),)
    np.testing.assert_array_equal(stack.labels > 0, values == 5)


def test_more_layers_than_a_byte_counts() -> None:
    values = np.arange(400, dtype=np.float32).reshape(20, 20)
    stack = split_levels(DisparityMap(values, np.ones((20, 20), np.bool_)), threshold=0)
    np.testing.assert_array_equal(stack.labels, values + 1)


@given(st.lists(st.booleans(), max_size=40))
def test_runs_are_maximal(samples: list[bool]) -> None:
    found = runs(np.array(samples, np.bool_))
    covered = {index for first, last in found for index in range(first, last + 1)}
    assert {index for index, one in enumerate(samples) if one} <= covered
    for first, last in found:
        assert samples[first]
        assert samples[last]
        assert "00" not in "".join("01"[one] for one in samples[first : last + 1])
    for (_, last), (first, _) in pairwise(found):
        assert first - last > 2

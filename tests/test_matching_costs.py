"""Costs of the default matcher: every kernel against its plain twin, and small cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
import semiglobal_twins as twins
from numpy.typing import NDArray
from semiglobal_input import (
    LEVELS,
    LIMITS,
    joint_costs,
    low_parameter,
    random_bytes,
    size_parameter,
    steps_parameter,
    uniform_costs,
)

from mvcodec.kernels import census, matching_costs
from mvcodec.kernels.byte_vectors import LANES
from mvcodec.stereo.matching_view import blindness


@size_parameter
@pytest.mark.parametrize("along_rows", [True, False])
def test_sampling_intervals_equal_their_plain_twin(size: tuple[int, int], along_rows: bool) -> None:
    planes = random_bytes((size[0], 3, size[1]), 1)
    found = np.empty((size[0], 2, 3, size[1]), np.uint8)
    matching_costs.sampling_interval(planes, along_rows, found)
    np.testing.assert_array_equal(found, twins.sampling_interval(planes, along_rows=along_rows))


def test_sampling_interval_reaches_half_way_to_the_neighbours() -> None:
    ramp = np.array([[[0, 10, 41]]], np.uint8)
    found = np.empty((1, 2, 1, 3), np.uint8)
    matching_costs.sampling_interval(ramp, True, found)
    assert found[0, :, 0].tolist() == [[0, 5, 25], [5, 26, 41]]
    matching_costs.sampling_interval(ramp, False, found)  # across the baseline nothing changes
    assert found[0, :, 0].tolist() == [[0, 10, 41]] * 2


@size_parameter
@pytest.mark.parametrize("radii", [(1, 1), (2, 2), (4, 3)], ids=str)
def test_census_rows_equal_their_plain_twin(size: tuple[int, int], radii: tuple[int, int]) -> None:
    grey = random_bytes(size, 2, 20)
    expected = twins.census_rows(grey, *radii)
    found = np.full(expected.shape, 77, np.uint8)
    census.census_rows(grey, *radii, found)
    np.testing.assert_array_equal(found, expected)


@size_parameter
@low_parameter
@steps_parameter
def test_joint_costs_equal_their_plain_twin(
    size: tuple[int, int], low: int, steps: NDArray[np.float32]
) -> None:
    cameras = 1 + len(steps)
    planes = random_bytes((cameras, size[0], 3, size[1]), 3, spread=60)
    bits = random_bytes((cameras, size[0], 8, size[1]), 4)
    bounds = np.sort(random_bytes((2, cameras, size[0], 2, 3, size[1]), 5, spread=60), axis=3)
    blind = random_bytes((2, *size), 6, spread=60)
    across = steps[:, 0] != 0
    expected = twins.joint_costs(planes, bits, bounds, blind, across, steps, low, LIMITS, 6, 100, LEVELS)
    np.testing.assert_array_equal(joint_costs(planes, bits, bounds, blind, across, steps, low=low), expected)


def test_costs_of_windows_are_those_of_the_whole_picture() -> None:
    height, width, steps = 7, 150, np.array([(1, 0), (0, 2)], np.float32)
    planes, bits = random_bytes((3, height, 3, width), 3, spread=60), random_bytes((3, height, 8, width), 4)
    bounds = np.sort(random_bytes((2, 3, height, 2, 3, width), 5, spread=60), axis=3)
    given = planes, bits, bounds, random_bytes((2, height, width), 6, spread=60), steps[:, 0] != 0, steps
    whole = joint_costs(*given, low=-2)
    places = [(5, 0), (0, 3), (2, 130)]  # the last reaches beyond the right border
    found = joint_costs(*given, low=-2, windows=places)
    for number, (row, column) in enumerate(places):
        expected = whole[row : row + 2, column : column + LANES]
        shown = found[:, number * LANES :][:, : expected.shape[1]]
        np.testing.assert_array_equal(shown, expected)


def test_cost_adds_colour_and_census() -> None:
    # 3 channels of 5 grey levels, in twos; 4 bits of 2.
    assert (uniform_costs([5], [4], [(0, 0)]) == 7 + 8).all()
    assert (uniform_costs([-5], [4], [(0, 0)]) == 7 + 8).all()


def test_colour_and_census_are_truncated_each() -> None:
    assert (uniform_costs([100], [0], [(0, 0)]) == 30).all()
    assert (uniform_costs([0], [64], [(0, 0)]) == 90).all()
    assert (uniform_costs([100], [64], [(0, 0)]) == 120).all()


def test_two_best_partners_count_half_each() -> None:
    costs = uniform_costs([4, 6, 9, 20], [0] * 4, [(0, 0)] * 4)  # 6, 9, 13, 30
    assert (costs == 8).all()  # 7.5, rounded up


def test_a_partner_that_cannot_see_the_pixel_is_outvoted_at_lone_cost() -> None:
    assert (uniform_costs([4, 20], [0, 30], [(0, 0)] * 2) == 6 + 6).all()
    assert (uniform_costs([20, 4], [30, 0], [(0, 0)] * 2, lone_cost=3) == 6 + 3).all()


def test_only_partner_of_an_array_pays_no_lone_cost_but_the_only_one_in_frame_does() -> None:
    one = uniform_costs([4], [0], [(1, 0)])[0]
    assert one.T.tolist() == [[6] * 6, [100, *[6] * 5], [100, 100, *[6] * 4]]
    two = uniform_costs([4, 4], [0, 0], [(1, 0), (0, 1)])[0]  # a lower partner of one row: in frame at 0 px
    assert two.T.tolist() == [[6] * 6, [100, *[12] * 5], [100, 100, *[12] * 4]]


def test_a_match_in_a_direction_without_detail_does_not_outvote_the_other() -> None:
    beside_and_below: list[tuple[float, float]] = [(0, 0), (0, 1e-3)]
    assert (uniform_costs([0, 20], [0, 30], beside_and_below) == 6).all()
    assert (uniform_costs([0, 20], [0, 30], beside_and_below, blind_rows=40) == 40 + 6).all()


def test_of_a_blind_partner_counts_all_that_it_tells_where_it_is_the_only_one() -> None:
    costs = uniform_costs([0, 0], [0, 0], [(0, 0), (0, 1)], blind_rows=120)[0]  # below: in frame at 0 px
    assert costs.T.tolist() == [[6] * 6, [6 + 10] * 6, [6 + 10] * 6]


def test_a_direction_is_blind_where_edges_run_along_it() -> None:
    stripes = np.repeat(random_bytes((1, 40), 7), 30, axis=0)
    along_rows, along_columns = blindness(stripes, (4, 3), 60)
    assert not along_rows.any()
    assert (along_columns > 50).all()
    along_rows, along_columns = blindness(np.ascontiguousarray(stripes.T), (4, 3), 60)
    assert (along_rows > 50).all()
    assert not along_columns.any()
    assert not blindness(np.full((30, 40), 90, np.uint8), (4, 3), 60).any()

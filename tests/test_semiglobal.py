"""Semi-global matching: every kernel against its plain twin, and small cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
import semiglobal_twins as twins
from numpy.typing import NDArray

from mvcodec.kernels import completion, semiglobal

SIZES = [(7, 9), (1, 1), (1, 11), (8, 1), (4, 5)]
STEPS = {
    "right": [(1, 0)],
    "left": [(-1, 0)],
    "lower, rho 0.5": [(0, 0.5)],
    "upper, rho 2": [(0, -2)],
    "right and lower, rho 2": [(1, 0), (0, 2)],
    "all four, rho 0.5": [(0, -0.5), (-1, 0), (1, 0), (0, 0.5)],
}
LEVELS = 8
LIMITS = (60.5, 2.75, 90.5)  # colour_limit, bit_cost, bit_limit

size_parameter = pytest.mark.parametrize("size", SIZES, ids=str)
low_parameter = pytest.mark.parametrize("low", [-5, 0, 2])
steps_parameter = pytest.mark.parametrize(
    "steps", [np.array(steps, np.float32) for steps in STEPS.values()], ids=list(STEPS)
)


def planes(size: tuple[int, int], seed: int, spread: int = 256) -> NDArray[np.float32]:
    return np.random.default_rng(seed).integers(0, spread, (3, *size)).astype(np.float32)


def joint_costs(
    picture: NDArray[np.float32],
    census: NDArray[np.uint64],
    bounds: NDArray[np.float32],
    other_census: NDArray[np.uint64],
    steps: NDArray[np.float32],
    *,
    low: int,
    lone_cost: int = 12,
    levels: int = LEVELS,
) -> NDArray[np.uint8]:
    volume = np.full((*census.shape, levels), 77, np.uint8)
    semiglobal.joint_costs(picture, census, bounds, other_census, steps, low, *LIMITS, lone_cost, 100, volume)
    return volume


def uniform_costs(
    differences: list[float], bits: list[int], steps: list[tuple[float, float]], lone_cost: int = 12
) -> NDArray[np.uint8]:
    """Volume (1, 6, 3), low 0, where a partner differs by so much grey a channel and so many census bits."""
    bounds = np.stack([np.full((2, 3, 1, 6), difference, np.float32) for difference in differences])
    other_census = np.stack([np.full((1, 6), 2**count - 1, np.uint64) for count in bits])
    return joint_costs(
        np.zeros((3, 1, 6), np.float32),
        np.zeros((1, 6), np.uint64),
        bounds,
        other_census,
        np.array(steps, np.float32),
        low=0,
        lone_cost=lone_cost,
        levels=3,
    )


@size_parameter
@pytest.mark.parametrize("step", [(1, 0), (0, 1)], ids=["across", "down"])
def test_sampling_intervals_equal_their_plain_twin(size: tuple[int, int], step: tuple[int, int]) -> None:
    picture = planes(size, 1)
    found = semiglobal.sampling_interval(picture, *step)
    np.testing.assert_array_equal(found, twins.sampling_interval(picture, *step))


def test_sampling_interval_reaches_half_way_to_the_neighbours() -> None:
    ramp = np.broadcast_to(np.array([0, 10, 40], np.float32), (3, 1, 3)).copy()
    least, greatest = semiglobal.sampling_interval(ramp, 1, 0)
    assert least[0, 0].tolist() == [0, 5, 25]
    assert greatest[0, 0].tolist() == [5, 25, 40]
    assert (semiglobal.sampling_interval(ramp, 0, 1) == ramp).all()  # across the baseline nothing changes


@size_parameter
@low_parameter
@steps_parameter
def test_joint_costs_equal_their_plain_twin(
    size: tuple[int, int], low: int, steps: NDArray[np.float32]
) -> None:
    rng = np.random.default_rng(2)
    picture = planes(size, 3, spread=60)
    bounds = np.stack([twins.sampling_interval(planes(size, 4 + p, 60), 1, 0) for p in range(len(steps))])
    census, *other_census = rng.integers(0, 2**64, (1 + len(steps), *size), np.uint64)
    arguments = picture, census, bounds, np.stack(other_census), steps
    expected = twins.joint_costs(*arguments, low, LIMITS, 12, 100, LEVELS)
    np.testing.assert_array_equal(joint_costs(*arguments, low=low), expected)


def test_cost_adds_colour_and_census() -> None:
    # 3 channels of 5 grey levels, 4 bits of 2.75.
    assert (uniform_costs([5], [4], [(0, 0)]) == 15 + 11).all()
    assert (uniform_costs([-5], [4], [(0, 0)]) == 15 + 11).all()


def test_colour_and_census_are_truncated_each() -> None:
    assert (uniform_costs([200], [0], [(0, 0)]) == 60).all()
    assert (uniform_costs([0], [64], [(0, 0)]) == 90).all()
    assert (uniform_costs([200], [64], [(0, 0)]) == 151).all()


def test_two_best_partners_count_half_each() -> None:
    costs = uniform_costs([4, 6, 9, 20], [0] * 4, [(0, 0)] * 4)  # 12, 18, 27, 60
    assert (costs == 15).all()


def test_a_partner_that_cannot_see_the_pixel_is_outvoted_at_lone_cost() -> None:
    assert (uniform_costs([4, 20], [0, 30], [(0, 0)] * 2) == 12 + 12).all()
    assert (uniform_costs([20, 4], [30, 0], [(0, 0)] * 2, lone_cost=3) == 12 + 3).all()


def test_only_partner_of_an_array_pays_no_lone_cost_but_the_only_one_in_frame_does() -> None:
    one = uniform_costs([4], [0], [(1, 0)])[0]
    assert one.T.tolist() == [[12] * 6, [100, *[12] * 5], [100, 100, *[12] * 4]]
    two = uniform_costs([4, 4], [0, 0], [(1, 0), (0, 1)])[0]  # a lower partner of one row: in frame at 0 px
    assert two.T.tolist() == [[12] * 6, [100, *[24] * 5], [100, 100, *[24] * 4]]


@size_parameter
@pytest.mark.parametrize(("downwards", "steps"), [(True, twins.FORTH), (False, twins.BACK)])
def test_aggregate_equals_equation_13(
    size: tuple[int, int], downwards: bool, steps: tuple[tuple[int, int], ...]
) -> None:
    rng = np.random.default_rng(5)
    costs = rng.integers(0, 255, (*size, LEVELS), np.uint8)
    grey = rng.integers(0, 40, size).astype(np.float32)
    penalties = 35.0, 170.0, 50.0, 8.0
    # The first pass overwrites what it finds, the second adds to it.
    found = np.full(costs.shape, 1000, np.uint16)
    semiglobal.aggregate(costs, grey, *penalties, found, downwards)
    expected = semiglobal.PARTS * twins.aggregate(costs, grey, steps, penalties) + (0 if downwards else 1000)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("levels", [1, 2, 3])
@pytest.mark.parametrize(
    "penalties", [(0.0, 0.0, 0.0, 1.0), (9.0, 9.0, 9.0, 1.0), (2.0, 300.0, 0.0, 0.5)], ids=str
)
def test_both_passes_walk_all_eight_paths(levels: int, penalties: tuple[float, float, float, float]) -> None:
    rng = np.random.default_rng(6)
    costs = rng.integers(0, 255, (5, 6, levels), np.uint8)
    grey = rng.uniform(0, 255, (5, 6)).astype(np.float32)
    found = np.empty(costs.shape, np.uint16)
    for downwards in (True, False):
        semiglobal.aggregate(costs, grey, *penalties, found, downwards)
    expected = semiglobal.PARTS * twins.aggregate(costs, grey, twins.FORTH + twins.BACK, penalties)
    np.testing.assert_array_equal(found, expected)


def test_the_dearest_paths_fit_into_the_sums() -> None:
    costs = np.full((9, 9, 8), semiglobal.MAX_COST, np.uint8)
    costs[::2, :, 0] = costs[1::2, :, -1] = 0  # whichever way a path goes, it jumps or pays
    most = float(semiglobal.MAX_PENALTY)
    penalties = most, most, most, 1.0
    sums = np.empty(costs.shape, np.uint16)
    for downwards in (True, False):
        semiglobal.aggregate(costs, np.zeros((9, 9), np.float32), *penalties, sums, downwards)
    expected = twins.aggregate(costs, np.zeros((9, 9), np.float32), twins.FORTH + twins.BACK, penalties)
    np.testing.assert_array_equal(sums, semiglobal.PARTS * expected)


def test_what_one_pixel_knows_reaches_all_eight_ways() -> None:
    costs = np.full((7, 7, 3), 50, np.uint8)
    costs[3, 3, 1] = 0
    sums = np.empty(costs.shape, np.uint16)
    for downwards in (True, False):
        semiglobal.aggregate(costs, np.zeros((7, 7), np.float32), 20, 40, 10, 8, sums, downwards)
    prefers = sums[..., 1] < sums[..., 0]
    y, x = np.mgrid[-3:4, -3:4]
    assert (prefers == ((x == 0) | (y == 0) | (abs(x) == abs(y)))).all()


@size_parameter
@pytest.mark.parametrize("levels", [1, 2, LEVELS])
@pytest.mark.parametrize("spread", [3, 1000], ids=["many ties", "few ties"])
def test_winners_equal_their_plain_twin(size: tuple[int, int], levels: int, spread: int) -> None:
    sums = np.random.default_rng(7).integers(0, spread, (*size, levels)).astype(np.uint16)
    found = np.full(size, np.nan, np.float32)
    semiglobal.winners(sums, -4, found)
    np.testing.assert_allclose(found, twins.winners(sums, -4), atol=1e-6)


@pytest.mark.parametrize(
    ("sums", "expected"),
    [
        ([9, 3, 1, 3, 9], 2.0),
        ([9, 5, 1, 3, 9], 2.25),  # lines of slope 4 and -4 through (1, 5) and (3, 3)
        ([9, 3, 1, 5, 9], 1.75),
        ([9, 1, 1, 9, 9], 1.5),  # between a tie of neighbours
        ([1, 1, 1, 9, 9], 0.0),  # the first of equals; no fit at the ends
        ([9, 9, 9, 3, 1], 4.0),
        ([9, 1, 9, 1, 9], 1.0),
        ([5, 5, 5, 5, 5], 0.0),
    ],
)
def test_winner_is_placed_between_levels(sums: list[float], expected: float) -> None:
    found = np.empty((1, 1), np.float32)
    semiglobal.winners(np.array([[sums]], np.uint16), 0, found)
    assert found[0, 0] == expected


@pytest.mark.parametrize("centre", [1.6, 2.0, 2.3])
def test_winner_of_a_v_is_exact(centre: float) -> None:
    sums = np.rint(1000 * np.abs(np.arange(5) - centre))[None, None].astype(np.uint16)
    found = np.empty((1, 1), np.float32)
    semiglobal.winners(sums, -10, found)
    assert found[0, 0] == pytest.approx(centre - 10, abs=1e-5)


def near_maps(size: tuple[int, int], count: int, seed: int) -> NDArray[np.float32]:
    """Maps of -2..3 px in sixteenths, so that all cases of agreement occur."""
    return (np.random.default_rng(seed).integers(-32, 49, (count, *size)) / 16).astype(np.float32)


@size_parameter
@steps_parameter
@pytest.mark.parametrize("tolerance", [0.5, 1.0])
def test_confirmed_equals_its_plain_twin(
    size: tuple[int, int], steps: NDArray[np.float32], tolerance: float
) -> None:
    own, *others = near_maps(size, 1 + len(steps), 8)
    found = completion.confirmed(own, np.stack(others), steps, tolerance)
    np.testing.assert_array_equal(found, twins.confirmed(own, np.stack(others), steps, tolerance))


@pytest.mark.parametrize(
    ("others", "expected"),
    [
        ([2.0], True),
        ([3.0], True),  # within tolerance
        ([1.0], True),
        ([3.5], False),  # hidden there, and nobody else agrees
        ([0.5], False),  # seen through
        ([2.0, 9.0, 9.0, 9.0], True),  # being hidden is no objection
        ([2.0, 0.5], True),
        ([2.0, 0.5, 0.5], False),
        ([2.0, 2.0, 0.5, 0.5], True),
    ],
    ids=str,
)
def test_confirmation_weighs_agreement_against_seeing_through(others: list[float], expected: bool) -> None:
    maps = np.stack([np.full((1, 1), other, np.float32) for other in others])
    own = np.full((1, 1), 2.0, np.float32)
    assert completion.confirmed(own, maps, np.zeros((len(others), 2), np.float32), 1.0)[0, 0] == expected


def test_nobody_confirms_what_is_out_of_their_frame() -> None:
    own = np.full((1, 6), 2.0, np.float32)
    kept = completion.confirmed(own, own[None], np.array([(1, 0)], np.float32), 1.0)
    assert kept.tolist() == [[False, False, True, True, True, True]]


@size_parameter
@low_parameter
@steps_parameter
@pytest.mark.parametrize("share", [0.0, 0.6, 1.0], ids=["all invalid", "some valid", "all valid"])
def test_completion_costs_equal_their_plain_twin(
    size: tuple[int, int], low: int, steps: NDArray[np.float32], share: float
) -> None:
    own, *others = near_maps(size, 1 + len(steps), 9)
    valid, *others_valid = np.random.default_rng(10).uniform(size=(1 + len(steps), *size)) < share
    volume = np.full((*size, LEVELS), 77, np.uint8)
    arguments = own, valid, np.stack(others), np.stack(others_valid), steps, low, 7.25, 40.5, 90.0
    completion.completion_costs(*arguments, volume)
    np.testing.assert_array_equal(volume, twins.completion_costs(*arguments, LEVELS))


def test_without_evidence_every_disparity_is_equally_likely() -> None:
    nothing = np.zeros((4, 5), np.bool_)
    volume = np.full((4, 5, LEVELS), 77, np.uint8)
    maps = near_maps((4, 5), 2, 11)
    steps = np.array([(1, 0)], np.float32)
    completion.completion_costs(maps[0], nothing, maps[1:], nothing[None], steps, 0, 7, 40, 40, volume)
    assert (volume == 0).all()


def test_completion_rules_out_what_another_camera_sees_through() -> None:
    others = np.full((2, 1, 9), 1.0, np.float32)
    volume = np.full((1, 9, 5), 77, np.uint8)
    completion.completion_costs(
        np.zeros((1, 9), np.float32),
        np.zeros((1, 9), np.bool_),
        others,
        np.ones((2, 1, 9), np.bool_),
        np.array([(1, 0), (-1, 0)], np.float32),
        0,
        7,
        40,
        40,
        volume,
    )
    # Whatever stood at 3 px or nearer would hide the background, at 1 px, that both others see there.
    assert volume[0, 4].tolist() == [0, 0, 0, 80, 80]
    assert volume[0, 0].tolist() == [0, 0, 0, 40, 40]  # one of them looks past the frame

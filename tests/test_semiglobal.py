"""Semi-global matching: every kernel against its plain twin, and small cases worked by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import semiglobal_twins as twins
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.kernels import census, completion, matching_costs, semiglobal
from mvcodec.kernels.byte_vectors import LANES
from mvcodec.stereo import scanlines
from mvcodec.stereo.scanlines import MAX_SUM, Decided, Penalties, Scratch, decide

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
LIMITS = (30, 2, 45)  # colour_limit, bit_cost, most_bits

size_parameter = pytest.mark.parametrize("size", SIZES, ids=str)
low_parameter = pytest.mark.parametrize("low", [-5, 0, 2])
steps_parameter = pytest.mark.parametrize(
    "steps", [np.array(steps, np.float32) for steps in STEPS.values()], ids=list(STEPS)
)


def random_bytes(shape: tuple[int, ...], seed: int, spread: int = 256) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, spread, shape).astype(np.uint8)


def levels_second(volume: NDArray[Any]) -> NDArray[Any]:
    """Twins have (H, W, levels), kernels (H, levels, W)."""
    return np.ascontiguousarray(volume.transpose(0, 2, 1))


def joint_costs(
    planes: NDArray[np.uint8],
    census: NDArray[np.uint8],
    bounds: NDArray[np.uint8],
    across: NDArray[np.bool_],
    steps: NDArray[np.float32],
    *,
    low: int,
    lone_cost: int = 6,
    levels: int = LEVELS,
) -> NDArray[np.uint8]:
    """Of camera 0 against all others: (H, W, levels)."""
    width = planes.shape[3]
    columns = -(-width // LANES) * LANES
    volume = np.full((planes.shape[1], levels, columns), 77, np.uint8)

    def with_borders(rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
        beyond = (LANES, columns - width + LANES)
        return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [beyond], constant_values=99)

    matching_costs.joint_costs(
        0,
        np.arange(1, len(planes)),
        with_borders(planes),
        with_borders(census),
        across,
        with_borders(bounds),
        width,
        steps,
        low,
        *LIMITS,
        lone_cost,
        100,
        0,
        volume,
    )
    return volume[..., :width].transpose(0, 2, 1)


def uniform_costs(
    differences: list[int], bits: list[int], steps: list[tuple[float, float]], lone_cost: int = 6
) -> NDArray[np.uint8]:
    """Volume (1, 6, 3), low 0, where a partner differs by so much grey a channel and so many census bits."""
    cameras = 1 + len(steps)
    bounds = np.full((2, cameras, 1, 2, 3, 6), 100, np.uint8)
    census = np.zeros((cameras, 1, 8, 6), np.uint8)
    for camera, (difference, count) in enumerate(zip(differences, bits, strict=True), 1):
        bounds[:, camera] += np.uint8(difference % 256)
        census[camera] = np.packbits(np.arange(64) < count)[None, :, None]
    planes = np.full((cameras, 1, 3, 6), 100, np.uint8)
    where = np.array(steps, np.float32)
    across = np.ones(len(steps), np.bool_)
    return joint_costs(planes, census, bounds, across, where, low=0, lone_cost=lone_cost, levels=3)


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
    across = steps[:, 0] != 0
    expected = twins.joint_costs(planes, bits, bounds, across, steps, low, LIMITS, 6, 100, LEVELS)
    np.testing.assert_array_equal(joint_costs(planes, bits, bounds, across, steps, low=low), expected)


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


def decided(
    costs: NDArray[np.uint8],
    grey: NDArray[np.uint8],
    penalties: Penalties,
    steps: NDArray[np.float32] | None = None,
    low: int = 0,
) -> Decided:
    """Of an (H, W, levels) volume."""
    volume = levels_second(costs)

    def costs_of(first: int, found: NDArray[np.uint8]) -> None:
        found[..., : volume.shape[2]] = volume[first : first + len(found)]

    return decide(costs_of, grey, low, costs.shape[2], penalties, Scratch(), steps)


PENALTIES = Penalties(small_step=18, jump=85, least_jump=25, contrast=8)


@pytest.mark.parametrize("size", [*SIZES, (3, 70), (70, 2)], ids=str)
@pytest.mark.parametrize("diagonals", [True, False])
@pytest.mark.parametrize("band", [(128, 64), (4, 3), (5, 0)], ids=["one band", "looking ahead", "blind"])
def test_decisions_equal_those_by_equation_13(
    monkeypatch: pytest.MonkeyPatch, size: tuple[int, int], diagonals: bool, band: tuple[int, int]
) -> None:
    monkeypatch.setattr(scanlines, "BAND_ROWS", band[0])
    monkeypatch.setattr(scanlines, "LOOK_AHEAD", band[1])
    costs = random_bytes((*size, LEVELS), 5, 150)
    grey = random_bytes(size, 6, 40)
    penalties = replace(PENALTIES, diagonals=diagonals)
    paths = [step for step in twins.FORTH + twins.BACK if diagonals or 0 in step]
    steps = np.array([(1, 0), (0, -0.5)], np.float32)
    found = decided(costs, grey, penalties, steps, low=-2)
    sums = twins.decided_sums(costs, grey, penalties.jumps(), 18, paths, *band)
    np.testing.assert_allclose(found.disparity, twins.winners(sums, -2), atol=1e-6)
    for step, seen in zip(steps, found.partners, strict=True):
        np.testing.assert_array_equal(seen, twins.partner_winners(sums, -2, (step[0], step[1])))


@pytest.mark.parametrize("levels", [1, 2, 3])
@pytest.mark.parametrize("penalties", [(0, 0, 0, 1.0), (9, 9, 9, 1.0), (2, 180, 0, 0.5)], ids=str)
def test_few_levels_and_extreme_penalties(levels: int, penalties: tuple[int, int, int, float]) -> None:
    costs = random_bytes((5, 6, levels), 6, 73)
    grey = random_bytes((5, 6), 7)
    given = Penalties(*penalties)
    sums = twins.added_up(costs, grey, given.jumps(), penalties[0], twins.FORTH + twins.BACK)
    np.testing.assert_allclose(decided(costs, grey, given).disparity, twins.winners(sums, 0), atol=1e-6)


def test_the_dearest_paths_fit_into_8_bits() -> None:
    penalties = Penalties(small_step=100, jump=100, least_jump=100, contrast=1)
    costs = np.full((9, 9, 8), MAX_SUM - 200, np.uint8)
    costs[::2, :, 0] = costs[1::2, :, -1] = 0  # whichever way a path goes, it jumps or pays
    grey = np.zeros((9, 9), np.uint8)
    sums = twins.added_up(costs, grey, penalties.jumps(), 100, twins.FORTH + twins.BACK)
    np.testing.assert_allclose(decided(costs, grey, penalties).disparity, twins.winners(sums, 0), atol=1e-6)


def test_jumps_cost_half_at_the_contrast_and_never_less_than_the_least() -> None:
    jumps = PENALTIES.jumps()
    assert (jumps[0], jumps[8], jumps[24], jumps[255]) == (85, 43, 25, 25)


@pytest.mark.parametrize(
    ("penalties", "text"),
    [
        ((-1, 2, 3, 1.0), "penalties of at least 0"),
        ((1, 2, 3, 0.0), "contrast above 0"),
        ((100, 101, 3, 1.0), r"small_step \+ jump: found 201, expected at most 200"),
        ((100, 1, 101, 1.0), "found 201"),
    ],
)
def test_penalties_that_cannot_be_are_named(penalties: tuple[int, int, int, float], text: str) -> None:
    with pytest.raises(SettingError, match=text):
        Penalties(*penalties)


def test_what_one_pixel_knows_reaches_all_eight_ways() -> None:
    costs = np.full((7, 7, 3), 50, np.uint8)
    costs[3, 3, 1] = 0
    found = decided(costs, np.zeros((7, 7), np.uint8), Penalties(20, 40, 10, 8)).disparity
    y, x = np.mgrid[-3:4, -3:4]
    assert (np.rint(found) == ((x == 0) | (y == 0) | (abs(x) == abs(y)))).all()


@size_parameter
@pytest.mark.parametrize("levels", [1, 2, LEVELS])
@pytest.mark.parametrize("spread", [3, 1000], ids=["many ties", "few ties"])
def test_winners_equal_their_plain_twin(size: tuple[int, int], levels: int, spread: int) -> None:
    sums = np.random.default_rng(7).integers(0, spread, (*size, levels)).astype(np.uint16)
    found = np.full(size, np.nan, np.float32)
    semiglobal.winners(levels_second(sums), -4, found)
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
    semiglobal.winners(np.array([[sums]], np.uint16).transpose(0, 2, 1).copy(), 0, found)
    assert found[0, 0] == expected


@pytest.mark.parametrize("centre", [1.6, 2.0, 2.3])
def test_winner_of_a_v_is_exact(centre: float) -> None:
    sums = np.rint(1000 * np.abs(np.arange(5) - centre))[None, None].astype(np.uint16)
    found = np.empty((1, 1), np.float32)
    semiglobal.winners(levels_second(sums), -10, found)
    assert found[0, 0] == pytest.approx(centre - 10, abs=1e-5)


def parts_of_maps(size: tuple[int, int], count: int, seed: int) -> NDArray[np.int16]:
    """Maps of -2..3 px in sixteenths."""
    return np.random.default_rng(seed).integers(-32, 49, (count, *size)).astype(np.int16)


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
    own, *others = parts_of_maps(size, 1 + len(steps), 9)
    valid, *others_valid = np.random.default_rng(10).uniform(size=(1 + len(steps), *size)) < share
    behind = np.where(others_valid, others, completion.NOWHERE)
    volume = np.full((size[0], LEVELS, size[1]), 77, np.uint8)
    arguments = own, valid, behind, steps, low, 7.25, 40, 90, 200
    for start in range(0, size[0], 3):
        completion.completion_costs(*arguments, start, volume[start : start + 3])
    np.testing.assert_array_equal(volume.transpose(0, 2, 1), twins.completion_costs(*arguments, LEVELS))


def test_without_evidence_every_disparity_is_equally_likely() -> None:
    nothing = np.zeros((4, 5), np.bool_)
    volume = np.full((4, LEVELS, 5), 77, np.uint8)
    maps = parts_of_maps((4, 5), 2, 11)
    hidden = np.full((1, 4, 5), completion.NOWHERE)
    steps = np.array([(1, 0)], np.float32)
    completion.completion_costs(maps[0], nothing, hidden, steps, 0, 7, 40, 40, 200, 0, volume)
    assert (volume == 0).all()


def test_completion_rules_out_what_another_camera_sees_through() -> None:
    others = np.full((2, 1, 9), completion.PARTS, np.int16)
    volume = np.full((1, 5, 9), 77, np.uint8)
    completion.completion_costs(
        np.zeros((1, 9), np.int16),
        np.zeros((1, 9), np.bool_),
        others,
        np.array([(1, 0), (-1, 0)], np.float32),
        0,
        7,
        40,
        40,
        200,
        0,
        volume,
    )
    # Whatever stood at 3 px or nearer would hide the background, at 1 px, that both others see there.
    assert volume[0, :, 4].tolist() == [0, 0, 0, 80, 80]
    assert volume[0, :, 0].tolist() == [0, 0, 0, 40, 40]  # one of them looks past the frame

"""Semi-global matching: every kernel against its plain twin, and small cases worked by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import semiglobal_twins as twins
from numpy.typing import NDArray
from semiglobal_input import (
    LEVELS,
    SIZES,
    levels_second,
    low_parameter,
    random_bytes,
    size_parameter,
    steps_parameter,
)

from mvcodec.errors import SettingError
from mvcodec.kernels import completion, semiglobal
from mvcodec.stereo import scanlines
from mvcodec.stereo.scanlines import MAX_SUM, Decided, Penalties, Scratch, decide


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


def test_parts_of_pictures_side_by_side_are_decided_as_each_alone() -> None:
    costs, grey = random_bytes((6, 140, LEVELS), 5, 150), random_bytes((6, 140), 6, 40)
    volume, penalties = levels_second(costs), replace(PENALTIES, diagonals=False)

    def costs_of(first: int, found: NDArray[np.uint8]) -> None:
        found[..., :140] = volume[first : first + len(found)]

    begins = [0, 64, 70]
    together = decide(costs_of, grey, 0, LEVELS, penalties, Scratch(), begins=begins).disparity
    for first, end in zip(begins, [*begins[1:], 140], strict=True):
        part = slice(first, end)
        alone = decided(costs[:, part], grey[:, part], penalties).disparity
        np.testing.assert_array_equal(together[:, part], alone)


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
    asked = random_bytes(size, 9) < 200
    given = own, asked, np.stack(others), steps, tolerance
    np.testing.assert_array_equal(completion.confirmed(*given), twins.confirmed(*given))


@size_parameter
@steps_parameter
def test_seen_through_equals_its_plain_twin(size: tuple[int, int], steps: NDArray[np.float32]) -> None:
    own, *others = near_maps(size, 1 + len(steps), 8)
    asked, sure = random_bytes(size, 9) < 200, random_bytes((len(steps), *size), 10) < 150
    given = own, asked, np.stack(others), sure, steps, 1.0
    np.testing.assert_array_equal(completion.seen_through(*given), twins.seen_through(*given))


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
    own, asked = np.full((1, 1), 2.0, np.float32), np.ones((1, 1), np.bool_)
    steps = np.zeros((len(others), 2), np.float32)
    assert completion.confirmed(own, asked, maps, steps, 1.0)[0, 0] == expected


def test_nobody_confirms_what_is_out_of_their_frame() -> None:
    own, asked = np.full((1, 6), 2.0, np.float32), np.ones((1, 6), np.bool_)
    kept = completion.confirmed(own, asked, own[None], np.array([(1, 0)], np.float32), 1.0)
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

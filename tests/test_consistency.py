"""Left-right check, filling, specks and median: the thesis's equations and plain twins."""

from __future__ import annotations

import numpy as np
import pytest

from mvcodec.frames import FloatMap, Mask
from mvcodec.stereo.consistency import (
    confirmed_range,
    cross_check,
    drop_speckles,
    fill_from_farther,
    left_right_check,
    median,
)


def plain_check(
    values: FloatMap, known: Mask, other: FloatMap, other_known: Mask, partner_is_right: bool
) -> Mask:
    height, width = values.shape
    sign = 1 if partner_is_right else -1
    target = np.floor(np.arange(width)[None] - sign * values + 0.5).astype(int)
    inside = (target >= 0) & (target < width)
    target = target.clip(0, width - 1)
    rows = np.arange(height)[:, None]
    agrees = np.abs(values - other[rows, target]) <= 1
    return np.asarray(known & inside & other_known[rows, target] & agrees)


def plain_fill(values: FloatMap, valid: Mask) -> FloatMap:
    filled = values.copy()
    for y, x in np.argwhere(~valid):
        before = np.flatnonzero(valid[y, :x])
        after = np.flatnonzero(valid[y, x:])
        ends = [values[y, before[-1]]] if before.size else []
        ends += [values[y, x + after[0]]] if after.size else []
        filled[y, x] = min(ends)
    return filled


@pytest.mark.parametrize("partner_is_right", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_check_equals_its_plain_twin(seed: int, partner_is_right: bool) -> None:
    rng = np.random.default_rng(seed)
    shape = 13, 29
    values, other = (rng.uniform(-4, 4, shape).astype(np.float32) for _ in range(2))
    known, other_known = (rng.uniform(size=shape) < 0.8 for _ in range(2))
    found = left_right_check(values, known, other, other_known, partner_is_right=partner_is_right)
    assert 0 < found.sum() < found.size
    assert (found == plain_check(values, known, other, other_known, partner_is_right)).all()


def test_check_keeps_what_agrees_and_drops_what_looks_outside() -> None:
    known = np.ones((1, 6), np.bool_)
    left = np.array([[2, 2, 2, 2, 2, 2]], np.float32)
    right = np.array([[2, 2.9, 3.5, 2, 2, 2]], np.float32)
    found = left_right_check(left, known, right, known, partner_is_right=True)
    # x 0 and 1 lie outside; 2 -> 0 equal, 3 -> 1 within one pixel, 4 -> 2 not, 5 -> 3 equal.
    assert found.tolist() == [[False, False, True, True, False, True]]


@pytest.mark.parametrize("seed", range(5))
def test_fill_equals_its_plain_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.uniform(-9, 9, (11, 23)).astype(np.float32)
    valid = rng.uniform(size=values.shape) < 0.3
    valid[:, 7] = True
    assert (fill_from_farther(values, valid, 0.0) == plain_fill(values, valid)).all()


def test_fill_takes_the_farther_side() -> None:
    values = np.array([[9, 0, 0, 3, 0]], np.float32)
    valid = np.array([[True, False, False, True, False]])
    assert fill_from_farther(values, valid, 0.0).tolist() == [[9, 3, 3, 3, 3]]


def test_fill_takes_empty_rows_from_the_nearest_one() -> None:
    values = np.array([[5, 5], [0, 0], [0, 0], [7, 7]], np.float32)
    valid = np.array([[True] * 2, [False] * 2, [False] * 2, [True] * 2])
    assert fill_from_farther(values, valid, 0.0).tolist() == [[5, 5], [5, 5], [7, 7], [7, 7]]


def test_fill_without_anything_valid_is_the_fallback() -> None:
    filled = fill_from_farther(np.full((3, 4), np.nan, np.float32), np.zeros((3, 4), np.bool_), -2.5)
    assert (filled == -2.5).all()


@pytest.mark.parametrize("offset", [-200.0, 0.0, 1500.0])
def test_specks_are_dropped_and_slopes_kept(offset: float) -> None:
    values = np.broadcast_to(np.linspace(0, 20, 40, dtype=np.float32) + np.float32(offset), (30, 40)).copy()
    values[10:13, 10:13] += 30
    valid = np.ones(values.shape, np.bool_)
    kept = drop_speckles(values, valid, 20)
    assert not kept[10:13, 10:13].any()
    assert kept.sum() == values.size - 9
    assert drop_speckles(values, valid, 0).all()


@pytest.mark.parametrize("size", [0, 3, 5, 11])
def test_median_keeps_edges_and_removes_dots(size: int) -> None:
    values = np.full((40, 40), -3.0, np.float32)
    values[:, 20:] = 17.0
    dotted = values.copy()
    dotted[8, 8] = 12.0
    smooth = median(dotted, size, (-3.0, 17.0))
    if size == 0:
        assert (smooth == dotted).all()
    else:
        np.testing.assert_allclose(smooth, values, atol=20 / 255 / 2 + 1e-5)


def test_cross_check_finishes_both_maps() -> None:
    """A step of 6 px: the right camera hides 4 columns that the left one sees, and they are filled."""
    left = np.full((20, 40), 2.0, np.float32)
    left[:, 20:30] = 6.0
    right = np.full((20, 40), 2.0, np.float32)
    right[:, 14:24] = 6.0
    known = np.ones(left.shape, np.bool_)
    maps = cross_check((left, known), (right, known), (0.0, 8.0), median_size=0)
    assert not maps[0].valid[:, 16:20].any()  # seen by the left camera alone
    assert maps[0].valid[:, 20:30].all()
    assert (maps[0].values_px[:, 16:20] == 2).all()
    assert not maps[1].valid[:, 24:28].any()
    assert (maps[1].values_px[:, 24:28] == 2).all()


def test_the_confirmed_range_holds_all_but_few_pixels() -> None:
    values = np.full((100, 200), 20.0, np.float32)
    values[:50] = 31.4
    values[0, 0], values[0, 1:40] = 2, 44  # an error, and a small thing
    every = np.ones(values.shape, np.bool_)
    assert confirmed_range([(values, every)], (0.0, 60.0)) == (20.0, 44.0)
    assert confirmed_range([(values, every), (values - 5, every)], (0.0, 60.0)) == (15.0, 44.0)
    assert confirmed_range([(values, every & (values < 30))], (0.0, 60.0)) == (20.0, 20.0)
    assert confirmed_range([(values, ~every)], (-3.5, 60.0)) == (-3.5, 60.0)
    assert confirmed_range([(values - 40, every)], (-20.5, 4.5)) == (-20.0, 4.0)

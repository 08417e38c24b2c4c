"""Disparity of a view made in one go: the same as by its steps one after the other, wherever bands end."""

from __future__ import annotations

import numpy as np
import pytest
import view_twins as twins
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from view_kernel_input import in_bands, in_pairs, seeds, smoother, some_maps

from mvcodec.frames import FloatMap
from mvcodec.kernels import view_depth, view_planes, view_sweep

LIMITS = twins.Limits(tolerance=1.5, contrast=10, ratio=1.3, denial=0.6)
FALLBACK = -9.0


def swept(maps: NDArray[np.float32], ballot: twins.Ballot, reach: float = 0.54) -> FloatMap:
    out = np.full(maps.shape[1:], np.nan, np.float32)
    extents = np.array([view_planes.extent(disparity) for disparity in maps], np.float32)
    who = np.arange(len(maps)), maps, extents, in_pairs(ballot.lumas), ballot.shifts, ballot.weights
    in_bands(
        len(out),
        out,
        lambda *band: view_sweep.disparity_rows(*who, reach, *LIMITS, FALLBACK, out, *band),
    )
    return out


def as_it_is(disparity: FloatMap) -> FloatMap:
    """The view from the place of a single camera."""
    height, width = disparity.shape
    grey = np.zeros((1, height + 4, width + 4), np.float32)
    still, alone = np.zeros((1, 2), np.float32), np.ones(1, np.float32)
    return swept(disparity[None], twins.Ballot(disparity[None], grey, still, alone))


@settings(max_examples=80, deadline=None)
@given(
    seeds,
    st.tuples(st.integers(1, 90), st.integers(1, 40)),
    st.integers(1, 4),
    st.sampled_from([0.0, 0.2, 1.0]),
    st.sampled_from([0.5, 0.54, 0.99]),
)
def test_equals_its_steps(seed: int, shape: tuple[int, int], count: int, holes: float, reach: float) -> None:
    rng = np.random.default_rng(seed)
    maps = smoother(some_maps(rng, count, shape), rng)
    maps[rng.random(maps.shape) < holes] = np.nan
    lumas = rng.choice(np.array([7, 25, 90], np.float32), (count, shape[0] + 4, shape[1] + 4))
    shifts = (rng.integers(-16, 17, (count, 2)) / 8).astype(np.float32)
    weights = (rng.integers(1, 17, count) / 16).astype(np.float32)
    ballot = twins.Ballot(maps, lumas, shifts, weights)
    moved = np.empty((count, shape[0] + 2, shape[1] + 2 * view_depth.MARGIN), np.float32)
    for disparity, shift, out in zip(maps, shifts, moved, strict=True):
        view_depth.splat(disparity, shift[0], shift[1], reach, out)
    voted = np.empty(shape, np.float32)
    who = np.arange(count), maps, in_pairs(lumas), shifts, weights
    view_depth.vote(moved, -1, *who, *LIMITS, voted, -1, 0, shape[0])
    cleaned = twins.restore_thin(voted, LIMITS.tolerance, twins.median3(voted))
    np.testing.assert_array_equal(swept(maps, ballot, reach), twins.fill_background(cleaned, FALLBACK))


def test_a_line_outlives_the_median_and_a_stray_pixel_does_not() -> None:
    disparity = np.zeros((9, 9), np.float32)
    disparity[:, 4] = disparity[4, 7] = 8
    assert (twins.median3(disparity) == 0).all()
    cleaned = as_it_is(disparity)
    assert (cleaned[1:-1, 4] == 8).all()
    assert (np.delete(cleaned, 4, axis=1) == 0).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 30), (40, 1), (37, 53)])
def test_what_is_known_everywhere_is_smoothed_alone(shape: tuple[int, int]) -> None:
    slope = np.add.outer(np.arange(shape[0]) / 16, np.arange(shape[1]) / 8).astype(np.float32)
    np.testing.assert_array_equal(as_it_is(slope), twins.median3(slope))


def test_where_nothing_is_known_a_view_is_background() -> None:
    assert (as_it_is(np.full((20, 7), np.nan, np.float32)) == FALLBACK).all()


def test_the_extent_of_a_map() -> None:
    values = np.array([[np.nan, 3.5, -2], [np.nan, 7.25, np.nan]], np.float32)
    assert view_planes.extent(values) == (-2, 7.25)
    assert view_planes.extent(np.full((2, 3), np.nan, np.float32)) == (0, 0)

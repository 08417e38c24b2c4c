"""The vote on a view's disparity: the kernel against its plain twin, and small cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
import view_twins as twins
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from view_kernel_input import Shape, in_bands, in_pairs, seeds, shapes, some_maps

from mvcodec.frames import FloatMap
from mvcodec.kernels import view_depth

LIMITS = twins.Limits(tolerance=1.5, contrast=10, ratio=1.3, denial=0.6)


def voted(maps: NDArray[np.float32], ballot: twins.Ballot, limits: twins.Limits) -> FloatMap:
    out = np.full((maps.shape[1] - 2, maps.shape[2] - 2), np.nan, np.float32)
    cameras, margin = np.arange(len(maps)), view_depth.MARGIN - 1
    padded = np.pad(maps, ((0, 0), (0, 0), (margin, margin)), constant_values=77)
    who = cameras, ballot.maps, in_pairs(ballot.lumas), ballot.shifts, ballot.weights
    in_bands(out.shape[0], out, lambda *band: view_depth.vote(padded, -1, *who, *limits, out, -1, *band))
    return out


@settings(max_examples=60, deadline=None)
@given(
    seeds,
    shapes,
    st.integers(1, 4),
    st.sampled_from([0.0, 0.3, 1.0]),
    st.builds(
        twins.Limits,
        st.sampled_from([0.25, 1.5, 1000.0]),
        st.sampled_from([0.5, 20.5]),
        st.sampled_from([1.0, 1.5, 2.0]),
        st.sampled_from([0.0, 0.6]),
    ),
)
def test_vote(seed: int, shape: Shape, count: int, holes: float, limits: twins.Limits) -> None:
    rng = np.random.default_rng(seed)
    maps = some_maps(rng, count, (shape[0] + 2, shape[1] + 2), holes)
    lumas = rng.choice(np.array([7, 25, 90], np.float32), (count, shape[0] + 4, shape[1] + 4))
    shifts = (rng.integers(-8, 9, (count, 2)) / 7).astype(np.float32)
    weights = (rng.integers(1, 17, count) / 16).astype(np.float32)
    ballot = twins.Ballot(some_maps(rng, count, shape), lumas, shifts, weights)
    found, expected = voted(maps, ballot, limits), twins.vote(maps, ballot, limits)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4)
    assert holes < 1 or (found == view_depth.UNKNOWN).all()


@pytest.mark.parametrize(
    ("disparities", "weights", "expected"),
    [
        ([3.0, 3.0, 3.0, 20.0], [1, 1, 1, 1], 3.0),
        ([3.0, 3.0, 20.0, 20.0], [1, 1, 1, 1], 20.0),
        ([3.0, 3.0, 20.0, 20.0], [2, 2, 1, 1], 3.0),
        ([-5.0, -4.0], [1, 3], -4.25),
        ([4.0, 3.0, 2.0], [1, 1, 1], 3.5),  # 2 is not within 1.5 px of 4, and alone
        ([twins.UNKNOWN, -7.0, twins.UNKNOWN], [1, 0.125, 1], -7.0),
        ([20.0, 10.0, 0.0], [1, 1.25, 1.25], 20.0),
        ([20.0, 10.0, 0.0], [1, 1.25, 1.5], 0.0),
        ([20.0, 10.0, 0.0], [1, 1.5, 1.75], 10.0),  # 0 is measured against 10, the winner so far
    ],
)
def test_vote_of_one_pixel(disparities: list[float], weights: list[float], expected: float) -> None:
    maps = np.full((len(disparities), 3, 3), twins.UNKNOWN, np.float32)
    maps[:, 1, 1] = disparities
    count = len(disparities)
    hidden = np.full((count, 1, 1), 1000, np.float32)  # nobody sees through anything
    grey, still = np.zeros((count, 5, 5), np.float32), np.zeros((count, 2), np.float32)
    ballot = twins.Ballot(hidden, grey, still, np.array(weights, np.float32))
    assert voted(maps, ballot, LIMITS)[0, 0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("beyond", "luma", "expected"),
    [
        (2.0, 99.0, 2.0),  # the other camera sees the background where the near surface would stand
        (2.0, 55.0, 20.0),  # but the picture there is that of the near surface: its map is wrong
        (20.0, 99.0, 20.0),  # it sees something else as near there
        (30.0, 99.0, 20.0),  # something nearer hides the place from it
    ],
)
def test_a_near_surface_that_another_camera_sees_through_loses(
    beyond: float, luma: float, expected: float
) -> None:
    maps = np.full((2, 3, 12), twins.UNKNOWN, np.float32)
    maps[:, 1, 1] = 20, 2
    said = np.full((2, 1, 10), 2, np.float32)
    lumas = np.full((2, 5, 14), 50, np.float32)
    said[1, 0, 5], lumas[1] = beyond, luma
    shifts = np.array([[-0.25, 0], [0.25, 0]], np.float32)  # at 20 px, the second camera's column is 5
    ballot = twins.Ballot(said, lumas, shifts, np.ones(2, np.float32))
    assert voted(maps, ballot, LIMITS)[0, 0] == expected

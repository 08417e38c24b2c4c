"""Small pieces of a map or of a view that contradict all around them give way to that; larger ones stay."""

from __future__ import annotations

import numpy as np
import pytest
import view_twins as twins
from plane_scene import Plane, PlaneScene
from stereo_scene import linear_or_grid

from mvcodec.array import Viewpoint
from mvcodec.frames import FloatMap
from mvcodec.kernels.specks import smooth_over
from mvcodec.stereo.consistency import without_specks
from mvcodec.synthesis.layered import Layered, LayeredSettings


def smoothed(disparity: FloatMap, step: float = 1.5, reach: int = 1, fewest: int = 30) -> FloatMap:
    out, cut = disparity.copy(), len(disparity) // 3
    for first, last in ((cut, len(disparity)), (0, cut)):
        smooth_over(disparity, step, reach, fewest, out, first, last)
    return out


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("reach", [1, 2])
@pytest.mark.parametrize("fewest", [1, 2, 9, 30])
def test_equals_its_plain_twin(seed: int, reach: int, fewest: int) -> None:
    rng = np.random.default_rng(seed)
    disparity = (rng.integers(0, 3, (13, 17)) * rng.choice([1.0, 2.0, 5.0])).astype(np.float32)
    disparity += rng.uniform(0, 0.4, disparity.shape).astype(np.float32)
    expected = twins.smooth_over(disparity, 1.5, reach, fewest)
    np.testing.assert_array_equal(smoothed(disparity, 1.5, reach, fewest), expected)


@pytest.mark.parametrize("height", [-6, 6])
def test_a_speck_takes_what_is_around_and_a_larger_piece_stays(height: float) -> None:
    disparity = np.full((40, 60), 3, np.float32)
    disparity[0:5, 0:5] = disparity[20:25, 30:35] = 3 + height
    assert (smoothed(disparity) == 3).all()
    disparity[20:25, 30:36] = 3 + height
    found = smoothed(disparity)
    assert (found[20:25, 30:36] == 3 + height).all()
    assert (found[:10] == 3).all()


def test_specks_side_by_side_are_smoothed_over_as_one() -> None:
    disparity = np.full((30, 30), 3, np.float32)
    disparity[10:18, 10:18] = 12
    disparity[10:18:2, 10:18] = 20
    disparity[13, 13] = 40
    assert (smoothed(disparity) == 3).all()


def test_a_slanted_wire_is_one_piece_and_stays() -> None:
    disparity = np.full((60, 60), 3, np.float32)
    disparity[np.arange(40) + 5, np.arange(40) + 8] = 12
    np.testing.assert_array_equal(smoothed(disparity), disparity)


def test_pieces_of_a_broken_wire_are_one_in_a_map() -> None:
    disparity = np.full((20, 80), 3, np.float32)
    disparity[10, 5:75] = 12
    disparity[10, 5:75:5] = 3
    np.testing.assert_array_equal(without_specks(disparity, 30), disparity)
    assert (smoothed(disparity) == 3).all()


def test_a_view_has_no_specks_where_a_map_has_them() -> None:
    scene = PlaneScene(linear_or_grid(1, 2, 90, 60), 4, (Plane(12, (15, 30, 45, 70)),))
    decoded = scene.decoded()
    for found in decoded.disparities.values():
        found.values_px[20:24, 50:54] = 4
        found.values_px[50:53, 20:24] = 12
    viewpoint = Viewpoint(0, 0.5)
    truth = {}
    for area in (1, LayeredSettings().speck_area_px):
        view = Layered(LayeredSettings(speck_area_px=area, denial=0)).render(decoded, viewpoint)
        truth[area] = np.count_nonzero(smoothed(view.disparity_px) != view.disparity_px)
    assert truth[1] > 20
    assert truth[LayeredSettings().speck_area_px] == 0

"""Linear interpolation of one pair: mapping, weights, holes, order."""

from __future__ import annotations

import numpy as np
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Viewpoint
from mvcodec.frames import DisparityMap
from mvcodec.synthesis.linear import Linear, LinearSettings
from mvcodec.synthesis.mlvs import View


def row_view(grey: list[int], disparity: list[float], invalid: tuple[int, ...] = ()) -> View:
    pixels = np.repeat(np.array(grey, np.uint8)[None, :, None], 3, axis=2)
    valid = np.array([[x not in invalid for x in range(len(grey))]])
    return View(
        pixels, DisparityMap(np.array([disparity], np.float32), valid), np.ones((1, len(grey)), np.uint8)
    )


def grey(view: View) -> list[int]:
    return [int(value) for value in view.pixels[0, :, 1]]


def test_weights_and_places_of_equation_4_4() -> None:
    left = row_view([10, 20, 30, 40, 50, 60], [4] * 6)
    right = row_view([110, 120, 130, 140, 150, 160], [4] * 6)
    view = Linear().synthesize_pair(left, right, 0.25, 1.0)
    # Pixels 4 and 5 are at 0 and 1 in the right picture: 0.75 * 50 + 0.25 * 110 and 0.75 * 60 + 0.25 * 120.
    assert grey(view) == [20, 30, 40, 65, 75, 0]
    assert view.seen_by[0].tolist() == [1, 1, 1, 2, 2, 0]


def test_nearest_is_drawn_last_and_invalid_pixels_not_at_all() -> None:
    left = row_view([10, 20, 30, 40, 50, 60], [0, 0, 2, 0, 2, 0], invalid=(4,))
    view = Linear().synthesize_pair(left, left, 1.0, 1.0)
    # At beta 1 only the right picture's colour counts: pixel 2 is drawn at 0, over pixel 0.
    assert grey(view) == [10, 20, 0, 40, 0, 60]
    assert view.disparity.values_px[0, 0] == 2
    assert view.disparity.valid[0].tolist() == [True, True, False, True, False, True]


def test_holes_are_black_unless_filling_is_asked_for() -> None:
    left = row_view([10, 20, 30, 40], [0, 0, 0, 0], invalid=(1, 2))
    assert grey(Linear().synthesize_pair(left, left, 0.5, 1.0)) == [10, 0, 0, 40]
    filled = Linear(LinearSettings(fill=True)).synthesize_pair(left, left, 0.5, 1.0)
    assert grey(filled) == [10, 10, 40, 40]
    assert filled.seen_by[0].tolist() == [2, 0, 0, 2]


def test_absurd_disparity_lands_nowhere() -> None:
    left = row_view([10, 20, 30], [0, 3e38, -3e38])
    assert grey(Linear().synthesize_pair(left, left, 0.5, 1.0)) == [10, 0, 0]


@pytest.mark.parametrize("shift", [0, -24])
def test_planes_come_out_exactly_where_both_cameras_see(shift: int) -> None:
    scene = PlaneScene(grid(1, 5, 160, 90, step=4), 4 + shift, (Plane(20 + shift, (30, 70, 80, 130)),))
    viewpoint = Viewpoint(0, 3)
    truth, _ = scene.render(viewpoint)
    both = scene.seen_from(viewpoint, (0, 0)) & scene.seen_from(viewpoint, (0, 4))
    rendered = Linear().render(scene.decoded(), viewpoint)
    np.testing.assert_array_equal(rendered.pixels[both], truth[both])

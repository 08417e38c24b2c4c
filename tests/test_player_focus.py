"""A focus averages views around the viewpoint: what it is set to stays sharp."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from plane_scene import PlaneScene, grid

from mvcodec.array import Viewpoint
from mvcodec.frames import RenderedView
from mvcodec.player.focus import LENS_CELLS, LENS_VIEWS, lens_around, through_lens

ARRAY = grid(3, 5, 96, 64, step=2)
WALL_PX = 12.0
MARGIN_PX = 8


def wall(place: Viewpoint) -> RenderedView:
    """A view of a wall with waves, all at one disparity."""
    across, down = (WALL_PX * shift for shift in ARRAY.shift_per_disparity((0, 0), place))
    y, x = np.mgrid[: ARRAY.height, : ARRAY.width]
    grey = np.rint(128 + 100 * np.sin((x + across) / 2) * np.sin((y + down) / 2)).astype(np.uint8)
    shape = grey.shape
    return RenderedView(
        place, np.dstack([grey] * 3), np.full(shape, WALL_PX, np.float32), np.full(shape, 4, np.uint8)
    )


def test_what_is_in_focus_stays_sharp_and_the_more_it_is_away_the_more_it_blurs() -> None:
    place = Viewpoint(1.0, 2.0)
    decoded = PlaneScene(ARRAY, 4).decoded()
    views = [wall(viewpoint) for viewpoint in lens_around(ARRAY, place)]
    inside = slice(MARGIN_PX, -MARGIN_PX)

    def contrast(focus_px: float) -> float:
        return float(through_lens(decoded, views, place, focus_px)[inside, inside].std())

    whole = float(wall(place).pixels[inside, inside].std())
    assert contrast(WALL_PX) > 0.85 * whole  # each view is read between its pixels
    assert contrast(WALL_PX) > 1.2 * contrast(2 * WALL_PX) > 1.2 * 1.2 * contrast(3 * WALL_PX)


@given(st.floats(0, 2), st.floats(0, 4))
def test_a_lens_lies_within_the_array_and_a_part_of_a_cell(row: float, col: float) -> None:
    lens = lens_around(ARRAY, Viewpoint(row, col))
    assert len(lens) == LENS_VIEWS**2
    for place in lens:
        ARRAY.check_viewpoint(place)
        assert max(abs(place.row - row), abs(place.col - col)) <= LENS_CELLS  # half of two steps each way


def test_an_array_of_one_row_has_a_lens_of_one_row() -> None:
    lens = lens_around(grid(1, 5, 96, 64, step=2), Viewpoint(0.0, 2.0))
    assert len(lens) == LENS_VIEWS
    assert {place.row for place in lens} == {0.0}

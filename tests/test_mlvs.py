"""MLVS: which level renders what, both routes to the middle, arrays of one row or column, shared cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, Mask
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings
from mvcodec.synthesis import mlvs
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.linear import Linear, LinearSettings
from mvcodec.synthesis.mlvs import Route, View
from mvcodec.synthesis.synthesizer import Synthesizer

PLANES = (Plane(16, (10, 60, 70, 110)), Plane(24, (50, 90, 100, 140)))


def both_methods(route: Route) -> tuple[Synthesizer, ...]:
    return Dils(DilsSettings(route=route)), Linear(LinearSettings(route=route))


def seen_from_all(scene: PlaneScene, viewpoint: Viewpoint, route: Route) -> Mask:
    """Pixels that the cell's cameras see, and the two views between which level 3 works."""
    cell = scene.array.cell_at(viewpoint)
    seen = np.ones((scene.array.height, scene.array.width), np.bool_)
    for camera in cell.cameras:
        seen &= scene.seen_from(viewpoint, camera)
    row, col = int(viewpoint.row), int(viewpoint.col)
    upper_lower = ((cell.top, col), (cell.bottom, col))
    left_right = ((row, cell.left), (row, cell.right))
    for between in upper_lower if route is Route.UPPER_LOWER else left_right:
        seen &= scene.seen_from(viewpoint, between)
    return seen


def test_levels_of_a_dense_grid() -> None:
    array = grid(5, 5, 32, 24, step=2)
    levels = [[mlvs.level(array, Viewpoint(row, col)) for col in range(5)] for row in range(5)]
    assert levels == [[0, 1, 0, 1, 0], [2, 3, 2, 3, 2], [0, 1, 0, 1, 0], [2, 3, 2, 3, 2], [0, 1, 0, 1, 0]]
    assert mlvs.level(array, Viewpoint(2, 0.5)) == 1
    assert mlvs.level(array, Viewpoint(0.25, 4)) == 2
    with pytest.raises(SettingError, match="viewpoint"):
        mlvs.level(array, Viewpoint(4.1, 0))


@pytest.mark.parametrize("rho", [1.0, 0.5, 1.5])
@pytest.mark.parametrize("route", Route)
def test_every_view_of_a_cell_is_exact_where_all_see(route: Route, rho: float) -> None:
    scene = PlaneScene(grid(5, 5, 150, 110, step=4, rho=rho), 8, PLANES)
    decoded = scene.decoded()
    for row, col in ((0, 1), (4, 2), (2, 0), (2, 4), (2, 2), (2, 3)):
        viewpoint = Viewpoint(row, col)
        truth, depth = scene.render(viewpoint)
        seen = seen_from_all(scene, viewpoint, route)
        assert seen.mean() > 0.4
        for method in both_methods(route):
            view = method.render(decoded, viewpoint)
            np.testing.assert_array_equal(view.pixels[seen], truth[seen])
            np.testing.assert_array_equal(view.disparity_px[seen], depth[seen])
            expected = 4 if mlvs.level(scene.array, viewpoint) == 3 else 2
            assert (view.seen_by[seen] == expected).all()


def test_routes_differ_only_in_the_middle() -> None:
    scene = PlaneScene(grid(3, 3, 90, 70, step=2), 4, (Plane(20, (20, 30, 50, 60)),))
    decoded = scene.decoded()
    for row, col, differ in ((0, 1, False), (1, 0, False), (2, 1, False), (1, 1, True)):
        by_route = [Dils(DilsSettings(route=route)).render(decoded, Viewpoint(row, col)) for route in Route]
        assert (not np.array_equal(by_route[0].pixels, by_route[1].pixels)) == differ


def test_cells_with_other_spacing_in_rows_than_in_columns() -> None:
    scene = PlaneScene(grid(5, 5, 150, 110, step=4, row_step=2), 8, PLANES)
    assert scene.array.cell_rho == 0.5
    viewpoint = Viewpoint(3, 2)
    truth, _ = scene.render(viewpoint)
    seen = seen_from_all(scene, viewpoint, Route.UPPER_LOWER)
    view = Dils().render(scene.decoded(), viewpoint)
    np.testing.assert_array_equal(view.pixels[seen], truth[seen])


@pytest.mark.parametrize(("shape", "only_level"), [((1, 5), 1), ((5, 1), 2)])
def test_arrays_of_one_row_or_column_need_one_level(shape: tuple[int, int], only_level: int) -> None:
    scene = PlaneScene(grid(*shape, 120, 120, step=4), 8, (Plane(16, (40, 40, 80, 80)),))
    assert {mlvs.level(scene.array, Viewpoint(*place)) for place in scene.array.positions} == {0, only_level}
    viewpoint = Viewpoint(shape[0] // 2, shape[1] // 2)
    truth, _ = scene.render(viewpoint)
    seen = scene.seen_from(viewpoint, (0, 0)) & scene.seen_from(viewpoint, scene.array.real[1])
    view = Dils().render(scene.decoded(), viewpoint)
    np.testing.assert_array_equal(view.pixels[seen], truth[seen])


def test_a_method_of_ones_own_runs_through_the_levels() -> None:
    """Any PairSynthesizer will do: this one records what it is asked for."""

    class Recorder:
        def __init__(self) -> None:
            self.asked: list[tuple[float, float, tuple[int, ...]]] = []

        def synthesize_pair(self, left: View, right: View, beta: float, px_per_disparity: float) -> View:
            assert left.pixels.shape == right.pixels.shape
            self.asked.append((beta, px_per_disparity, left.pixels.shape))
            return left

    scene = PlaneScene(grid(5, 5, 30, 20, step=4, rho=0.5), 4)
    recorder = Recorder()
    viewpoint = Viewpoint(1, 3)
    view = mlvs.render(scene.decoded(), viewpoint, recorder)
    assert recorder.asked == [(0.75, 1.0, (20, 30, 3)), (0.75, 1.0, (20, 30, 3)), (0.25, 0.5, (30, 20, 3))]
    np.testing.assert_array_equal(view.pixels, scene.decoded().pictures[0, 0])
    assert view.viewpoint == viewpoint


@pytest.mark.parametrize("route", Route)
def test_strips_that_no_pair_covers_are_filled_at_level_3(route: Route) -> None:
    """Level 1's filled strip of columns is a strip of holes alone for an upper-lower pair."""
    scene = PlaneScene(grid(3, 3, 60, 50, step=2), 10)
    view = Dils(DilsSettings(route=route)).render(scene.decoded(), Viewpoint(1, 1))
    # The textures have no black.
    assert (view.pixels > 0).all()
    assert (view.seen_by[-5:, -5:] == 0).all()


@pytest.mark.parametrize("rho", [1.0, 0.5, 1.5])
@pytest.mark.parametrize("route", Route)
def test_pictures_can_be_matched_again_at_every_level(route: Route, rho: float) -> None:
    """With maps that say nothing, only matching the pictures themselves finds the planes."""
    scene = PlaneScene(grid(3, 3, 150, 110, step=2, rho=rho), 8, (Plane(16, (30, 30, 80, 110)),))
    truthful = scene.decoded()
    nothing = DisparityMap(np.zeros((110, 150), np.float32), np.ones((110, 150), np.bool_))
    decoded = replace(truthful, disparities=dict.fromkeys(truthful.pictures, nothing))
    matcher = FixedWindow(FixedWindowSettings("census", 7, median_size=5))
    inside = np.s_[15:-25, 15:-25]
    for row, col in ((0, 1), (1, 0), (1, 1)):
        viewpoint = Viewpoint(row, col)
        truth, _ = scene.render(viewpoint)
        for method, again in (
            (
                Dils(DilsSettings("levels", route=route)),
                Dils(DilsSettings("levels", route=route, rematch=matcher)),
            ),
            (
                Linear(LinearSettings(fill=True, route=route)),
                Linear(LinearSettings(fill=True, route=route, rematch=matcher)),
            ),
        ):
            wrong, right = (
                np.mean((m.render(decoded, viewpoint).pixels != truth)[inside]) for m in (method, again)
            )
            assert right < 0.2
            assert wrong > 0.7

"""The default renderer on planes that face the cameras: what must be exact is exact."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from layered_scenes import (
    box_scene,
    certain,
    contours,
    grown,
    outside_px,
    render,
    seen_by_any,
    smooth_view,
    used,
    with_disparities,
    without,
)
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet

PLANES = (Plane(16, (10, 60, 70, 110)), Plane(24, (50, 90, 100, 140)))


@pytest.mark.parametrize("camera", [(0, 0), (0, 4), (4, 0), (4, 4)])
def test_a_real_camera_gives_its_picture_and_map(camera: Position) -> None:
    decoded = PlaneScene(grid(5, 5, 150, 110, step=4), 8, PLANES).decoded()
    view = render(decoded, *camera)
    np.testing.assert_array_equal(view.pixels, decoded.pictures[camera])
    np.testing.assert_array_equal(view.disparity_px, decoded.disparities[camera].values_px)
    assert (view.seen_by == 1).all()
    view.pixels[:] = 0
    view.disparity_px[:] = 0
    assert decoded.pictures[camera].any()
    assert decoded.disparities[camera].values_px.any()


@pytest.mark.parametrize("rho", [1.0, 0.5, 1.5])
@pytest.mark.parametrize("planes", [(-8, PLANES), (8, PLANES), (-24, (Plane(-8, (10, 40, 70, 110)),))])
def test_whole_shifts_come_out_exactly(planes: tuple[int, tuple[Plane, ...]], rho: float) -> None:
    """Everything that some camera sees is exact, but for the near side of contours."""
    scene = PlaneScene(grid(5, 5, 150, 110, step=4, rho=rho), *planes)
    decoded = scene.decoded()
    for row, col in ((0, 1), (4, 2), (2, 0), (2, 4), (2, 2), (2, 3)):
        viewpoint = Viewpoint(row, col)
        truth, depth = scene.render(viewpoint)
        view = render(decoded, row, col)
        safe = seen_by_any(scene, viewpoint, used(scene.array, viewpoint)) & certain(depth)
        assert safe.mean() > 0.6
        np.testing.assert_allclose(view.disparity_px[safe], depth[safe], atol=1e-4)
        np.testing.assert_array_equal(view.pixels[safe], truth[safe])


@pytest.mark.parametrize("shape", [(1, 5), (5, 1)])
def test_arrays_of_one_row_or_column(shape: tuple[int, int]) -> None:
    scene = PlaneScene(grid(*shape, 120, 120, step=4), 8, (Plane(16, (40, 40, 80, 80)),))
    viewpoint = Viewpoint(shape[0] // 2, shape[1] // 2)
    truth, depth = scene.render(viewpoint)
    view = render(scene.decoded(), viewpoint.row, viewpoint.col)
    safe = seen_by_any(scene, viewpoint, scene.array.real) & certain(depth)
    assert safe.mean() > 0.9
    np.testing.assert_array_equal(view.pixels[safe], truth[safe])


def test_cells_with_other_spacing_in_rows_than_in_columns() -> None:
    scene = PlaneScene(grid(5, 5, 150, 110, step=4, row_step=2), 8, PLANES)
    for row, col in ((1, 2), (3, 1)):
        viewpoint = Viewpoint(row, col)
        truth, depth = scene.render(viewpoint)
        safe = seen_by_any(scene, viewpoint, used(scene.array, viewpoint)) & certain(depth)
        np.testing.assert_array_equal(render(scene.decoded(), row, col).pixels[safe], truth[safe])


@pytest.mark.parametrize("rho", [1.0, 0.7])
@pytest.mark.parametrize("d", [-3.3, 0.45, 7.9])
def test_parts_of_pixels(d: float, rho: float) -> None:
    array = grid(5, 5, 80, 64, step=4, rho=rho)
    for colours, bound in ((False, 1.0), (True, 3.0)):  # colour is fetched linearly, luma cubically
        decoded = with_disparities(
            DecodedSet(
                array,
                index=0,
                time_ns=0,
                pictures={c: smooth_view(array, Viewpoint(*c), d, colours) for c in array.real},
                disparities={},
                disparity_range_px=(-10.0, 10.0),
            ),
            {camera: np.full((64, 80), d, np.float32) for camera in array.real},
        )
        for row, col in ((2, 2), (0.7, 3.1), (0, 1), (3.9, 0)):
            truth = smooth_view(array, Viewpoint(row, col), d, colours)
            view = render(decoded, row, col)
            error = np.abs(view.pixels.astype(float) - truth)[8:-8, 8:-8]
            np.testing.assert_allclose(view.disparity_px, d, atol=1e-4)
            assert np.sqrt((error**2).mean()) < bound
            assert error.max() <= 4 * bound


@pytest.mark.parametrize("rho", [1.0, 0.75])
def test_contours_are_soft_but_bleed_no_further_than_a_pixel(rho: float) -> None:
    box = (24, 40, 60, 90)
    scene = box_scene(grid(2, 2, 120, 90, rho=rho), 12, 4, box)
    decoded, soft = scene.decoded(), 0
    for row, col in itertools.product((0, 0.1, 0.23, 0.5, 0.875), repeat=2):
        if (row, col) == (0, 0):
            continue
        outside = outside_px(scene.array, Viewpoint(row, col), 12, box)
        red, blue = np.moveaxis(render(decoded, row, col).pixels[..., [0, 2]].astype(int), 2, 0)
        assert (red[outside > 1] < 50).all()
        assert (blue[outside > 1] > 180).all()
        assert (red[outside < -1] > 180).all()
        assert (blue[outside < -1] < 50).all()
        soft += int(((red > 60) & (red < 180)).sum())
    assert soft > 1000


@pytest.mark.parametrize("lost", [((0, 1), (1, 0), (1, 1)), ((0, 0), (0, 1), (1, 0))])
def test_holes_are_filled_from_the_background_side(lost: tuple[Position, ...]) -> None:
    """One camera alone can't see what its foreground hides."""
    box = (30, 40, 60, 90)
    scene = box_scene(grid(2, 2, 130, 100), 24, 8, box)
    decoded = scene.decoded()
    for row, col in ((0.5, 0.5), (0.25, 0.75), (0.37, 0.61)):
        view = render(without(decoded, *lost), row, col)
        holes = (view.seen_by == 0) & (outside_px(scene.array, Viewpoint(row, col), 24, box) > 1)
        holes[:10] = holes[-10:] = holes[:, :10] = holes[:, -10:] = False
        assert holes.sum() > 100
        np.testing.assert_allclose(view.disparity_px[holes], 8, atol=1e-4)
        assert (view.pixels[holes][:, 0] < 50).all()
        assert (view.pixels[holes][:, 2] > 190).all()


def test_slats_close_before_a_wall_leave_no_holes() -> None:
    """Two px nearer than the wall: above the tolerance for one surface, but not far."""
    slats = tuple(Plane(10, (-100, left, 200, left + 2)) for left in range(-20, 140, 6))
    decoded = PlaneScene(grid(2, 2, 90, 60), 8, slats).decoded()
    for row, col in ((0.5, 0.37), (0.37, 0.5), (0.8, 0.8)):
        assert (render(decoded, row, col).seen_by[:, 10:-10] > 0).all()


def test_a_camera_that_is_wrong_alone_is_outvoted() -> None:
    scene = PlaneScene(grid(3, 3, 120, 90, step=2), 8, (Plane(16, (30, 40, 60, 80)),))
    decoded, middle = scene.decoded(), Viewpoint(1, 1)
    truth, depth = scene.render(middle)
    shared = np.all([scene.seen_from(middle, camera) for camera in scene.array.real], axis=0)
    shared &= ~contours(depth)
    shared = ~grown(~shared, 2)
    assert shared.mean() > 0.6
    assert (render(decoded, 1, 1).seen_by[shared] == 4).all()
    for camera, wrong_px in itertools.product(scene.array.real, (40.0, -20.0)):
        values = decoded.disparities[camera].values_px.copy()
        values[20:50, 20:70] = wrong_px
        view = render(with_disparities(decoded, {camera: values}), 1, 1)
        np.testing.assert_allclose(view.disparity_px[shared], depth[shared], atol=1e-4)
        np.testing.assert_array_equal(view.pixels[shared], truth[shared])
        # Where it is wrong it is not asked for its colour.
        assert (view.seen_by[shared] == 3).sum() > 500


def test_two_cameras_that_agree_on_something_near_are_believed_unless_two_see_through_it() -> None:
    """Against two others of the same weight, whose pictures decide."""
    scene = PlaneScene(grid(2, 2, 80, 60), 4)
    decoded = scene.decoded()
    values = {camera: decoded.disparities[camera].values_px.copy() for camera in ((0, 0), (0, 1))}
    for camera, left in (((0, 0), 30), ((0, 1), 18)):
        values[camera][26:46, left : left + 20] = 12
    for grey_of_the_others, expected in ((90, 12), (120, 4)):
        pictures = {
            camera: np.full((60, 80, 3), 90 if camera in values else grey_of_the_others, np.uint8)
            for camera in decoded.pictures
        }
        view = render(replace(with_disparities(decoded, values), pictures=pictures), 0.5, 0.5)
        np.testing.assert_allclose(view.disparity_px[21:39, 25:43], expected, atol=1e-4)


def test_seen_by_counts_the_cameras_that_see_the_point() -> None:
    scene = PlaneScene(grid(3, 3, 150, 110, step=2), 8, PLANES)
    decoded = scene.decoded()
    for row, col in ((1, 1), (0, 1), (1, 2)):
        viewpoint = Viewpoint(row, col)
        _, depth = scene.render(viewpoint)
        seen = [scene.seen_from(viewpoint, camera) for camera in used(scene.array, viewpoint)]
        # Not where a camera's sight begins or ends.
        edges = contours(depth) | np.any([contours(one.astype(np.float32)) for one in seen], axis=0)
        clear = ~grown(edges, 1)
        count = np.sum(seen, axis=0)
        assert {1, 2, 4} <= set(count[clear])
        np.testing.assert_array_equal(render(decoded, row, col).seen_by[clear], count[clear])


@pytest.mark.parametrize("missing", [(0, 0), (0, 2), (2, 0), (2, 2)])
def test_a_missing_camera_is_done_without(missing: Position) -> None:
    scene = PlaneScene(grid(3, 3, 120, 90, step=2), 8, (Plane(16, (30, 40, 60, 80)),))
    decoded = without(scene.decoded(), missing)
    for row, col in ((1, 1), (0.5, 1.5), missing):
        viewpoint = Viewpoint(row, col)
        truth, depth = scene.render(viewpoint)
        safe = seen_by_any(scene, viewpoint, decoded.pictures) & certain(depth)
        view = render(decoded, row, col)
        np.testing.assert_array_equal(view.pixels[safe], truth[safe])
        assert view.seen_by.max() == 3


def test_no_camera_at_all_is_an_error() -> None:
    decoded = PlaneScene(grid(2, 2, 20, 16), 4).decoded()
    with pytest.raises(SettingError, match="no camera of the view"):
        render(without(decoded, *decoded.array.real), 0.5, 0.5)

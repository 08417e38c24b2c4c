"""Contract suite over SYNTHESIZERS: what every synthesizer must do, whatever its method."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet, DisparityMap, RenderedView
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import SYNTHESIZERS, make_synthesizer


@pytest.fixture(params=SYNTHESIZERS)
def synthesizer(request: pytest.FixtureRequest) -> Synthesizer:
    return make_synthesizer(str(request.param))


def check_form(view: RenderedView, array: CameraArray, viewpoint: Viewpoint) -> None:
    shape = (array.height, array.width)
    assert view.viewpoint == viewpoint
    assert view.pixels.shape == (*shape, 3)
    assert view.pixels.dtype == np.uint8
    assert view.disparity_px.shape == shape
    assert view.disparity_px.dtype == np.float32
    assert view.seen_by.shape == shape
    assert view.seen_by.dtype == np.uint8
    assert np.isfinite(view.disparity_px).all()
    assert view.seen_by.max() <= 4


def middle(array: CameraArray) -> Viewpoint:
    return Viewpoint((array.rows - 1) / 2, (array.cols - 1) / 2)


def check_interior(synthesizer: Synthesizer, scene: PlaneScene, viewpoint: Viewpoint) -> None:
    """One plane across the picture: all but what some camera doesn't see comes out right."""
    decoded = scene.decoded()
    truth, depth = scene.render(viewpoint)
    seen = np.ones(truth.shape[:2], np.bool_)
    for camera in scene.array.real:
        seen &= scene.seen_from(viewpoint, camera)
    assert seen.mean() > 0.3
    view = synthesizer.render(decoded, viewpoint)
    check_form(view, scene.array, viewpoint)
    error = np.abs(view.pixels[seen].astype(int) - truth[seen])
    assert error.mean() < 1
    assert np.abs(view.disparity_px[seen] - depth[seen]).mean() < 0.1
    assert (view.seen_by[seen] > 0).mean() > 0.99


@pytest.mark.parametrize("shape", [(1, 2), (2, 1), (2, 2), (2, 3), (3, 1)])
def test_real_cameras_come_back_exactly(synthesizer: Synthesizer, shape: tuple[int, int]) -> None:
    scene = PlaneScene(grid(*shape, 37, 29), 3, (Plane(7, (5, 8, 20, 25)),))
    decoded = scene.decoded()
    for camera in scene.array.real:
        view = synthesizer.render(decoded, Viewpoint(*camera))
        check_form(view, scene.array, Viewpoint(*camera))
        np.testing.assert_array_equal(view.pixels, decoded.pictures[camera])
        assert (view.seen_by > 0).all()


@pytest.mark.parametrize("shape", [(1, 2), (2, 1), (2, 2), (2, 3)])
def test_between_neighbouring_cameras(synthesizer: Synthesizer, shape: tuple[int, int]) -> None:
    scene = PlaneScene(grid(*shape, 61, 47), 8)
    rows, cols = shape
    for row in (0.0, 0.25, 0.5)[: 3 if rows > 1 else 1]:
        for col in (0.0, 0.5, 0.75)[: 3 if cols > 1 else 1]:
            check_interior(synthesizer, scene, Viewpoint(row, col))
    if cols == 3:
        check_interior(synthesizer, scene, Viewpoint(0.5, 1.5))


@pytest.mark.parametrize("disparity_px", [-12, -4, 0, 16])
def test_disparity_of_either_sign(synthesizer: Synthesizer, disparity_px: int) -> None:
    check_interior(synthesizer, PlaneScene(grid(5, 5, 80, 64, step=4), disparity_px), Viewpoint(1, 3))


@pytest.mark.parametrize("rho", [0.5, 2.0])
def test_cells_that_are_not_square(synthesizer: Synthesizer, rho: float) -> None:
    check_interior(synthesizer, PlaneScene(grid(5, 5, 80, 64, step=4, rho=rho), 8), Viewpoint(3, 1))


def test_nearer_planes_cover_farther_ones(synthesizer: Synthesizer) -> None:
    scene = PlaneScene(grid(3, 3, 120, 90, step=2), 4, (Plane(16, (20, 30, 70, 90)),))
    viewpoint = Viewpoint(1, 1)
    truth, depth = scene.render(viewpoint)
    view = synthesizer.render(scene.decoded(), viewpoint)
    front = depth == 16
    front[:24] = front[:, :34] = False
    front[-36:] = front[:, -50:] = False
    assert front.sum() > 500
    assert np.abs(view.pixels[front].astype(int) - truth[front]).mean() < 1


@pytest.mark.parametrize("size", [(1, 40), (40, 1), (1, 1), (3, 2), (33, 17)])
def test_small_and_odd_pictures(synthesizer: Synthesizer, size: tuple[int, int]) -> None:
    width, height = size
    scene = PlaneScene(grid(3, 3, width, height, step=2), 2, (Plane(4, (0, 0, height // 2, width // 2)),))
    decoded = scene.decoded()
    for row in range(3):
        for col in range(3):
            view = synthesizer.render(decoded, Viewpoint(row, col))
            check_form(view, scene.array, Viewpoint(row, col))


@pytest.mark.parametrize("shape", [(1, 3), (3, 1), (3, 3)])
def test_maps_that_are_guesses_throughout(synthesizer: Synthesizer, shape: tuple[int, int]) -> None:
    scene = PlaneScene(grid(*shape, 48, 40, step=2), 4)
    decoded = scene.decoded()
    guesses = {
        camera: DisparityMap(disparity.values_px, np.zeros_like(disparity.valid))
        for camera, disparity in decoded.disparities.items()
    }
    viewpoint = middle(scene.array)
    check_form(synthesizer.render(replace(decoded, disparities=guesses), viewpoint), scene.array, viewpoint)


@pytest.mark.parametrize(
    "viewpoint", [Viewpoint(-0.1, 0), Viewpoint(0, 2.01), Viewpoint(3, 0), Viewpoint(0, np.nan)]
)
def test_outside_the_cameras_is_refused(synthesizer: Synthesizer, viewpoint: Viewpoint) -> None:
    decoded: DecodedSet = PlaneScene(grid(3, 3, 16, 12, step=2), 2).decoded()
    with pytest.raises(SettingError, match="viewpoint: found"):
        synthesizer.render(decoded, viewpoint)


def test_rendering_changes_nothing_that_was_decoded(synthesizer: Synthesizer) -> None:
    scene = PlaneScene(grid(3, 3, 60, 50, step=2), 4, (Plane(10, (10, 10, 30, 40)),))
    decoded, untouched = scene.decoded(), scene.decoded()
    first = synthesizer.render(decoded, Viewpoint(1, 1))
    again = synthesizer.render(decoded, Viewpoint(1, 1))
    np.testing.assert_array_equal(first.pixels, again.pixels)
    for camera in scene.array.real:
        np.testing.assert_array_equal(decoded.pictures[camera], untouched.pictures[camera])
        np.testing.assert_array_equal(
            decoded.disparities[camera].values_px, untouched.disparities[camera].values_px
        )


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(SettingError, match=r"found nonsense, expected one of .*dils, linear"):
        make_synthesizer("nonsense")


def test_the_table_costs_no_compiler() -> None:
    """Numba takes half a second to import: the names must be there without it."""
    program = "import sys, mvcodec.synthesis.synthesizers; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0

"""The still scenes: mirrors show mirror images, disparity is exact, and matching keeps up with SGBM."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest

from mvcodec.array import Viewpoint
from mvcodec.errors import SettingError
from mvcodec.evaluation.quality import QualityMeter
from mvcodec.frames import DecodedSet, FrameSet, RenderedView
from mvcodec.kernels.specks import smooth_over
from mvcodec.layers.refinement import make_matcher
from mvcodec.scenes.difficult import ARRANGEMENTS
from mvcodec.scenes.lighting import LightMaps
from mvcodec.scenes.reflections import Mirror, MirroredScene
from mvcodec.scenes.renderer import Optics
from mvcodec.scenes.scene import Scene, SceneSettings, make_scene
from mvcodec.scenes.solids import Rectangle, Surface, rectangle
from mvcodec.stereo.disparity_range import estimate_range
from mvcodec.synthesis.layered import Layered

OPTICS = Optics(120, 90, 120.0)


@cache
def small(name: str) -> Scene:
    return make_scene(name, SceneSettings(size=(160, 120)))


def flat(count: int) -> LightMaps:
    return LightMaps(np.ones((count, 3), np.float32), np.ones((count, 2), np.int64))


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_a_mirror_shows_what_stands_before_it_as_far_behind_it(share: float) -> None:
    face = rectangle((0.0, 0.0, 2.0), 1.2, 0.8, Surface("moon"))
    wall = rectangle((0.0, 0.0, 6.0), 9.0, 9.0, Surface("gravel"))
    picture = Rectangle(
        np.array([2.0, -2.0, -1.0]), np.array([-4.0, 0, 0]), np.array([0, 4.0, 0]), Surface("coffee")
    )
    shapes = [face, wall, picture]
    mirrored = MirroredScene(shapes, flat(3), [Mirror(face, share)])
    # Who stands before it and looks back sees left on the left: from the front it is turned round.
    image = Rectangle(
        np.array([2.0, -2.0, 5.0]), np.array([-4.0, 0, 0]), np.array([0, 4.0, 0]), Surface("coffee")
    )
    for eye in ((0.0, 0.0, 0.0), (0.2, -0.1, 0.0)):
        found, depth = mirrored.render(OPTICS, eye)
        plain, _ = MirroredScene(shapes, flat(3), []).render(OPTICS, eye)
        behind, _ = MirroredScene([image], flat(1), []).render(OPTICS, eye)
        inside = np.abs(depth - 0.5) < 1e-6
        assert 0.15 < inside.mean() < 0.5
        expected = np.rint((1 - share) * plain[inside] + share * behind[inside])
        np.testing.assert_allclose(found[inside], expected, atol=1)
        np.testing.assert_array_equal(found[~inside], plain[~inside])


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_its_disparity_leads_from_view_to_view_and_crosses_zero(name: str) -> None:
    scene = small(name)
    last = Viewpoint(scene.array.rows - 1, scene.array.cols - 1)
    one, disparity = scene.render(Viewpoint(0, 0), 0)
    other, there = scene.render(last, 0)
    assert disparity is not None
    assert there is not None
    assert disparity.min() < -0.5
    assert disparity.max() > 0.5
    y, x = np.mgrid[: one.shape[0], : one.shape[1]].astype(np.float32)
    places = x - np.float32(last.col) * disparity, y - np.float32(last.row) * disparity
    moved = cv2.remap(other, *places, cv2.INTER_CUBIC)
    seen = np.abs(cv2.remap(there, *places, cv2.INTER_NEAREST) - disparity) < 0.1
    apart = np.abs(moved[seen].astype(np.float32) - one[seen])
    assert seen.mean() > 0.5
    assert np.median(apart) <= 3
    assert np.median(np.abs(other[seen].astype(np.float32) - one[seen])) > np.median(apart)


def test_nothing_moves_and_the_seed_changes_it() -> None:
    with pytest.raises(SettingError, match="frames: found 2, expected 1: nothing moves in the scene wires"):
        make_scene("wires", SceneSettings(frames=2))
    grid = small("wires").array.rows, small("wires").array.cols
    other = make_scene("wires", SceneSettings(grid=grid, size=(160, 120), seed=1))
    assert (other.render(Viewpoint(0, 0), 0)[0] != small("wires").render(Viewpoint(0, 0), 0)[0]).any()


@cache
def views(
    name: str, matcher: str, grid: tuple[int, int] | None
) -> tuple[Scene, dict[tuple[int, int], RenderedView]]:
    """The virtual views, the real cameras uncoded."""
    scene = make_scene(name, SceneSettings(grid=grid))
    array, synthesizer = scene.array, Layered()
    real = {camera: scene.render(Viewpoint(*camera), 0)[0] for camera in array.real}
    range_px = estimate_range(array, [FrameSet(0, 0, real)])
    decoded = DecodedSet(array, 0, 0, real, make_matcher(matcher).match(array, real, range_px), range_px)
    virtual = [view for view in array.positions if view not in array.real]
    return scene, {view: synthesizer.render(decoded, Viewpoint(*view)) for view in virtual}


def quality(name: str, matcher: str, grid: tuple[int, int] | None) -> float:
    """Their luma PSNR, dB."""
    scene, made = views(name, matcher, grid)
    meter = QualityMeter(scene.array.real)
    for view, found in made.items():
        meter.push(view, scene.render(Viewpoint(*view), 0)[0], found.pixels)
    psnr = meter.result().psnr_y.all
    assert psnr is not None
    return psnr


ARRAYS = [("wires", None), ("mirrors", None), ("studs", None), ("wires", (1, 3)), ("mirrors", (1, 3))]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "grid"), ARRAYS, ids=str)
@pytest.mark.parametrize(("matcher", "behind"), [("joint", 0.05), ("balanced", 0.2)])
def test_views_are_as_good_as_from_plain_maps(
    name: str, grid: tuple[int, int] | None, matcher: str, behind: float
) -> None:
    assert quality(name, matcher, grid) >= quality(name, "sgbm", grid) - behind


@pytest.mark.slow
@pytest.mark.parametrize(("name", "grid"), ARRAYS, ids=str)
@pytest.mark.parametrize("matcher", ["joint", "balanced", "sgbm"])
def test_no_speck_is_left_in_a_view(name: str, grid: tuple[int, int] | None, matcher: str) -> None:
    for found in views(name, matcher, grid)[1].values():
        smooth = found.disparity_px.copy()
        smooth_over(found.disparity_px, 1.5, 1, 30, smooth, 0, len(smooth))
        np.testing.assert_array_equal(smooth, found.disparity_px)

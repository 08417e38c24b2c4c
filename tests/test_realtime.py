"""The real-time matcher: small copies are matched, maps brought back, and only of the cameras asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import Position
from mvcodec.frames import DisparityMap, Picture
from mvcodec.stereo.joint import Joint
from mvcodec.stereo.joint_settings import BALANCED, REALTIME, JointSettings
from mvcodec.stereo.matcher import HalvingMatcher, SelectiveMatcher
from mvcodec.stereo.realtime import Realtime

RANGE_PX = (0.0, 24.0)


def bad_share(scene: Planes, camera: Position, found: DisparityMap) -> float:
    return float(np.mean(np.abs(found.values_px - scene.disparity_px(camera)) > 1.5))


@pytest.mark.parametrize("shape", [(2, 2), (1, 2), (2, 1)], ids=str)
@pytest.mark.parametrize("halvings", [0, 1, 2])
def test_surfaces_are_found_at_every_size(shape: tuple[int, int], halvings: int) -> None:
    array = linear_or_grid(*shape, 150, 101)
    scene = Planes(array, 4, 16)
    maps = Realtime(most_px=(0,) * halvings).match(array, scene.pictures(), RANGE_PX)
    assert list(maps) == list(array.real)
    for camera, found in maps.items():
        assert found.values_px.shape == found.valid.shape == (101, 150)
        assert found.values_px.dtype == np.float32
        assert bad_share(scene, camera, found) < (0.06, 0.08, 0.15)[halvings]
        assert 0.5 < found.valid.mean() < 1


@pytest.mark.parametrize("wanted", [[(0, 0)], [(0, 0), (0, 2)]], ids=str)
def test_cameras_whose_neighbours_send_no_map_are_matched(wanted: list[Position]) -> None:
    array = linear_or_grid(1, 3, 150, 101)
    scene = Planes(array, 4, 16)
    maps = Realtime().match_cameras(array, scene.pictures(), RANGE_PX, wanted, fresh=False)
    assert list(maps) == wanted
    assert max(bad_share(scene, camera, found) for camera, found in maps.items()) < 0.06


def test_a_camera_is_matched_alone_as_among_others() -> None:
    array = linear_or_grid(2, 2, 120, 80)
    pictures = Planes(array, 4, 16).pictures()
    matcher = Realtime(most_px=(0,))
    assert isinstance(matcher, SelectiveMatcher)
    every = matcher.match(array, pictures, RANGE_PX)
    two: list[Position] = [(0, 0), (1, 1)]
    some = matcher.match_cameras(array, pictures, RANGE_PX, two, fresh=True)
    assert list(some) == two
    for camera in two:
        np.testing.assert_array_equal(some[camera].values_px, every[camera].values_px)
        np.testing.assert_array_equal(some[camera].valid, every[camera].valid)


@pytest.mark.parametrize("halvings", [1, 2])
def test_maps_of_half_size_are_there_before_those_of_full_size(halvings: int) -> None:
    array = linear_or_grid(2, 2, 150, 101)
    scene, wanted = Planes(array, 4, 16), [(0, 0), (1, 1)]
    matcher = Realtime(most_px=(0,) * halvings)
    assert isinstance(matcher, HalvingMatcher)
    maps = matcher.match_halved(array, scene.pictures(), RANGE_PX, wanted, fresh=True)
    assert maps is not None
    assert list(maps) == wanted
    for camera, found in maps.items():
        assert found.values_px.shape == found.valid.shape == (51, 75)
        assert found.values_px.dtype == np.float32
        there = scene.disparity_px(camera)[::2, ::2]
        assert np.mean(np.abs(found.values_px - there) > 1.5) < (0.08, 0.15)[halvings - 1]


@pytest.mark.parametrize(
    "matcher", [Realtime(), Realtime(JointSettings(**BALANCED), most_px=(0,))], ids=["whole", "refined"]
)
def test_there_are_none_where_whole_pictures_have_a_say(matcher: Realtime) -> None:
    array = linear_or_grid(2, 2, 60, 40)
    assert matcher.match_halved(array, Planes(array, 4, 16).pictures(), RANGE_PX, [(0, 0)], True) is None


def test_balanced_maps_confirm_each_other_whatever_is_asked_for() -> None:
    array = linear_or_grid(2, 2, 120, 80)
    pictures = Planes(array, 4, 16).pictures()
    matcher = Realtime(JointSettings(**BALANCED), most_px=(0,))
    every = matcher.match(array, pictures, RANGE_PX)
    some = matcher.match_cameras(array, pictures, RANGE_PX, [(1, 1)], fresh=True)
    assert list(some) == [(1, 1)]
    np.testing.assert_array_equal(some[1, 1].values_px, every[1, 1].values_px)


def test_maps_of_small_copies_are_refined_by_the_pictures_themselves() -> None:
    array = linear_or_grid(2, 2, 120, 80)
    scene = Planes(array, 4.3, 15.6)

    def median_error(steps: int) -> float:
        settings = JointSettings(**{**BALANCED, "full_size_steps": steps})
        found = Realtime(settings, most_px=(0,)).match(array, scene.pictures(), RANGE_PX)[0, 0]
        off = np.abs(found.values_px - scene.disparity_px((0, 0)))
        return float(np.median(off[found.valid]))

    assert median_error(2) < median_error(0) / 2


@pytest.mark.parametrize(("plain_levels", "edge"), [(7, 31), (0, 30)])
def test_surfaces_reach_over_soft_edges_of_the_whole_picture(plain_levels: int, edge: int) -> None:
    """The nearer one on the left is bright, and moves by 8 px; maps end at the foot of its edge."""
    array = linear_or_grid(1, 2, 60, 20)
    x = np.arange(60)[None, :, None] * np.ones((20, 1, 3))
    pictures = {
        (0, col): np.clip(200 - 160 * (x - at + 0.5), 40, 200).astype(np.uint8)
        for col, at in ((0, 30.4), (1, 22.4))
    }
    maps = {}
    for camera, last in (((0, 0), 30), ((0, 1), 22)):
        values = np.full((20, 60), 2, np.float32)
        values[:, : last + 1] = 8
        maps[camera] = DisparityMap(values, np.zeros(values.shape, np.bool_))
    matcher = Joint(JointSettings(**{**BALANCED, "plain_levels": plain_levels}))
    matcher.match(array, pictures, (0.0, 10.0))
    found = matcher.refined(array, pictures, maps, (0.0, 10.0), array.real)[0, 0].values_px
    assert (found[:, : edge + 1] == 8).all()
    assert (found[:, edge + 1 :] == 2).all()


def test_what_no_partner_sees_is_not_valid() -> None:
    array = linear_or_grid(1, 2, 100, 60)
    found = Realtime().match(array, Planes(array, 10, 10).pictures(), (4.0, 16.0))[0, 0]
    assert found.valid[:, :9].mean() < 0.1  # left of the right camera's picture
    assert found.valid[:, 12:].mean() > 0.95


@pytest.mark.parametrize("settings", [REALTIME, BALANCED], ids=["realtime", "balanced"])
def test_lone_camera_is_flat(settings: dict[str, Any]) -> None:
    array = linear_or_grid(1, 1, 70, 80)
    picture: Picture = np.zeros((80, 70, 3), np.uint8)
    (found,) = (
        Realtime(JointSettings(**settings), most_px=(0,))
        .match(array, {(0, 0): picture}, (-3.0, 9.0))
        .values()
    )
    assert (found.values_px == -3).all()
    assert not found.valid.any()

"""What small copies do not show is searched for in the whole pictures, where they are in doubt."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_scene import linear_or_grid, texture

from mvcodec.array import Position
from mvcodec.frames import Picture
from mvcodec.stereo import doubts
from mvcodec.stereo.doubts import BLOCK, doubtful, most_doubtful
from mvcodec.stereo.joint_settings import BALANCED, JointSettings
from mvcodec.stereo.realtime import Realtime

FAR_PX, POST_PX, POST = 4, 15, slice(100, 103)
RANGE_PX = (0.0, 20.0)


def post_before_a_wall(height: int = 130, width: int = 200) -> dict[Position, Picture]:
    """A wall, and a post 3 px wide before it, as two cameras see them."""
    wall, post = texture(height, width + FAR_PX, 1), texture(height, 3, 2)
    pictures: dict[Position, Picture] = {}
    for col in (0, 1):
        seen = wall[:, col * FAR_PX :][:, :width].copy()
        seen[:, POST.start - col * POST_PX : POST.stop - col * POST_PX] = post
        pictures[0, col] = np.rint(seen).astype(np.uint8)
    return pictures


@pytest.mark.parametrize(("share", "least", "most"), [(0.0, 0.0, 0.5), (1.0, 0.6, 1.0), (0.5, 0.6, 1.0)])
def test_a_post_that_small_copies_lose_is_found(share: float, least: float, most: float) -> None:
    array = linear_or_grid(1, 2, 200, 130)
    settings = JointSettings(**{**BALANCED, "search_share": share})
    maps = Realtime(settings, most_px=(0,)).match(array, post_before_a_wall(), RANGE_PX)
    for col in (0, 1):
        post = maps[0, col].values_px[:, POST.start - col * POST_PX : POST.stop - col * POST_PX]
        assert least <= np.mean(np.abs(post - POST_PX) < 1.5) <= most
    beside = maps[0, 0].values_px[10:-10, 130:190]
    assert np.abs(beside - FAR_PX).max() < 1


def test_cameras_are_searched_whoever_is_asked_for() -> None:
    array, pictures = linear_or_grid(1, 2, 200, 130), post_before_a_wall()
    matcher = Realtime(JointSettings(**BALANCED), most_px=(0,))
    every = matcher.match(array, pictures, RANGE_PX)
    some = matcher.match_cameras(array, pictures, RANGE_PX, [(0, 1)], fresh=True)
    assert list(some) == [(0, 1)]
    np.testing.assert_array_equal(some[0, 1].values_px, every[0, 1].values_px)
    np.testing.assert_array_equal(some[0, 1].valid, every[0, 1].valid)


def test_doubt_is_where_partners_show_something_else_and_at_contours() -> None:
    array = linear_or_grid(1, 2, 30, 8)
    grey = np.full((8, 30), 100, np.uint8)
    other = grey.copy()
    other[4, 10] = 140  # seen at column 12 by a disparity of 2
    values = np.full((8, 30), 2, np.float32)
    values[:, 20:] = 8
    maps = {(0, 0): values, (0, 1): values}
    found = doubtful(array, (0, 0), maps, {(0, 0): grey, (0, 1): other})
    expected = np.zeros((8, 30), np.float32)
    expected[:, 19:21] = 1
    expected[4, 12] += doubts.MISFIT_WEIGHT
    np.testing.assert_array_equal(found, expected)


def test_what_no_partner_sees_is_no_misfit() -> None:
    array = linear_or_grid(1, 2, 12, 4)
    values = np.full((4, 12), 3, np.float32)
    greys = {(0, 0): np.full((4, 12), 10, np.uint8), (0, 1): np.full((4, 12), 90, np.uint8)}
    found = doubtful(array, (0, 0), {(0, 0): values, (0, 1): values}, greys)
    assert (found[:, :3] == 0).all()
    assert (found[:, 3:] == doubts.MISFIT_WEIGHT).all()


def test_the_most_doubtful_blocks_come_first_with_what_may_be_there() -> None:
    half = BLOCK // 2
    small = np.full((3 * half, 4 * half - 5), 3, np.float32)
    small[5, 3 * half + 2] = 7.3  # far from block (2, 0)
    doubt = np.zeros_like(small)
    doubt[20, 3 * half :][:20] = 1
    doubt[half : half + 2, 2 * half : 2 * half + 20] = doubts.MISFIT_WEIGHT
    doubt[2 * half, :20] = 5
    doubt[0, 0] = 1  # too little
    size = 6 * half - 1, 8 * half - 10
    found = most_doubtful(doubt, small, size, 1.0, 40)
    assert found.places.tolist() == [[2 * BLOCK, 0], [0, 3 * BLOCK], [BLOCK, 2 * BLOCK]]
    assert found.ranges_px.tolist() == [[6 - 2, 6 + 2], [6 - 2, 15 + 2], [6 - 2, 40 + 2]]
    assert most_doubtful(doubt, small, size, 1 / 12, 40).places.tolist() == [[BLOCK, 2 * BLOCK]]
    assert len(most_doubtful(doubt, small, size, 0.05, 40).places) == 0


def test_pictures_lower_than_a_window_are_left() -> None:
    found = most_doubtful(np.ones((20, 90), np.float32), np.zeros((20, 90), np.float32), (40, 180), 1.0, 9.0)
    assert found.places.shape == found.ranges_px.shape == (0, 2)

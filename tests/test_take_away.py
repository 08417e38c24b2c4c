"""Take-away pictures: the geometry of refocus, slices, quilts and paths, and the files that hold them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.errors import InputError, SettingError
from mvcodec.frames import Picture, RenderedView
from mvcodec.output.light_field import converge, epipolar_slice, quilt, quilt_path, refocus
from mvcodec.output.styles import STYLES, ShotSettings, take
from mvcodec.output.view_path import SHAPES, read_waypoints, walk_shape, walk_waypoints
from mvcodec.synthesis.linear import Linear

FAR_PX, NEAR_PX = 4, 8
"""Disparity of the two planes for one grid step; a cell is two steps wide."""

ARRAY = grid(3, 5, 96, 64, step=2, rho=1.5)
NEAR_BOX = (20, 30, 56, 80)
SCENE = PlaneScene(ARRAY, 2 * FAR_PX, (Plane(2 * NEAR_PX, NEAR_BOX),))
MIDDLE = Viewpoint(1, 2)


def seen_from(viewpoint: Viewpoint) -> RenderedView:
    pixels, disparity = SCENE.render(viewpoint)
    return RenderedView(viewpoint, pixels, disparity, np.full(disparity.shape, 4, np.uint8))


def everything(array: CameraArray) -> list[RenderedView]:
    return [seen_from(Viewpoint(*position)) for position in array.positions]


def flat(level: int, width: int = 16, height: int = 12) -> Picture:
    return np.full((height, width, 3), level, np.uint8)


# Light fields


def test_refocusing_on_a_plane_makes_it_sharp_and_the_other_one_not() -> None:
    truth = seen_from(MIDDLE)
    on_near = refocus(ARRAY, everything(ARRAY), MIDDLE, NEAR_PX).astype(int)
    near = truth.disparity_px == 2 * NEAR_PX
    np.testing.assert_array_equal(on_near[near], truth.pixels[near])
    assert np.abs(on_near - truth.pixels)[~near].mean() > 30
    on_far = refocus(ARRAY, everything(ARRAY), MIDDLE, FAR_PX).astype(int)
    assert np.abs(on_far - truth.pixels)[near].mean() > 30
    # Left of the near plane by more than it moves, every view sees the far one.
    free = (slice(None), slice(0, 6))
    np.testing.assert_array_equal(on_far[free], truth.pixels[free])


def test_refocusing_between_the_views_meets_the_plane_at_half_pixels() -> None:
    """A ramp moves exactly under interpolation, so that its refocused picture is known between pixels too."""
    array = grid(1, 3, 96, 8, step=2)
    ramp = np.arange(96, dtype=np.float32)
    views = [
        RenderedView(
            Viewpoint(0, col),
            np.repeat((100 + ramp + 3 * col)[None, :, None], 8, 0).repeat(3, 2).astype(np.uint8),
            np.full((8, 96), 6, np.float32),
            np.ones((8, 96), np.uint8),
        )
        for col in range(3)
    ]
    picture = refocus(array, views, Viewpoint(0, 0.5), 3)
    np.testing.assert_allclose(picture[4, 8:-8, 0], (100 + ramp + 1.5)[8:-8], atol=0.51)


def test_a_slice_through_a_plane_is_a_straight_line_of_its_disparity() -> None:
    array = grid(1, 7, 96, 64, step=2)
    scene = PlaneScene(array, 2 * FAR_PX)
    views = [scene.render(Viewpoint(0, col))[0] for col in range(7)]
    lines = epipolar_slice(views)
    assert lines.shape == (7, 96, 3)
    for number in range(7):
        shift = FAR_PX * number
        np.testing.assert_array_equal(lines[number, : 96 - shift], lines[0, shift:])


def test_a_slice_down_a_column_stands_on_its_side() -> None:
    array = grid(5, 1, 96, 64, step=2)
    views = [PlaneScene(array, 2 * FAR_PX).render(Viewpoint(row, 0))[0] for row in range(5)]
    lines = epipolar_slice(views, along_column=True)
    assert lines.shape == (64, 5, 3)
    np.testing.assert_array_equal(lines[: 64 - 2 * FAR_PX, 2], lines[2 * FAR_PX :, 0])


@pytest.mark.parametrize("px", [FAR_PX, NEAR_PX])
def test_what_is_in_focus_has_no_parallax(px: int) -> None:
    centre = seen_from(MIDDLE)
    in_focus = centre.disparity_px == 2 * px
    for place in ((0, 1), (2, 3)):
        moved = converge(ARRAY, seen_from(Viewpoint(*place)), MIDDLE, px)
        both_see = SCENE.seen_from(MIDDLE, place)
        assert (both_see & in_focus).sum() > 1000
        np.testing.assert_array_equal(moved[both_see & in_focus], centre.pixels[both_see & in_focus])
        assert (moved != centre.pixels).any(axis=2)[both_see & ~in_focus].mean() > 0.9


def test_a_quilt_begins_at_the_bottom_left() -> None:
    sheet = quilt([flat(level) for level in range(6)], rows=2, cols=3)
    assert sheet[::12, ::16, 0].tolist() == [[3, 4, 5], [0, 1, 2]]


def test_a_quilt_is_no_larger_than_displays_take() -> None:
    assert quilt([flat(0, 1920, 1080)] * 48, rows=6, cols=8).shape[:2] == (6 * 288, 8 * 512)


def test_a_quilts_name_states_its_layout() -> None:
    assert quilt_path(Path("a/b.png"), 6, 8, 0.75) == Path("a/b_qs8x6a0.75.png")
    assert quilt_path(Path("b.c.mp4"), 9, 5, 16 / 9) == Path("b.c_qs5x9a1.778.mp4")
    assert quilt_path(Path("b_qs8x6a1.png"), 6, 8, 1.0) == Path("b_qs8x6a1.png")
    with pytest.raises(SettingError, match=r"expected _qs8x6a0\.75 where"):
        quilt_path(Path("b_qs6x8a0.75.png"), 6, 8, 0.75)


# Paths


@given(st.sampled_from(sorted(SHAPES)), st.integers(1, 9), st.integers(1, 9), st.integers(1, 200))
def test_shapes_stay_within_the_array(name: str, rows: int, cols: int, count: int) -> None:
    array = grid(rows, cols, 8, 8)
    places = walk_shape(name, array, count)
    assert len(places) == count
    for place in places:
        array.check_viewpoint(place)


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_reach_every_border_and_close(name: str) -> None:
    places = walk_shape(name, ARRAY, 360)
    cols, rows = [place.col for place in places], [place.row for place in places]
    assert (min(cols), max(cols)) == pytest.approx((0, 4))
    assert (min(rows), max(rows)) == pytest.approx((1, 1) if name == "sweep" else (0, 2))
    steps = [
        abs(after.row - before.row) + abs(after.col - before.col)
        for before, after in zip(places, [*places[1:], places[0]], strict=True)
    ]
    assert max(steps) < 0.1


def test_a_sweep_of_one_column_goes_down_it() -> None:
    places = walk_shape("sweep", grid(5, 1, 8, 8), 4)
    assert [place.row for place in places] == pytest.approx([0, 2, 4, 2])
    assert {place.col for place in places} == {0}


waypoint = st.builds(Viewpoint, st.floats(0, 2), st.floats(0, 4))


@given(st.lists(waypoint, min_size=1, max_size=6), st.integers(1, 40))
def test_waypoints_are_met_and_the_way_stays_between_them(waypoints: list[Viewpoint], legs: int) -> None:
    places = walk_waypoints(waypoints, (len(waypoints) - 1) * legs + 1)
    for place in places:
        ARRAY.check_viewpoint(place)
    for place, expected in zip(places[::legs], waypoints, strict=True):
        assert (place.row, place.col) == pytest.approx((expected.row, expected.col), abs=1e-9)


def test_waypoints_come_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "way.json"
    path.write_text(json.dumps({"viewpoints": [[0, 0], [2, 4], [2, 4], [1.5, 0]]}))
    waypoints = read_waypoints(path, ARRAY)
    assert waypoints == (Viewpoint(0, 0), Viewpoint(2, 4), Viewpoint(2, 4), Viewpoint(1.5, 0))
    assert walk_waypoints(waypoints, 7)[1] == Viewpoint(1, 2)
    assert walk_waypoints(waypoints, 7)[2:5] == (Viewpoint(2, 4),) * 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "a JSON object"),
        ("{}", "no viewpoints"),
        ('{"viewpoints": []}', "a list of 0"),
        ('{"viewpoints": 3}', "pairs"),
        ('{"viewpoints": [[0, 0], [1]]}', r"viewpoints\[1\]"),
        ('{"viewpoints": [[0, true]]}', "two numbers"),
        ('{"viewpoints": [[0, NaN]]}', "two numbers"),
        ('{"viewpoints": [[0, 0], [0, 4.5]]}', r"viewpoints\[1\] = 0,4.5, expected row 0..2, col 0..4"),
        ('{"viewpoints"', "malformed JSON"),
    ],
)
def test_bad_path_files_name_what_is_wrong(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "way.json").write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_waypoints(tmp_path / "way.json", ARRAY)
    assert "way.json" in str(caught.value)


# Styles


def settings(
    grid_of_views: tuple[int, int] | None = None,
    focus_px: float | None = None,
    convergence_px: float | None = None,
) -> ShotSettings:
    extremes_px = (FAR_PX, NEAR_PX)
    return ShotSettings(ARRAY, 2.0, FAR_PX, extremes_px, grid_of_views, focus_px, convergence_px)


def test_settings_follow_from_the_scene() -> None:
    found = ShotSettings.of(SCENE.decoded())
    assert found.median_px == found.screen_px == FAR_PX
    assert found.extremes_px == (FAR_PX, NEAR_PX)
    # What is nearest has 3 % of the width of parallax, when the median lies in the plane of the screen.
    assert found.eye_steps * (NEAR_PX - FAR_PX) == pytest.approx(0.03 * 96)
    nearer = ShotSettings.of(SCENE.decoded(), convergence_px=10.0)
    assert nearer.eye_steps * (10 - FAR_PX) == pytest.approx(0.03 * 96)


def test_a_refocused_picture_is_made_of_as_many_views_as_blur_without_ghosts() -> None:
    shot = STYLES["mono"](settings(focus_px=FAR_PX))
    assert shot.grid is not None
    places = shot.places(MIDDLE)
    # The near plane moves by 4 px a step against the far one: over 4 steps, and over 2 rows at rho 1.5.
    assert shot.grid == (1 + 12, 1 + 16)
    rows, cols = sorted({place.row for place in places}), sorted({place.col for place in places})
    assert max(np.diff(cols)) * (NEAR_PX - FAR_PX) <= 1 + 1e-9
    assert max(np.diff(rows)) * (NEAR_PX - FAR_PX) * ARRAY.rho <= 1 + 1e-9
    # Round: the corners of the array are not looked through, the middles of its sides are.
    assert Viewpoint(0, 0) not in places
    assert {Viewpoint(0, 2), Viewpoint(1, 0), Viewpoint(1, 4), Viewpoint(2, 2)} <= set(places)
    wide = STYLES["mono"](settings(focus_px=90))
    assert len(wide.places(MIDDLE)) <= 1024
    assert len(STYLES["mono"](settings((5, 5), focus_px=FAR_PX)).places(MIDDLE)) == 25


def test_pictures_come_in_the_order_of_their_moments() -> None:
    decoded = SCENE.decoded()
    places = [Viewpoint(0, col) for col in (4, 0, 2, 2, 0, 4)]
    shot = STYLES["mono"](settings())
    pictures = list(take(shot, ((decoded, place) for place in places), Linear()))
    for place, picture in zip(places, pictures, strict=True):
        np.testing.assert_array_equal(picture, decoded.pictures[0, int(place.col)])


def test_a_pair_of_eyes_shows_the_plane_of_the_screen_once() -> None:
    decoded = SCENE.decoded()
    parallel = STYLES["side-by-side"](settings(convergence_px=0))
    (pair,) = take(parallel, [(decoded, Viewpoint(0, 1))], Linear())
    np.testing.assert_array_equal(pair, np.hstack([decoded.pictures[0, 0], decoded.pictures[0, 2]]))
    converged = STYLES["side-by-side"](settings())  # at the median, which is the far plane's
    (pair,) = take(converged, [(decoded, Viewpoint(0, 1))], Linear())
    np.testing.assert_array_equal(pair[:, 4:12], pair[:, 96 + 4 : 96 + 12])


def test_a_mosaic_of_the_grid_lies_as_the_cameras_stand() -> None:
    decoded = SCENE.decoded()
    (sheet,) = take(STYLES["mosaic"](settings((2, 3))), [(decoded, MIDDLE)], Linear())
    rows = [np.hstack([decoded.pictures[row, col] for col in (0, 2, 4)]) for row in (0, 2)]
    np.testing.assert_array_equal(sheet, np.vstack(rows))


def test_a_quilt_has_the_leftmost_view_first_and_its_focus_in_the_middle_of_the_scene() -> None:
    decoded = SCENE.decoded()
    (sheet,) = take(STYLES["quilt"](settings((3, 1))), [(decoded, Viewpoint(0, 0))], Linear())
    tiles = [sheet[64 * (2 - number) : 64 * (3 - number)] for number in range(3)]
    # In the middle nothing moves; the far plane, which is in focus, lies in each view where it does there.
    np.testing.assert_array_equal(tiles[1], decoded.pictures[0, 2])
    for tile, col in ((tiles[0], 0), (tiles[2], 4)):
        there = seen_from(Viewpoint(0, 2)).disparity_px == 2 * FAR_PX
        seen = there & SCENE.seen_from(Viewpoint(0, 2), (0, col))
        assert seen.sum() > 1000
        np.testing.assert_array_equal(tile[seen], decoded.pictures[0, 2][seen])


def test_styles_refuse_grids_that_mean_nothing_to_them() -> None:
    for style in ("mono", "side-by-side", "anaglyph"):
        with pytest.raises(SettingError, match=r"^grid: found 2x3"):
            STYLES[style](settings((2, 3)))
    with pytest.raises(SettingError, match="expected 1xN"):
        STYLES["epipolar"](settings((2, 3)))
    with pytest.raises(SettingError, match="1024 views"):
        settings((33, 32))
    column = ShotSettings(grid(3, 1, 8, 8), 0.0, 1.0, (1.0, 1.0))
    for style in ("side-by-side", "anaglyph", "quilt"):
        with pytest.raises(SettingError, match="one column"):
            STYLES[style](column)


# Files

"""The default matcher on scenes whose disparity is known exactly: who is heard, and what is completed."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from plane_scene import MARGIN, Plane, PlaneScene, grid
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Picture
from mvcodec.stereo.joint import Joint
from mvcodec.stereo.joint_settings import JointSettings


def pictures_of(scene: PlaneScene) -> dict[Position, Picture]:
    return {camera: scene.render(Viewpoint(*camera))[0] for camera in scene.array.real}


def truth_of(scene: PlaneScene, camera: Position) -> FloatMap:
    return scene.render(Viewpoint(*camera))[1]


def noise(seed: int, height: int, width: int, low: int = 0, high: int = 256) -> Picture:
    return np.random.default_rng(seed).integers(low, high, (height, width, 3), np.uint8)


# The square of `Planes` at 150 x 100, and what is beside and above it in the upper left camera.
BESIDE, ABOVE = np.s_[28:72, 40:48], np.s_[15:23, 53:97]


@pytest.mark.parametrize(
    ("shape", "hidden", "seen"), [((1, 2), BESIDE, ABOVE), ((2, 1), ABOVE, BESIDE)], ids=["1x2", "2x1"]
)
def test_background_that_the_only_partner_does_not_see_is_completed(
    shape: tuple[int, int], hidden: tuple[slice, slice], seen: tuple[slice, slice]
) -> None:
    array = linear_or_grid(*shape, 150, 100)
    found = Joint().match(array, Planes(array, 2, 14).pictures(), (0.0, 20.0))[0, 0]
    assert found.valid[hidden].mean() < 0.1
    assert np.abs(found.values_px[hidden] - 2).mean() < 0.1
    assert found.valid[seen].mean() > 0.95
    assert np.abs(found.values_px[seen] - 2).mean() < 0.1


def test_background_hidden_from_one_partner_is_seen_by_the_other() -> None:
    array = linear_or_grid(2, 2, 150, 100)
    found = Joint().match(array, Planes(array, 2, 14).pictures(), (0.0, 20.0))[0, 0]
    for region in (BESIDE, ABOVE):
        assert found.valid[region].mean() > 0.95
        assert np.abs(found.values_px[region] - 2).mean() < 0.1


def test_hidden_background_does_not_join_an_object_of_its_colour_that_others_would_see() -> None:
    scene = PlaneScene(linear_or_grid(1, 2, 120, 60), 2, (Plane(14, (15, 50, 45, 90)),))
    far, near = scene.textures
    far[:] = noise(1, len(far), far.shape[1], 236)
    near[:] = noise(2, len(near), near.shape[1], 0, 20)
    hidden = np.s_[18:42, 38:50]  # dark as the square, so that colour puts it there
    far[:, MARGIN + 38 : MARGIN + 50] = noise(3, len(far), 12, 0, 20)
    bad = {}
    for through_cost in (0, JointSettings().through_cost):
        matcher = Joint(JointSettings(through_cost=through_cost))
        found = matcher.match(scene.array, pictures_of(scene), (0.0, 20.0))[0, 0]
        assert found.valid[hidden].mean() < 0.1
        bad[through_cost] = np.mean(np.abs(found.values_px[hidden] - 2) > 1)
    assert bad[0] > 0.3
    assert bad[JointSettings().through_cost] < 0.05


def test_a_pole_holds_by_its_edges() -> None:
    """They match at every disparity in the camera below, which must not decide."""
    scene = PlaneScene(linear_or_grid(2, 2, 120, 90), 2, (Plane(10, (-30, 52, 120, 60)),))
    scene.textures[0][:] = cv2.GaussianBlur(scene.textures[0], (0, 0), 1.5)
    scene.textures[1][:] = 60
    bad = {}
    for blind_cost in (0, JointSettings().blind_cost):
        matcher = Joint(JointSettings(blind_cost=blind_cost, plain_levels=0))
        found = matcher.match(scene.array, pictures_of(scene), (0.0, 16.0))
        bad[blind_cost] = np.mean(np.abs(found[0, 0].values_px - truth_of(scene, (0, 0))) > 1)
    assert bad[0] > 0.005
    assert bad[JointSettings().blind_cost] < 0.001


def test_an_edge_that_runs_along_a_baseline_costs_less_where_many_disparities_are_possible() -> None:
    settings = JointSettings(blind_cost=40)
    assert settings.blind_cost_within((0, 16)) == settings.blind_cost_within((-9, 9)) == 40
    costs = [settings.blind_cost_within((5.0, 5.0 + width)) for width in (30, 60, 160, 4000)]
    assert costs == sorted(costs, reverse=True)
    assert 40 > costs[0] > costs[2] > costs[3] == 0


def stripes(shape: tuple[int, int], rho: float, *, horizontal: bool) -> dict[Position, FloatMap]:
    """Maps of a plane at 6 px that varies along one axis only."""
    array = linear_or_grid(*shape, 80, 80, rho=rho)
    line = noise(4, 100, 1)
    pictures = {}
    for row, col in array.real:
        moved = round(6 * array.cell_rho) * row if horizontal else 6 * col
        picture = np.repeat(line[moved : moved + 80], 80, axis=1)
        pictures[row, col] = np.ascontiguousarray(picture if horizontal else picture.transpose(1, 0, 2))
    maps = Joint().match(array, pictures, (0.0, 15.0))
    return {camera: found.values_px[10:-10, 10:-10] for camera, found in maps.items()}


@pytest.mark.parametrize("rho", [0.5, 1.0])
@pytest.mark.parametrize("horizontal", [True, False], ids=["horizontal stripes", "vertical stripes"])
def test_the_partner_across_the_stripes_decides(horizontal: bool, rho: float) -> None:
    for values in stripes((2, 2), rho, horizontal=horizontal).values():
        assert np.abs(values - 6).mean() < 0.1


@pytest.mark.parametrize("horizontal", [True, False], ids=["horizontal stripes", "vertical stripes"])
def test_the_partner_along_the_stripes_knows_nothing(horizontal: bool) -> None:
    for values in stripes((1, 2) if horizontal else (2, 1), 1.0, horizontal=horizontal).values():
        assert np.abs(values - 6).mean() > 2
    for values in stripes((2, 1) if horizontal else (1, 2), 1.0, horizontal=horizontal).values():
        assert np.abs(values - 6).mean() < 0.1


@pytest.mark.parametrize("shape", [(1, 2), (2, 1), (2, 2)], ids=str)
@pytest.mark.parametrize("disparity", [12, -12])
def test_border_that_no_partner_sees_is_extended(shape: tuple[int, int], disparity: int) -> None:
    array = linear_or_grid(*shape, 90, 70)
    maps = Joint().match(array, Planes(array, disparity, disparity).pictures(), (-16.0, 16.0))
    y, x = np.mgrid[:70, :90]
    for camera, found in maps.items():
        unseen = np.ones((70, 90), np.bool_)
        for other in set(array.real) - {camera}:
            if other[0] == camera[0] or other[1] == camera[1]:
                u, v = (x - (other[1] - camera[1]) * disparity, y - (other[0] - camera[0]) * disparity)
                unseen &= (u < 0) | (u >= 90) | (v < 0) | (v >= 70)
        assert unseen.sum() >= 144
        assert found.valid[unseen].mean() < 0.1
        assert found.valid[~unseen].mean() > 0.95
        assert np.abs(found.values_px - disparity).max() < 0.5


def test_beyond_the_partner_surfaces_end_where_the_picture_has_its_edges() -> None:
    """Background and a coloured object, whose slanting contour only one camera sees."""
    array = linear_or_grid(1, 2, 140, 90)
    rng = np.random.default_rng(6)
    background, object_ = rng.integers(20, 50, (90, 220, 3)), rng.integers(190, 220, (90, 220, 3))
    y, x = np.mgrid[:90, :220]
    pictures, truth = {}, np.zeros((90, 140), np.float32)
    for camera in array.real:
        inside = (y > 20 + (x + 30 * camera[1]) // 4) & (y < 75)
        picture = np.where(
            inside[..., None], np.roll(object_, -30 * camera[1], 1), np.roll(background, -24 * camera[1], 1)
        )
        pictures[camera] = np.ascontiguousarray(picture[:, :140], np.uint8)
        if camera == (0, 0):
            truth[inside[:, :140]] = 6
    found = Joint().match(array, pictures, (20.0, 34.0))[0, 0]
    assert not found.valid[:, :20].any()
    assert np.mean(np.abs(found.values_px - 24 - truth)[:, :20] < 1) > 0.97


def test_object_and_background_are_extended_each_to_the_border() -> None:
    scene = PlaneScene(linear_or_grid(1, 2, 100, 70), 4, (Plane(12, (20, -30, 50, 40)),))
    found = Joint().match(scene.array, pictures_of(scene), (0.0, 20.0))[0, 0]
    border = found.values_px[:, :12]
    assert not found.valid[:, :4].any()
    assert np.mean(np.abs(border[22:48] - 12) > 1) < 0.3  # its corners are rounded
    assert np.abs(border[:17] - 4).max() < 0.5
    assert np.abs(border[53:] - 4).max() < 0.5


BESIDE_THE_CENTRE: list[Position] = [(0, 1), (1, 0), (1, 2), (2, 1)]


def centre_of_nine(deaf: list[Position]) -> tuple[float, float]:
    """(share of bad, share of valid) of the centre of 3 x 3 where the `deaf` cameras took something else."""
    array = linear_or_grid(3, 3, 70, 60)
    pictures = Planes(array, 8, 8).pictures()
    for seed, camera in enumerate(deaf):
        pictures[camera] = noise(seed, 60, 70)
    centre = Joint().match(array, pictures, (0.0, 30.0))[1, 1]
    inner = np.s_[12:-12, 12:-12]
    return float(np.mean(np.abs(centre.values_px[inner] - 8) > 1)), float(centre.valid[inner].mean())


@pytest.mark.parametrize("partner", BESIDE_THE_CENTRE, ids=str)
def test_any_one_of_four_partners_is_enough(partner: Position) -> None:
    bad, valid = centre_of_nine([camera for camera in BESIDE_THE_CENTRE if camera != partner])
    assert bad < 0.05
    assert valid > 0.9


def test_without_a_partner_the_centre_knows_nothing() -> None:
    bad, valid = centre_of_nine(BESIDE_THE_CENTRE)
    assert bad > 0.8
    assert valid < 0.4


def test_amid_partners_every_pixel_is_seen() -> None:
    array = linear_or_grid(3, 3, 70, 60)
    maps = Joint().match(array, Planes(array, 8, 8).pictures(), (0.0, 12.0))
    assert all(maps[camera].valid.mean() > 0.99 for camera in (*BESIDE_THE_CENTRE, (1, 1)))
    # A corner has nobody on two sides: 8 x 8 pixels are its own.
    assert not maps[0, 0].valid[:7, :7].any()
    assert not maps[2, 2].valid[-7:, -7:].any()


@pytest.mark.parametrize(("step", "row_step"), [(2, 2), (4, 2)], ids=["rho 1", "rho 0.5"])
def test_disparity_is_that_of_a_cell_whatever_its_steps(step: int, row_step: int) -> None:
    array = grid(5, 5, 100, 80, step=step, row_step=row_step)
    scene = PlaneScene(array, 4, (Plane(12, (20, 30, 60, 70)),))
    maps = Joint().match(array, pictures_of(scene), (0.0, 16.0))
    for camera in array.real:
        assert np.mean(np.abs(maps[camera].values_px - truth_of(scene, camera)) > 1) < 0.01


@pytest.mark.parametrize("high", range(4, 13))
def test_both_ends_of_the_range_are_found(high: int) -> None:
    array = linear_or_grid(1, 2, 60, 40)
    for disparity in (-1.0, float(high)):
        found = Joint().match(array, Planes(array, disparity, disparity).pictures(), (-1.0, high))[0, 0]
        assert found.valid[:, high:].mean() > 0.95
        assert np.abs(found.values_px - disparity).mean() < 0.1


@pytest.mark.parametrize("disparity", [3.3, -2.6])
def test_sub_pixel_steps_place_a_plane_between_levels(disparity: float) -> None:
    array = linear_or_grid(2, 2, 100, 60)
    pictures = Planes(array, disparity, disparity).pictures()
    without, with_steps = (
        Joint(JointSettings(subpixel_steps=steps)).match(array, pictures, (-8.0, 8.0)) for steps in (0, 2)
    )
    for camera in array.real:
        error = np.abs(with_steps[camera].values_px - disparity).mean()
        assert error < 0.05
        assert error < np.abs(without[camera].values_px - disparity).mean() / 2


def test_lone_camera_is_flat_at_the_far_end_of_a_negative_range() -> None:
    array = linear_or_grid(1, 1, 20, 10)
    maps = Joint().match(array, {(0, 0): noise(0, 10, 20)}, (-3.5, 9.0))
    assert set(maps) == {(0, 0)}
    assert (maps[0, 0].values_px == np.float32(-3.5)).all()
    assert not maps[0, 0].valid.any()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: JointSettings(colour_limit=61), "colour_limit: found 61, expected a whole number, 0..60"),
        (lambda: JointSettings(most_bits=-1), "JointSettings.most_bits: found -1"),
        (lambda: JointSettings(lone_cost=51), "JointSettings.lone_cost: found 51"),
        (lambda: JointSettings(outside_cost=255), "JointSettings.outside_cost: found 255"),
        (lambda: JointSettings(tolerance_px=0), "JointSettings.tolerance_px: found 0"),
        (lambda: JointSettings(subpixel_steps=-1), "JointSettings.subpixel_steps: found -1"),
        (lambda: JointSettings(row_cost=float("nan")), "JointSettings.row_cost: found nan"),
        (lambda: JointSettings(median_size=4), "JointSettings.median_size: found 4, expected one of 0, 3, 5"),
        (lambda: JointSettings(bit_cost=60), "the highest cost: found 1342, expected at most 156"),
    ],
)
def test_bad_settings_are_named(make: Callable[[], JointSettings], text: str) -> None:
    with pytest.raises(SettingError, match=text):
        make()


def test_settings_at_their_limits_still_make_maps() -> None:
    """Costs stay within their 8 bits where every one of them is the highest."""
    dearest = JointSettings(
        60,
        bit_cost=3,
        most_bits=20,
        lone_cost=12,
        blind_cost=20,
        outside_cost=127,
        through_cost=127,
        median_size=0,
    )
    array = linear_or_grid(2, 2, 90, 70)
    scene = Planes(array, 2, 8)
    maps = Joint(dearest).match(array, scene.pictures(), (0.0, 12.0))
    for camera in array.real:
        assert np.mean(np.abs(maps[camera].values_px - scene.disparity_px(camera)) > 1) < 0.1


def pole_and_speck(nearer_px: float, *, confirmed: bool) -> tuple[FloatMap, FloatMap]:
    """A map with a pole 2 px wide and a speck, before and after smoothing."""
    disparity = np.full((40, 60), 3, np.float32)
    disparity[5:35, 20:22] += nearer_px
    disparity[8:10, 40:42] += nearer_px
    smooth = Joint()._smoothed(disparity, np.full(disparity.shape, confirmed), (0.0, 20.0))
    return disparity, smooth


@pytest.mark.parametrize("nearer_px", [9, 2])
def test_a_confirmed_pole_outlives_the_median_and_a_speck_does_not(nearer_px: float) -> None:
    disparity, smooth = pole_and_speck(nearer_px, confirmed=True)
    assert (smooth[6:34, :30] == disparity[6:34, :30]).all()
    assert (smooth[:, 30:] == 3).all()


def test_a_pole_that_nobody_confirms_goes() -> None:
    _, smooth = pole_and_speck(9, confirmed=False)
    assert (smooth == 3).all()


def test_the_median_evens_out_the_contour_of_an_object_all_the_same() -> None:
    ragged = np.full((40, 60), 3, np.float32)
    ragged[10:30, 20:40] = 12
    ragged[12:30:4, 40] = 12
    smooth = Joint()._smoothed(ragged, np.ones(ragged.shape, np.bool_), (0.0, 20.0))
    assert (smooth[:, 40] == 3).all()


def test_a_pole_before_a_wall_is_in_the_map() -> None:
    array = linear_or_grid(2, 2, 120, 80)
    scene = PlaneScene(array, 2, (Plane(14, (10, 60, 80, 62)),))
    for camera, found in Joint().match(array, pictures_of(scene), (0.0, 16.0)).items():
        pole = truth_of(scene, camera) == 14
        assert (np.abs(found.values_px[pole] - 14) < 1).mean() > 0.3  # without the exception: 0

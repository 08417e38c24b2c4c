"""DILS of one pair: against the equations step by step, on exact planes, holes, borders; its kernels."""

from __future__ import annotations

import numpy as np
import pair_twins
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, Picture
from mvcodec.kernels import pair_rows
from mvcodec.layers.dils_split import split
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.mlvs import View


def view_of(pixels: Picture, disparity: DisparityMap) -> View:
    return View(pixels, disparity, np.ones(pixels.shape[:2], np.uint8))


def random_pair(seed: int, height: int = 40, width: int = 60) -> tuple[View, View]:
    """Noise pictures; a map of patches of whole and negative disparities with an eighth of it invalid."""
    rng = np.random.default_rng(seed)
    patches = rng.integers(-12, 25, (-(-height // 8), -(-width // 6)))
    values = np.repeat(np.repeat(patches, 8, axis=0), 6, axis=1)[:height, :width].astype(np.float32)
    disparity = DisparityMap(values, rng.random((height, width)) > 1 / 8)
    left, right = rng.integers(0, 256, (2, height, width, 3), dtype=np.uint8)
    return view_of(left, disparity), view_of(right, disparity)


@pytest.mark.parametrize("beta", [0.0, 0.25, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_is_the_equations_layer_by_layer(seed: int, beta: float) -> None:
    left, right = random_pair(seed)
    view = Dils(DilsSettings(fill=False)).synthesize_pair(left, right, beta, 1.0)
    layers = split(left.disparity)
    assert len(layers.bounds_px) > 0
    expected = pair_twins.dils_without_filling(left.pixels, right.pixels, layers, beta)
    np.testing.assert_array_equal(view.pixels, expected)


@pytest.mark.parametrize("shift", [0, 32, -24])
@pytest.mark.parametrize("col", [1, 2, 3])
def test_planes_come_out_exactly_where_both_cameras_see(shift: int, col: int) -> None:
    boxes = (Plane(12 + shift, (10, 40, 60, 90)), Plane(20 + shift, (30, 70, 80, 130)))
    scene = PlaneScene(grid(1, 5, 160, 90, step=4), 4 + shift, boxes)
    viewpoint = Viewpoint(0, col)
    truth, depth = scene.render(viewpoint)
    both = scene.seen_from(viewpoint, (0, 0)) & scene.seen_from(viewpoint, (0, 4))
    assert both.mean() > 0.6
    rendered = Dils().render(scene.decoded(), viewpoint)
    np.testing.assert_array_equal(rendered.pixels[both], truth[both])
    np.testing.assert_array_equal(rendered.disparity_px[both], depth[both])
    assert (rendered.seen_by[both] == 2).all()


def test_layers_move_by_their_average() -> None:
    values = np.full((20, 40), 4, np.float32)
    values[10:] = 6
    left = view_of(np.full((20, 40, 3), 50, np.uint8), DisparityMap(values, np.ones((20, 40), np.bool_)))
    left.pixels[:, 30] = 200
    right = view_of(np.roll(left.pixels, -5, axis=1), left.disparity)
    view = Dils().synthesize_pair(left, right, 0.8, 1.0)
    assert split(left.disparity).bounds_px == ((4, 6),)
    np.testing.assert_array_equal(np.flatnonzero(view.pixels[3, :30, 0] == 200), [26])


def test_holes_take_the_nearest_pixel_of_the_row_or_stay_black() -> None:
    left, right = random_pair(5)
    filled = Dils().synthesize_pair(left, right, 0.5, 1.0)
    black = Dils(DilsSettings(fill=False)).synthesize_pair(left, right, 0.5, 1.0)
    holes = ~black.disparity.valid
    assert filled.disparity.valid.all()
    assert 0 < holes.sum() < holes.size
    assert not filled.seen_by[holes].any()
    assert not black.pixels[holes].any()
    np.testing.assert_array_equal(filled.pixels[~holes], black.pixels[~holes])
    y, x = (int(index) for index in np.argwhere(holes & (np.arange(60) > 3) & (np.arange(60) < 56))[0])
    known = np.flatnonzero(~holes[y])
    nearest = known[np.abs(known - x).argmin()]
    np.testing.assert_array_equal(filled.pixels[y, x], filled.pixels[y, nearest])
    assert filled.disparity.values_px[y, x] == filled.disparity.values_px[y, nearest]


def test_one_layer_a_level_follows_a_slope_that_one_layer_cannot() -> None:
    """On a slanted surface of 0..30 px the rigid layer is wrong and the finer split is right."""
    rng = np.random.default_rng(1)
    height, width = 60, 200
    depth = np.repeat(np.arange(31), 2)[:height]
    texture = rng.integers(0, 256, (height, width + 60, 3), dtype=np.uint8)
    left = np.stack([row[:width] for row in texture])
    right = np.stack([row[d : d + width] for row, d in zip(texture, depth, strict=True)])
    middle = np.stack(
        [row[round(d / 2) : round(d / 2) + width] for row, d in zip(texture, depth, strict=True)]
    )
    values = np.repeat(depth[:, None], width, axis=1).astype(np.float32)
    disparity = DisparityMap(values, np.ones((height, width), np.bool_))
    pair = view_of(left, disparity), view_of(right, disparity)
    runs = Dils().synthesize_pair(*pair, 0.5, 1.0)
    levels = Dils(DilsSettings(split="levels")).synthesize_pair(*pair, 0.5, 1.0)
    inner = slice(40, 150)
    np.testing.assert_array_equal(levels.pixels[:, inner], middle[:, inner])
    assert (runs.pixels[:, inner] != middle[:, inner]).mean() > 0.8


@pytest.mark.parametrize(
    ("field", "value"), [("split", "valley"), ("threshold", -1), ("alpha", 1.5), ("alpha", float("nan"))]
)
def test_settings_are_checked(field: str, value: object) -> None:
    with pytest.raises(SettingError, match=f"DilsSettings.{field}: found"):
        DilsSettings(**{field: value})  # type: ignore[arg-type]


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (7, 1), (13, 31)])
@pytest.mark.parametrize("seed", range(4))
def test_kernels_equal_their_twins(size: tuple[int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    shift = rng.integers(-6, 7, size).astype(np.int32)
    right_shift = rng.integers(-9, 10, size).astype(np.int32)
    nearness = rng.integers(0, 5, size).astype(np.float32)
    usable = rng.random(size) > 0.3
    source = pair_rows.forward_sources(shift, nearness, usable)
    np.testing.assert_array_equal(source, pair_twins.forward_sources(shift, nearness, usable))

    left, right = rng.integers(0, 256, (2, *size, 3), dtype=np.uint8)
    left_seen, right_seen = rng.integers(0, 3, (2, *size), dtype=np.uint8)
    weight = float(rng.choice([0.0, 0.25, 0.5, 1.0]))
    arguments = (left, right, nearness, left_seen, right_seen, source, right_shift, weight)
    fast = pair_rows.blend_pair(*arguments)
    for got, expected in zip(fast, pair_twins.blend_pair(*arguments), strict=True):
        np.testing.assert_array_equal(got, expected, strict=True)

    known = source >= 0
    nearest = pair_rows.nearest_known(known)
    np.testing.assert_array_equal(nearest, pair_twins.nearest_known(known))
    pixels, disparity = pair_rows.filled_along_rows(fast[0], fast[1], nearest)
    y, x = np.arange(size[0])[:, None], np.where(nearest >= 0, nearest, np.arange(size[1]))
    np.testing.assert_array_equal(pixels, fast[0][y, x])
    np.testing.assert_array_equal(disparity, fast[1][y, x])

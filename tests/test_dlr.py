"""Depth Layer Refinement: growth against its plain twin, segments, and blurred maps made sharp again."""

from __future__ import annotations

import heapq
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import succeeds
from numpy.typing import NDArray
from stereo_scene import Planes, linear_or_grid

from mvcodec.capture import open_input
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.kernels.growth import nearest_seeds
from mvcodec.layers.dlr import DlrSettings, refine
from mvcodec.layers.picture_segments import split_picture
from mvcodec.layers.refinement import make_matcher, matcher_choices
from mvcodec.stereo.consistency import median
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"
SIZES = [(9, 13), (1, 1), (1, 17), (6, 1), (4, 5)]


def all_valid(values: FloatMap) -> DisparityMap:
    return DisparityMap(values.astype(np.float32), np.ones(values.shape, np.bool_))


def plain_distances(seeds: Mask, row_costs: FloatMap, column_costs: FloatMap) -> NDArray[np.float64]:
    """Dijkstra's algorithm."""
    height, width = seeds.shape
    distances = np.full(seeds.shape, np.inf)
    queue = [(0.0, int(y), int(x)) for y, x in np.argwhere(seeds)]
    while queue:
        distance, y, x = heapq.heappop(queue)
        if distance >= distances[y, x]:
            continue
        distances[y, x] = distance
        for row, column in ((y, x - 1), (y, x + 1), (y - 1, x), (y + 1, x)):
            if 0 <= row < height and 0 <= column < width:
                costs = row_costs if row == y else column_costs
                step = float(costs[max(y, row), max(x, column)])
                heapq.heappush(queue, (distance + step, row, column))
    return distances


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
def test_growth_reaches_what_its_plain_twin_reaches(size: tuple[int, int], share: float) -> None:
    rng = np.random.default_rng(1)
    seeds = rng.uniform(size=size) < share
    costs = rng.integers(1, 6, (2, *size)).astype(np.float32)
    costs[rng.uniform(size=costs.shape) < 0.1] = np.inf
    nearest = nearest_seeds(seeds, costs[0], costs[1])
    from_any = plain_distances(seeds, costs[0], costs[1])
    np.testing.assert_array_equal(nearest >= 0, np.isfinite(from_any))
    for y, x in np.argwhere(nearest >= 0):
        owner = np.zeros(size, np.bool_)
        owner.flat[nearest[y, x]] = True
        assert seeds.flat[nearest[y, x]]
        assert plain_distances(owner, costs[0], costs[1])[y, x] == from_any[y, x]


def patches() -> Picture:
    picture = np.full((60, 90, 3), (200, 40, 40), np.uint8)
    picture[10:50, 20:50] = (40, 40, 200)
    picture[20:40, 60:80] = (40, 200, 40)
    noise = np.random.default_rng(0).integers(-3, 4, picture.shape)
    return (picture + noise).astype(np.uint8)


def test_segments_are_the_patches_of_one_colour() -> None:
    segments = split_picture(patches())
    assert segments.count == 3
    for part in (np.s_[10:50, 20:50], np.s_[20:40, 60:80]):
        inside = segments.labels[part]
        values, counts = np.unique(inside, return_counts=True)
        assert counts.max() > 0.97 * inside.size
        assert (segments.labels == values[counts.argmax()]).sum() < 1.05 * inside.size


def test_edges_lie_on_the_borders_of_the_patches() -> None:
    segments = split_picture(patches())
    strong_rows = segments.row_edges[30] > 50
    assert strong_rows[[19, 20, 21]].any()
    assert strong_rows[[49, 50, 51]].any()
    assert not strong_rows[25:45].any()
    assert (segments.column_edges[:, 35] > 50)[[9, 10, 11]].any()


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (30, 1), (2, 2), (7, 5), (3, 80)], ids=str)
@pytest.mark.parametrize("valid", [0.0, 0.5, 1.0])
def test_survives_tiny_pictures_and_invalid_maps(size: tuple[int, int], valid: float) -> None:
    rng = np.random.default_rng(2)
    picture = rng.integers(0, 256, (*size, 3), np.uint8)
    known = rng.uniform(size=size) < valid
    found = refine(picture, DisparityMap(rng.uniform(-9, 30, size).astype(np.float32), known))
    assert found.values_px.shape == found.valid.shape == size
    assert found.values_px.dtype == np.float32
    assert np.isfinite(found.values_px).all()
    assert not (found.valid & ~known).any()


def square_scene(slope: float = 0.0) -> tuple[Picture, FloatMap]:
    """A near blue square before a red wall, with the exact map; both surfaces may be slanted."""
    height, width = 90, 140
    y, x = np.mgrid[:height, :width]
    near = (abs(y - 45) < 22) & (abs(x - 80) < 25)
    picture = np.where(near[..., None], (40, 40, 200), (200, 60, 40)).astype(np.uint8)
    return picture, np.where(near, 20 + slope * x, 4 + slope * x).astype(np.float32)


@pytest.mark.parametrize("slope", [0.0, 0.05])
def test_takes_back_what_the_window_added_to_the_near_square(slope: float) -> None:
    picture, exact = square_scene(slope)
    fattened = np.asarray(cv2.dilate(exact, np.ones((11, 11), np.uint8)), np.float32)
    found = refine(picture, all_valid(fattened))
    assert np.mean(np.abs(fattened - exact) > 1) > 0.07
    assert np.mean(np.abs(found.values_px - exact) > 1) < 0.02


def test_removes_specks() -> None:
    picture, exact = square_scene()
    spoilt = exact.copy()
    spoilt[5:9, 30:34] = 17
    spoilt[40:44, 80:83] = 4
    found = refine(picture, all_valid(spoilt))
    assert np.abs(found.values_px - exact)[5:9, 30:34].max() < 1
    assert np.abs(found.values_px - exact)[40:44, 80:83].max() < 1


def test_slanted_surfaces_keep_their_slope_and_carry_it_on() -> None:
    picture = np.full((60, 120, 3), 90, np.uint8)
    x = np.broadcast_to(np.arange(120, dtype=np.float32), (60, 120))
    exact = 6 + 0.1 * x
    spoilt = exact.copy()
    spoilt[:, :9] = 1  # the partner does not see these columns
    found = refine(picture, all_valid(np.rint(spoilt)))
    assert np.abs(found.values_px - exact).max() < 0.8  # 1.7 with the nearest value alone


def test_invalid_pixels_have_no_say() -> None:
    picture, exact = square_scene()
    spoilt, valid = exact.copy(), np.ones(exact.shape, np.bool_)
    spoilt[6:18, 10:60], valid[6:18, 10:60] = 12, False
    found = refine(picture, DisparityMap(spoilt, valid))
    assert np.abs(found.values_px - exact)[6:18, 10:60].max() < 1
    assert not found.valid[6:18, 10:60].any()
    assert found.valid[75:85, 15:30].all()


@pytest.mark.parametrize("grid", [(1, 2), (2, 1), (2, 2)], ids=str)
def test_follows_any_matcher_of_any_array(grid: tuple[int, int]) -> None:
    array = linear_or_grid(*grid, 97, 81)
    pictures = Planes(array, 3, 9).pictures()
    plain, after = make_matcher("sad"), make_matcher("sad+dlr")
    range_px = (0.0, 14.0)
    maps = after.match(array, pictures, range_px)
    raw = plain.match(array, pictures, range_px)
    for camera in array.real:
        assert maps[camera].values_px.shape == raw[camera].values_px.shape
        assert maps[camera].values_px.min() >= raw[camera].values_px.min()
        assert maps[camera].values_px.max() <= raw[camera].values_px.max()
        assert (maps[camera].values_px != raw[camera].values_px).any()


def test_transposed_arrays_give_transposed_maps() -> None:
    row, column = linear_or_grid(1, 2, 97, 81), linear_or_grid(2, 1, 81, 97)
    pictures = Planes(row, 3, 9).pictures()
    turned = {(col, 0): pictures[0, col].transpose(1, 0, 2).copy() for _, col in pictures}
    along, down = (
        make_matcher("sad+dlr").match(array, views, (0.0, 14.0))
        for array, views in ((row, pictures), (column, turned))
    )
    for col in range(2):
        np.testing.assert_array_equal(down[col, 0].values_px, along[0, col].values_px.T)


def test_unknown_names_and_bad_settings_are_refused() -> None:
    for name in ("sad+dle", "sad+", "x+dlr", "x", ""):
        with pytest.raises(
            SettingError, match=r"matcher( refinement)?: found .*, expected one of (joint, .*, sad|dlr)"
        ):
            make_matcher(name)
    for settings, text in (
        ({"jump_px": 0}, "jump_px: found 0"),
        ({"erosion_px": -1}, "erosion_px: found -1"),
        ({"slope_window": 4}, "slope_window: found 4"),
        ({"least_share": 1}, "least_share: found 1"),
    ):
        with pytest.raises(SettingError, match=text):
            DlrSettings(**settings)


@pytest.mark.parametrize("command", ["encode", "evaluate"])
def test_help_and_errors_name_the_refinements(command: str) -> None:
    choices = matcher_choices()
    assert choices.startswith("one of joint, ")
    assert choices.endswith("given, with +dlr or +dlr-thesis behind it if wanted")
    assert choices in " ".join(succeeds(command, "--help").split()).replace("dlr- thesis", "dlr-thesis")


def test_the_encoder_takes_a_refined_matcher_by_name() -> None:
    array = linear_or_grid(1, 2, 64, 48)
    config = EncoderConfig(matcher="sad+dlr", disparity_range_px=(0.0, 14.0), preset="veryfast")
    with Encoder(array, config) as encoder:
        header, *_ = encoder.push(Planes(array, 3, 9).frame_set())
    assert b'"matcher":"sad+dlr"' in header.data.replace(b" ", b"")
    with pytest.raises(SettingError, match="matcher refinement: found x"):
        Encoder(array, EncoderConfig(matcher="sad+x"))


@pytest.mark.shared_data
@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is absent")
def test_cuts_the_bad_pixels_of_fixed_windows_by_three_tenths() -> None:
    """All pixels with truth, error above 1 px; one direction and an 11 x 11 median, as in the thesis."""
    shares = []
    for name, columns, window in (
        ("tsukuba", (2, 3), 11),
        ("venus", (0, 1), 25),
        ("teddy", (0, 1), 21),
        ("cones", (0, 2), 21),
    ):
        source = open_input([DATA / name])
        steps = columns[1] - columns[0]
        (frame,) = source.frame_sets(slice(0, 1), [(0, column) for column in columns])
        hint = source.array.disparity_per_step_px
        truth = source.truth((0, columns[0]), 0)
        assert hint is not None
        assert truth is not None
        range_px = hint[0] * steps, hint[1] * steps
        left, right = (frame.pictures[0, column] for column in columns)
        (values, _), _ = FixedWindow(FixedWindowSettings("sad", window)).raw_pair(left, right, range_px)
        raw = median(values, 11, range_px)
        bad = [
            np.mean(np.abs(values_px - steps * truth.values_px)[truth.valid] > 1)
            for values_px in (raw, refine(left, all_valid(raw)).values_px)
        ]
        shares.append(1 - bad[1] / bad[0])
    assert np.mean(shares) >= 0.3
    assert min(shares) > 0.2

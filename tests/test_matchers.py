"""What every matcher of the table promises, and what single ones add."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import CameraArray, Position
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, Picture
from mvcodec.layers.refinement import make_matcher
from mvcodec.stereo.adcensus import AdCensus, AdCensusSettings
from mvcodec.stereo.fixed_window import MEASURES, FixedWindow, FixedWindowSettings
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.matchers import MATCHERS, make_base_matcher
from mvcodec.stereo.pairwise import Pairwise, camera_pairs
from mvcodec.stereo.sgbm import Sgbm, SgbmSettings

GRIDS = [(1, 2), (2, 1), (2, 2), (1, 3), (3, 3)]
CASES = [  # rho, far, near, range
    (1.0, 3.0, 9.0, (0.0, 14.0)),
    (1.0, -7.0, 4.0, (-10.0, 6.0)),
    (0.5, 4.0, 10.0, (2.0, 12.0)),
    (1.5, -6.0, -2.0, (-8.0, 0.0)),
]
# Of all pixels. Fixed windows (21 x 21 of sad, 9 x 9 else) round corners and shift contours.
ESTIMATING = [name for name in MATCHERS if name != "given"]
"""Those that need pictures alone; given maps have tests of their own."""

MOST_BAD = dict.fromkeys(MATCHERS, 0.08) | {"sad": 0.25, "ssd": 0.12, "ncc": 0.12, "census": 0.12}


REFINED = ["sad+dlr", "sad+dlr-thesis"]
MOST_BAD |= dict.fromkeys(REFINED, 0.25)


@pytest.fixture(params=[*ESTIMATING, *REFINED])
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def check_form(maps: dict[Position, DisparityMap], array: CameraArray, range_px: tuple[float, float]) -> None:
    assert set(maps) == set(array.real)
    for disparity in maps.values():
        assert disparity.values_px.shape == disparity.valid.shape == (array.height, array.width)
        assert disparity.values_px.dtype == np.float32
        assert disparity.valid.dtype == np.bool_
        assert np.isfinite(disparity.values_px).all()
        assert disparity.values_px.min() >= np.float32(range_px[0]) - 1e-4
        assert disparity.values_px.max() <= np.float32(range_px[1]) + 1e-4


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: f"{grid[0]}x{grid[1]}")
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"rho{case[0]}_{case[1]}..{case[2]}")
def test_finds_planes(
    name: str, grid: tuple[int, int], case: tuple[float, float, float, tuple[float, float]]
) -> None:
    rho, far, near, range_px = case
    array = linear_or_grid(*grid, width=97, height=81, rho=rho if min(grid) > 1 else 1.0)
    scene = Planes(array, far, near)
    maps = make_matcher(name).match(array, scene.pictures(), range_px)
    check_form(maps, array, range_px)
    for position, disparity in maps.items():
        error = np.abs(disparity.values_px - scene.disparity_px(position))
        assert np.mean(error > 1) < MOST_BAD[name]
        assert np.mean(error[disparity.valid] > 1) < MOST_BAD[name] / 2 + 0.08 * name.startswith("sad")
        # Refinements erode layers: what then grows back isn't valid.
        assert disparity.valid.mean() > (0.3 if name in REFINED else 0.6)


@pytest.mark.parametrize("size", [(8, 6), (1, 1), (40, 1), (1, 40), (5, 33)], ids=str)
@pytest.mark.parametrize("range_px", [(0.0, 16.0), (-30.0, 70.0), (50.0, 60.0), (0.25, 0.5)], ids=str)
def test_survives_tiny_pictures(name: str, size: tuple[int, int], range_px: tuple[float, float]) -> None:
    array = linear_or_grid(2, 2, *size)
    scene = Planes(array, 1, 2)
    check_form(make_matcher(name).match(array, scene.pictures(), range_px), array, range_px)


@pytest.mark.parametrize("level", [0, 200])
def test_survives_flat_pictures(name: str, level: int) -> None:
    array = linear_or_grid(2, 2, 60, 50)
    flat = {position: np.full((50, 60, 3), level, np.uint8) for position in array.real}
    check_form(make_matcher(name).match(array, flat, (-4.0, 12.0)), array, (-4.0, 12.0))


def test_lone_camera_gets_a_flat_map(name: str) -> None:
    array = linear_or_grid(1, 1, 20, 10)
    maps = make_matcher(name).match(array, {(0, 0): np.zeros((10, 20, 3), np.uint8)}, (2.0, 9.0))
    assert (maps[0, 0].values_px == 2.0).all()
    assert not maps[0, 0].valid.any()


def test_leaves_its_input_alone(name: str) -> None:
    array = linear_or_grid(2, 2, 50, 40)
    pictures = Planes(array, 1, 5).pictures()
    before = {position: picture.copy() for position, picture in pictures.items()}
    make_matcher(name).match(array, pictures, (0.0, 8.0))
    assert all((pictures[position] == before[position]).all() for position in array.real)


def test_is_repeatable(name: str) -> None:
    array = linear_or_grid(2, 2, 90, 70)
    pictures = Planes(array, 1, 5).pictures()
    first, second = (make_matcher(name).match(array, pictures, (0.0, 8.0)) for _ in range(2))
    for position in array.real:
        assert (first[position].values_px == second[position].values_px).all()
        assert (first[position].valid == second[position].valid).all()


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("far", [2.5, 3.5, -4.5])
def test_fixed_windows_by_name_resolve_parts_of_a_pixel(measure: str, far: float) -> None:
    array = linear_or_grid(1, 2, 120, 60)
    scene = Planes(array, far, far)
    maps = make_matcher(measure).match(array, scene.pictures(), (-8.0, 8.0))
    # Whole pixels would be 0.5 px off.
    assert np.abs(maps[0, 0].values_px[:, 10:-10] - far).mean() < 0.2


def test_unknown_name_lists_the_choices() -> None:
    with pytest.raises(SettingError, match=r"matcher: found magic, expected one of .*sgbm.*sad"):
        make_base_matcher("magic")


@pytest.mark.parametrize("far", [2.5, 3.5, -4.5])
def test_sgbm_resolves_parts_of_a_pixel(far: float) -> None:
    array = linear_or_grid(1, 2, 120, 60)
    scene = Planes(array, far, far)
    maps = Pairwise(Sgbm()).match(array, scene.pictures(), (-8.0, 8.0))
    # StereoSGBM's parabola is biased by up to 0.17 px; whole pixels would be 0.5 px off.
    assert np.abs(maps[0, 0].values_px[:, 10:-10] - far).mean() < 0.2


@pytest.mark.parametrize(
    "matcher",
    [Sgbm(), AdCensus(), *(FixedWindow(FixedWindowSettings(measure, window=9)) for measure in MEASURES)],
    ids=["sgbm", "adcensus", *MEASURES],
)
@pytest.mark.parametrize("shift", [12, -12])
def test_no_column_is_lost_to_the_search_range(matcher: PairMatcher, shift: int) -> None:
    array = linear_or_grid(1, 2, 100, 40)
    pictures = Planes(array, shift, shift).pictures()
    left, right = matcher.match_pair(pictures[0, 0], pictures[0, 1], (-40.0, 40.0))
    # All that both cameras see is found, up to the edge.
    shared_left = np.s_[:, shift:] if shift > 0 else np.s_[:, :shift]
    shared_right = np.s_[:, :-shift] if shift > 0 else np.s_[:, -shift:]
    assert left.valid[shared_left].mean() > 0.95
    assert right.valid[shared_right].mean() > 0.95
    assert np.abs(left.values_px - shift).mean() < 0.5  # the rest is filled from there


def test_occluded_pixels_are_filled_from_the_farther_side() -> None:
    array = linear_or_grid(1, 2, 150, 60)
    scene = Planes(array, 2, 14)
    maps = Pairwise(Sgbm()).match(array, scene.pictures(), (0.0, 20.0))
    # The right camera does not see the background left of the square: left picture, 12 columns.
    hidden = np.s_[20:40, 150 // 3 - 10 : 150 // 3 - 3]
    assert maps[0, 0].valid[hidden].mean() < 0.5
    assert np.abs(maps[0, 0].values_px[hidden] - 2).mean() < 1


def test_vertical_partners_help_where_rows_are_flat() -> None:
    """Horizontal stripes say nothing along rows; only the upper-lower pairs can match them."""
    array = linear_or_grid(2, 2, 80, 80)
    stripes = np.repeat(np.random.default_rng(5).integers(0, 255, (100, 1, 3), np.uint8), 80, axis=1)
    pictures: dict[Position, Picture] = {
        (row, col): np.ascontiguousarray(stripes[6 * row : 6 * row + 80]) for row, col in array.real
    }
    both = Pairwise(Sgbm()).match(array, pictures, (0.0, 15.0))
    rows_only = Pairwise(Sgbm(), vertical=False).match(array, pictures, (0.0, 15.0))
    assert np.abs(both[0, 0].values_px - 6).mean() < 1
    assert np.abs(rows_only[0, 0].values_px - 6).mean() > 2


def test_pairs_are_those_of_neighbours() -> None:
    array = linear_or_grid(2, 3, 20, 10)
    pairs = camera_pairs(array)
    assert sum(not pair.vertical for pair in pairs) == 4
    assert sum(pair.vertical for pair in pairs) == 3
    assert all(
        (pair.second[0] - pair.first[0], pair.second[1] - pair.first[1])
        == ((1, 0) if pair.vertical else (0, 1))
        for pair in pairs
    )


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (lambda: SgbmSettings(block_size=4), "sgbm.block_size: found 4"),
        (lambda: SgbmSettings(p1=9, p2=9), "sgbm.p1, sgbm.p2: found 9, 9"),
        (lambda: SgbmSettings(prefilter_cap=64), "sgbm.prefilter_cap: found 64"),
        (lambda: SgbmSettings(uniqueness_percent=-1), "sgbm.uniqueness_percent: found -1"),
        (lambda: SgbmSettings(median_size=7), "sgbm.median_size: found 7"),
        (lambda: FixedWindowSettings("sum"), "fixed window.measure: found sum, expected one of sad, ssd"),
        (lambda: FixedWindowSettings(window=10), "sad.window: found 10"),
        (lambda: FixedWindowSettings("ncc", median_size=4), "ncc.median_size: found 4"),
        (lambda: FixedWindowSettings("census", tolerance_px=-1), "census.tolerance_px: found -1"),
        (lambda: AdCensusSettings(lambda_census=0), "adcensus.lambda_census: found 0"),
        (lambda: AdCensusSettings(colour=300), "adcensus.colour: found 300"),
        (lambda: AdCensusSettings(rounds=-1), "adcensus.rounds: found -1"),
        (lambda: AdCensusSettings(near_reach=40), "adcensus.near_reach, reach: found 40, 34"),
        (lambda: AdCensusSettings(step_penalty=4), "adcensus.step_penalty, jump_penalty: found 4, 3.0"),
        (lambda: AdCensusSettings(least_share=2), "adcensus.least_share: found 2"),
    ],
)
def test_bad_settings_are_named(settings: object, text: str) -> None:
    assert callable(settings)
    with pytest.raises(SettingError, match=text):
        settings()


def test_sgbm_refuses_ranges_beyond_its_arithmetic() -> None:
    picture = np.zeros((4, 4, 3), np.uint8)
    with pytest.raises(SettingError, match=r"disparity range: found 0\.\.3000"):
        Sgbm().match_pair(picture, picture, (0.0, 3000.0))

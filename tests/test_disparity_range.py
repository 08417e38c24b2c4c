"""The estimated range holds what is there and is not stretched by what cannot be matched."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.frames import FrameSet, Picture
from mvcodec.stereo.disparity_range import FALLBACK_RANGE_PX, estimate_range, make_room

DATA = Path(__file__).parents[2] / "shared" / "data"


def check(range_px: tuple[float, float], far: float, near: float) -> None:
    """The truth lies inside, and little else does."""
    slack = 4 + 0.15 * (near - far)
    assert far - slack <= range_px[0] <= far
    assert near <= range_px[1] <= near + slack


@pytest.mark.parametrize(
    ("far", "near"), [(3, 9), (-7, 4), (-20, -12), (8, 60), (70, 90), (0, 2), (-2.5, 2.5)]
)
def test_of_two_planes(far: float, near: float) -> None:
    array = linear_or_grid(1, 2, 320, 200)
    check(estimate_range(array, [Planes(array, far, near).frame_set()]), far, near)


@pytest.mark.parametrize("grid", [(1, 3), (2, 1), (3, 1), (2, 2), (3, 3)], ids=str)
@pytest.mark.parametrize("rho", [1.0, 0.6, 1.7])
def test_of_any_grid(grid: tuple[int, int], rho: float) -> None:
    array = linear_or_grid(*grid, 200, 160, rho=rho if min(grid) > 1 else 1.0)
    check(estimate_range(array, [Planes(array, -3, 14).frame_set()]), -3, 14)


def test_large_pictures_are_matched_in_small_copies() -> None:
    array = linear_or_grid(1, 2, 1000, 300)
    check(estimate_range(array, [Planes(array, 20, 150).frame_set()]), 20, 150)


def test_every_frame_counts() -> None:
    array = linear_or_grid(1, 2, 200, 120)
    frames = [Planes(array, far, far + 4).frame_set() for far in (2.0, 9.0, 16.0)]
    check(estimate_range(array, frames), 2, 20)


def with_noise(pictures: dict[Position, Picture], levels: float, rows: slice) -> dict[Position, Picture]:
    """Sensor noise of its own in each picture, on black where `rows` says so."""
    noisy = {}
    for index, (position, picture) in enumerate(pictures.items()):
        dark = picture.astype(np.float64)
        dark[rows] = 0
        noise = np.random.default_rng(index).normal(0, levels, picture.shape)
        noisy[position] = np.clip(dark + noise, 0, 255).astype(np.uint8)
    return noisy


@pytest.mark.parametrize("noise", [0.0, 3.0, 8.0])
def test_darkness_does_not_stretch_it(noise: float) -> None:
    array = linear_or_grid(1, 2, 320, 240)
    pictures = with_noise(Planes(array, 20, 32).pictures(), noise, np.s_[:120])
    check(estimate_range(array, [FrameSet(0, 0, pictures)]), 20, 32)


def test_a_flat_wall_does_not_stretch_it() -> None:
    array = linear_or_grid(1, 2, 320, 240)
    pictures = Planes(array, 20, 32).pictures()
    for picture in pictures.values():
        picture[:150] = 180
    check(estimate_range(array, [FrameSet(0, 0, pictures)]), 20, 32)


def test_a_black_frame_around_the_pictures_does_not_stretch_it() -> None:
    array = linear_or_grid(1, 2, 320, 240)
    pictures = Planes(array, 20, 32).pictures()
    for picture in pictures.values():
        picture[:3], picture[-3:], picture[:, :3], picture[:, -3:] = 0, 0, 0, 0
    check(estimate_range(array, [FrameSet(0, 0, pictures)]), 20, 32)


def test_repetitive_texture_does_not_stretch_it() -> None:
    """A wallpaper of period 24 px: it may match a few periods off, its surroundings may not."""
    array = linear_or_grid(1, 2, 320, 240)
    pictures = Planes(array, 10, 18).pictures()
    wave = 127 + 90 * np.sin(2 * np.pi * np.arange(400) / 24)
    for (_, col), picture in pictures.items():
        picture[:90] = wave[10 * col : 10 * col + 320].astype(np.uint8)[None, :, None]
    low, high = estimate_range(array, [FrameSet(0, 0, pictures)])
    assert -20 <= low <= 10
    assert 18 <= high <= 45


def test_a_small_near_object_is_inside() -> None:
    array = linear_or_grid(1, 2, 480, 320)
    pictures = Planes(array, 8, 14).pictures()
    ball = np.random.default_rng(9).integers(0, 255, (24, 24, 3), np.uint8)
    for (_, col), picture in pictures.items():
        x = 300 - 45 * col
        picture[150:174, x : x + 24] = cv2.GaussianBlur(ball, (0, 0), 1.0)
    check(estimate_range(array, [FrameSet(0, 0, pictures)]), 8, 45)


def test_hint_bounds_and_is_narrowed() -> None:
    array = linear_or_grid(1, 2, 320, 200)
    frames = [Planes(array, 10, 30).frame_set()]
    check(estimate_range(array, frames, (-50.0, 100.0)), 10, 30)
    assert estimate_range(array, frames, (10.3, 29.7)) == (10.3, 29.7)


@pytest.mark.parametrize(
    ("hint", "low", "high"),
    [((8.0, 24.0), 8, 30), ((14.0, 34.0), 10, 34), ((13.0, 27.0), 10, 30), ((10.8, 29.2), 10, 30)],
    ids=str,
)
def test_a_hint_that_is_too_narrow_is_widened_and_that_is_told(
    hint: tuple[float, float], low: int, high: int
) -> None:
    array = linear_or_grid(1, 2, 320, 200, name="mine")
    frames = [Planes(array, 10, 30).frame_set()]
    with pytest.warns(MvCodecWarning, match=r"mine: the pictures show disparities of .*; widened to"):
        found = estimate_range(array, frames, hint)
    assert low - 4 <= found[0] <= low
    assert high <= found[1] <= high + 6


@pytest.mark.parametrize(
    ("stated", "low", "high"),
    [((20.0, 22.0), 10, 30), ((-40.0, -20.0), -40, 30), ((12.0, 60.0), 10, 60)],
    ids=str,
)
def test_a_stated_range_makes_room_for_what_the_pictures_show_and_is_never_narrower(
    stated: tuple[float, float], low: int, high: int
) -> None:
    array = linear_or_grid(1, 2, 320, 200, name="mine")
    frames = [Planes(array, 10, 30).frame_set()]
    with pytest.warns(MvCodecWarning, match=r"mine: the pictures show .*; widened to .*\(think again\)"):
        found = make_room(array, frames, stated, "think again")
    assert low - 4 <= found[0] <= min(low, stated[0])
    assert max(high, stated[1]) <= found[1] <= high + 6
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert make_room(array, frames, (-50.0, 100.0), "") == (-50.0, 100.0)
        assert make_room(array, frames, (9.5, 30.0), "") == (9.5, 30.0)
        flat = [FrameSet(0, 0, {position: np.full((200, 320, 3), 9, np.uint8) for position in array.real})]
        assert make_room(array, flat, stated, "") == stated


@pytest.mark.parametrize("level", [0, 5, 255])
@pytest.mark.parametrize("noise", [0.0, 2.0])
@pytest.mark.parametrize("grid", [(1, 2), (2, 2)], ids=str)
def test_too_little_texture_is_said(level: int, noise: float, grid: tuple[int, int]) -> None:
    array = linear_or_grid(*grid, 160, 120, name="night")
    flat = {position: np.full((120, 160, 3), level, np.uint8) for position in array.real}
    frames = [FrameSet(0, 0, with_noise(flat, noise, np.s_[:0]))]
    with pytest.warns(MvCodecWarning, match="night: too little texture to match"):
        assert estimate_range(array, frames) == FALLBACK_RANGE_PX
    with pytest.warns(MvCodecWarning, match=r"set to -3\.\.7 px"):
        assert estimate_range(array, frames, (-3.0, 7.0)) == (-3.0, 7.0)


def test_what_keeps_pictures_from_matching_is_named() -> None:
    array = linear_or_grid(1, 2, 320, 200, name="rig")
    draw = np.random.default_rng(6)
    noise = {at: draw.integers(0, 255, (200, 320, 3), np.uint8) for at in array.real}
    others: dict[Position, Picture] = {
        at: np.asarray(cv2.GaussianBlur(picture, (0, 0), 1.5), np.uint8) for at, picture in noise.items()
    }
    dark: dict[Position, Picture] = {at: np.zeros((200, 320, 3), np.uint8) for at in array.real}
    with pytest.warns(MvCodecWarning, match="rig: the cameras' pictures don't match; .* rectified"):
        estimate_range(array, [FrameSet(0, 0, others)])
    with pytest.warns(MvCodecWarning, match="rig: too little texture to match in pictures so dark"):
        estimate_range(array, [FrameSet(0, 0, dark)])


@pytest.mark.parametrize("size", [(8, 6), (1, 1), (50, 1), (1, 50)], ids=str)
def test_survives_tiny_pictures(size: tuple[int, int]) -> None:
    array = linear_or_grid(2, 2, *size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MvCodecWarning)
        low, high = estimate_range(array, [Planes(array, 1, 2).frame_set()])
    assert np.isfinite([low, high]).all()
    assert low < high


def test_a_lone_camera_has_nothing_to_match() -> None:
    array = linear_or_grid(1, 1, 20, 10)
    frames = [FrameSet(0, 0, {(0, 0): np.zeros((10, 20, 3), np.uint8)})]
    assert estimate_range(array, frames) == FALLBACK_RANGE_PX
    assert estimate_range(array, frames, (1.0, 2.0)) == (1.0, 2.0)


def test_bad_arguments_are_named() -> None:
    array = linear_or_grid(1, 2, 20, 10)
    with pytest.raises(SettingError, match="at least one frame set"):
        estimate_range(array, [])
    with pytest.raises(SettingError, match=r"hint: found 5\.\.5"):
        estimate_range(array, [Planes(array, 1, 2).frame_set()], (5.0, 5.0))


@pytest.mark.shared_data
@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is absent")
@pytest.mark.parametrize(
    ("name", "last", "far", "near"),
    [  # truth of the pair, less the few farthest and nearest pixels, that one camera may not share
        ("tsukuba", 4, 20, 56),
        ("cones", 2, 16.5, 54),
        ("teddy", 1, 15, 49),
        ("venus", 1, 3, 19),
        ("art", 5, 33, 92),
        ("moebius", 6, 34, 107),
    ],
)
def test_of_real_pairs(name: str, last: int, far: float, near: float) -> None:
    views = json.loads((DATA / name / "array.json").read_text())["views"][0]
    pictures: dict[Position, Picture] = {}
    for col in (0, last):
        read = cv2.imread(str(DATA / name / views[col][0]))
        assert read is not None
        pictures[0, col] = np.asarray(cv2.cvtColor(read, cv2.COLOR_BGR2RGB), np.uint8)
    height, width = pictures[0, 0].shape[:2]
    array = CameraArray(1, last + 1, width, height, 15.0, (0,), (0, last), Calibration.nominal(width, height))
    check(estimate_range(array, [FrameSet(0, 0, pictures)]), far, near)

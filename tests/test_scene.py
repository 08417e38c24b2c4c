"""The sample scenes: geometry of the room, its motion, and what `write_sample` leaves."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import cv2
import make_samples
import numpy as np
import pytest
from array_files import files_in
from numpy.typing import NDArray

from mvcodec.array import Position, Viewpoint
from mvcodec.capture import open_input
from mvcodec.capture.truth import read_pfm
from mvcodec.conformance.validation import validate
from mvcodec.container import read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import OutputError, SettingError
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import FloatMap, Picture
from mvcodec.output.scene_folder import write_sample
from mvcodec.scenes.scene import SCENES, Scene, SceneSettings, make_scene
from mvcodec.scenes.textures import photograph

ROOT = Path(__file__).resolve().parents[1]
SIZE = (320, 180)


@cache
def room() -> Scene:
    return make_scene("room", SceneSettings(grid=(3, 5), frames=20, size=SIZE))


@cache
def seen(row: float, col: float, frame: int = 0) -> tuple[Picture, FloatMap]:
    picture, disparity = room().render(Viewpoint(row, col), frame)
    assert disparity is not None
    return picture, disparity


def warped(
    source: tuple[Picture, FloatMap], disparity: FloatMap, steps: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """A view looked up in another one that lies `steps` (rows, cols) away, and where that may be done.

    A pixel (x, y) of disparity d is at (x - cols * d, y - rows * d) there; it is seen there too
    where the disparity found there is the same.
    """
    height, width = disparity.shape
    y, x = np.mgrid[:height, :width].astype(np.float32)
    map_x, map_y = x - np.float32(steps[1]) * disparity, y - np.float32(steps[0]) * disparity
    picture = cv2.remap(source[0].astype(np.float32), map_x, map_y, cv2.INTER_CUBIC)
    there = cv2.remap(source[1], map_x, map_y, cv2.INTER_NEAREST)
    inside = (map_x >= 1) & (map_x <= width - 2) & (map_y >= 1) & (map_y <= height - 2)
    return np.asarray(picture, np.float64), inside & (np.abs(there - disparity) < 0.2)


@pytest.mark.parametrize("other", [(0, 4), (2, 0), (2, 4), (0, 1), (1.5, 2.25)])
def test_views_agree_through_the_exact_disparity(other: tuple[float, float]) -> None:
    picture, disparity = seen(0, 0)
    found, visible = warped(seen(*other), disparity, other)
    # Away from edges, whose pixels are mixtures that don't move as one.
    flat = cv2.dilate(disparity, np.ones((5, 5))) - cv2.erode(disparity, np.ones((5, 5))) < 0.15
    same = visible & flat
    assert same.mean() > 0.6
    error = np.abs(found - picture)[same]
    assert np.median(error) < 1.5
    # The wrong sign, or no disparity, is far off.
    wrong, _ = warped(seen(*other), -disparity, other)
    assert np.abs(wrong - picture)[same].mean() > 5 * error.mean()


@pytest.mark.parametrize("other", [(0, 4), (2, 0)])
def test_occlusion_is_real(other: Position) -> None:
    """Points are hidden from the other view, by what is nearer there; from the next view, by less."""
    _, disparity = seen(0, 0)
    height, width = disparity.shape
    y, x = np.mgrid[:height, :width]
    share = []
    for steps in (other, (other[0] / 2, other[1] / 2)):
        there = seen(*steps)[1]
        map_x = np.rint(x - steps[1] * disparity).astype(int)
        map_y = np.rint(y - steps[0] * disparity).astype(int)
        inside = (map_x >= 0) & (map_x < width) & (map_y >= 0) & (map_y < height)
        nearer = there[map_y[inside], map_x[inside]] > disparity[inside] + 0.5
        farther = there[map_y[inside], map_x[inside]] < disparity[inside] - 0.5
        assert farther.mean() < 0.01  # only at edges, by rounding
        share.append(nearer.mean())
    assert 0.02 < share[0] < 0.3
    assert share[1] < share[0]


def test_disparity_keeps_to_the_hint_and_the_calibration() -> None:
    array = room().array
    assert array.disparity_per_step_px is not None
    low, high = array.disparity_per_step_px
    for view in ((0, 0), (2, 4)):
        _, disparity = seen(*view)
        assert low < disparity.min() < disparity.max() < high
        assert disparity.max() > 2 * disparity.min()
    # The back wall is a plane at 6 m: Z = f * B / d.
    wall = np.median(seen(1, 2)[1][4:12])
    calibration = array.calibration
    assert calibration.fx_px * calibration.baseline_m / wall == pytest.approx(6.0, rel=1e-5)


@pytest.mark.parametrize(("grid", "steps"), [((2, 2), 1), ((5, 5), 4), ((9, 9), 8), ((1, 3), 2), ((3, 1), 2)])
def test_the_rig_is_as_long_whatever_its_grid(grid: tuple[int, int], steps: int) -> None:
    scene = make_scene("room", SceneSettings(grid=grid, frames=1, size=(160, 90)))
    _, disparity = scene.render(Viewpoint(0, 0), 0)
    assert disparity is not None
    assert disparity.min() * steps == pytest.approx(5.0, rel=0.01)
    assert 12 < disparity.max() * steps < 15


def test_several_things_move_and_the_rest_stands_still() -> None:
    first, later = seen(1, 2, 0)[1], seen(1, 2, 12)[1]
    moved = (np.abs(first - later) > 0.02).astype(np.uint8)
    count, _, stats, _ = cv2.connectedComponentsWithStats(moved)
    assert sum(stats[number, cv2.CC_STAT_AREA] > 60 for number in range(1, count)) >= 3
    assert moved.mean() < 0.3
    pictures = [seen(1, 2, frame)[0].astype(int) for frame in (0, 1)]
    assert np.abs(pictures[0] - pictures[1]).max() > 30


def test_it_is_the_same_every_time_and_differs_by_seed() -> None:
    settings = [SceneSettings((2, 2), 2, (96, 64), seed) for seed in (0, 0, 1, 2)]
    pictures = [make_scene("room", each).render(Viewpoint(0, 1), 1)[0] for each in settings]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert all(np.abs(pictures[0].astype(int) - other).mean() > 1 for other in pictures[2:])


def test_threads_may_share_a_scene() -> None:
    from concurrent.futures import ThreadPoolExecutor

    jobs = [(0, 0), (3, 1), (0, 2), (3, 3), (1, 0), (0, 4)]
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda job: room().render(Viewpoint(0, job[1]), job[0])[0], jobs))
    for (frame, col), picture in zip(jobs, found, strict=True):
        np.testing.assert_array_equal(picture, room().render(Viewpoint(0, col), frame)[0])


@pytest.mark.parametrize("size", [(97, 55), (16, 16), (90, 160), (20, 80), (161, 20)])
def test_any_size_is_filled(size: tuple[int, int]) -> None:
    scene = make_scene("room", SceneSettings((2, 2), 1, size))
    picture, disparity = scene.render(Viewpoint(1, 1), 0)
    assert disparity is not None
    assert picture.shape == (size[1], size[0], 3)
    assert disparity.shape == (size[1], size[0])
    hint = scene.array.disparity_per_step_px
    assert hint is not None
    assert hint[0] < disparity.min() < disparity.max() < hint[1]


def test_the_picture_is_worth_looking_at() -> None:
    """Neither dull nor burnt out: textures, contrast, colours."""
    picture = seen(1, 2)[0].astype(np.float64)
    luma = picture @ [0.299, 0.587, 0.114]
    assert 50 < luma.mean() < 130
    assert luma.std() > 30
    assert (picture >= 255).all(axis=-1).mean() < 0.01
    assert (picture.max(axis=-1) - picture.min(axis=-1)).mean() > 20
    gradient = np.hypot(cv2.Sobel(luma, cv2.CV_64F, 1, 0), cv2.Sobel(luma, cv2.CV_64F, 0, 1))
    assert (gradient > 8).mean() > 0.6


# The real pair


def test_motorcycle_is_the_real_pair_with_its_truth() -> None:
    scene = make_scene("motorcycle")
    assert (scene.array.rows, scene.array.cols, scene.frame_count) == (1, 2, 1)
    left, disparity = scene.render(Viewpoint(0, 0), 0)
    right, none = scene.render(Viewpoint(0, 1), 0)
    assert none is None
    assert disparity is not None
    known = np.isfinite(disparity)
    assert known.mean() > 0.9
    filled = np.where(known, disparity, 0).astype(np.float32)
    found, _ = warped((right, filled), filled, (0, 1))
    wrong, _ = warped((right, filled), -filled, (0, 1))
    assert np.median(np.abs(found - left)[known]) < 6
    assert np.median(np.abs(wrong - left)[known]) > 15


@pytest.mark.parametrize(
    ("settings", "option"),
    [
        (SceneSettings(grid=(2, 2)), "grid: found 2x2, expected 1x2"),
        (SceneSettings(size=(640, 360)), "^size: found 640x360, expected 741x500"),
        (SceneSettings(frames=2), "frames: found 2, expected 1"),
    ],
)
def test_motorcycle_cannot_be_otherwise(settings: SceneSettings, option: str) -> None:
    with pytest.raises(SettingError, match=option):
        make_scene("motorcycle", settings)


# Every scene


@pytest.mark.parametrize("name", SCENES)
def test_scenes_keep_their_contract(name: str) -> None:
    scene = make_scene(name)
    array = scene.array
    assert array.name == name
    assert scene.licence
    assert {(0, 0), (array.rows - 1, array.cols - 1)} <= set(array.real)
    picture, disparity = scene.render(Viewpoint(0, 0), 0)
    assert picture.dtype == np.uint8
    assert picture.shape == (array.height, array.width, 3)
    assert disparity is not None
    assert disparity.dtype == np.float32
    for frame in (-1, scene.frame_count):
        with pytest.raises(SettingError, match="frame"):
            scene.render(Viewpoint(0, 0), frame)
    for viewpoint in (Viewpoint(-0.1, 0), Viewpoint(0, array.cols)):
        with pytest.raises(SettingError, match="viewpoint"):
            scene.render(viewpoint, 0)


@pytest.mark.parametrize(
    ("bad", "option"),
    [
        ({"grid": (0, 5)}, "^grid: "),
        ({"grid": (5, 2000)}, "^grid: "),
        ({"frames": 0}, "^frames: "),
        ({"size": (8, 360)}, "^size: "),
        ({"size": (640, 99999)}, "^size: "),
        ({"seed": -1}, "^seed: "),
    ],
)
def test_bad_settings(bad: dict[str, object], option: str) -> None:
    with pytest.raises(SettingError, match=option):
        SceneSettings(**bad)  # type: ignore[arg-type]


def test_the_room_has_an_end() -> None:
    with pytest.raises(SettingError, match=r"^size: found 20x81, expected at most 4 times as high as wide"):
        make_scene("room", SceneSettings(size=(20, 81)))


def test_unknown_scene() -> None:
    with pytest.raises(SettingError, match=r"^scene: found kitchen, expected room \| motorcycle"):
        make_scene("kitchen")


# On disk


def test_sample_folder_comes_back(tmp_path: Path) -> None:
    steps: list[tuple[int, int]] = []
    settings = SceneSettings((2, 3), 2, (64, 48), 3)
    scene = write_sample(tmp_path, "room", settings, lambda done, of: steps.append((done, of)))
    assert steps == [(1, 2), (2, 2)]
    source = open_input([tmp_path])
    assert source.array == scene.array
    assert len(files_in(tmp_path)) == 1 + 2 * 2 * 6
    for item in source.frame_sets(views=scene.array.positions):
        for view, picture in item.pictures.items():
            expected, disparity = scene.render(Viewpoint(*view), item.index)
            np.testing.assert_array_equal(picture, expected)
            truth = source.truth(view, item.index)
            assert truth is not None
            assert truth.valid.all()
            np.testing.assert_array_equal(truth.values_px, disparity)
    assert read_pfm(tmp_path / "truth" / "r01_c02" / "000001.pfm").shape == (48, 64)


def test_motorcycle_folder_comes_back(tmp_path: Path) -> None:
    scene = write_sample(tmp_path, "motorcycle")
    source = open_input([tmp_path], real="all")
    assert source.array == scene.array
    truth = source.truth((0, 0), 0)
    assert truth is not None
    assert 0.9 < truth.valid.mean() < 1
    assert source.truth((0, 1), 0) is None
    assert json.loads((tmp_path / "array.json").read_text())["licence"] == scene.licence


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_sample(tmp_path / "file", "room", SceneSettings((1, 2), 1, (32, 32)))


def test_the_sample_that_ships(tmp_path: Path) -> None:
    """samples/ is what tools/make_samples.py makes of the scene, and small."""
    folder = ROOT / "samples" / "room_2x2"
    assert sum(path.stat().st_size for path in folder.iterdir()) < 3e6
    source = open_input([folder], real="all")
    assert (source.array.rows, source.array.cols, source.frame_count) == (2, 2, 12)
    scene = make_scene("room", SceneSettings((2, 2), 12, (640, 360)))
    last = next(source.frame_sets(slice(11, 12)))
    for view, picture in last.pictures.items():
        error = picture.astype(np.float64) - scene.render(Viewpoint(*view), 11)[0]
        assert np.sqrt(np.mean((error @ [0.299, 0.587, 0.114]) ** 2)) < 3
    make_samples.make_room(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in folder.iterdir()}
    assert (tmp_path / "array.json").read_bytes() == (folder / "array.json").read_bytes()


def test_the_coded_sample_that_ships(tmp_path: Path) -> None:
    """It is what tools/make_samples.py codes of the folder beside it, small, clean and good."""
    folder = ROOT / "samples" / "room_2x2"
    coded = folder.with_suffix(".mcap")
    assert coded.stat().st_size < 300_000
    assert validate(coded) == []
    with Decoder.open(coded) as decoder:
        decoded = list(decoder)
    originals = list(open_input([folder]).frame_sets())
    assert [item.index for item in decoded] == [item.index for item in originals]
    for camera, picture in decoded[-1].pictures.items():
        assert psnr(originals[-1].pictures[camera], picture) > 36
    make_samples.code_room(folder, tmp_path / "again.mcap", slice(1))
    assert read_info(tmp_path / "again.mcap").header == read_info(coded).header


def test_photographs_are_not_changed_by_rendering() -> None:
    with pytest.raises(ValueError, match="read-only"):
        photograph("coffee")[0, 0] = 0

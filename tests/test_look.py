"""The quick look: nothing is said of arrays that are well, and every fault is called by its name."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import fails, mvcodec

from mvcodec.array import Calibration, CameraArray, Position, Viewpoint
from mvcodec.capture import open_input
from mvcodec.frames import Picture
from mvcodec.output.pictures import write_png
from mvcodec.rigs.look import look_at
from mvcodec.scenes.rough_rig import RoughRigSettings, RoughScene
from mvcodec.scenes.scene import RoomScene, SceneSettings

SIZE = (480, 270)
DATA = Path(__file__).parents[2] / "shared" / "data"
Pictures = dict[Position, Picture]


@cache
def room(rows: int = 2, cols: int = 2) -> tuple[CameraArray, Pictures]:
    scene = RoomScene(SceneSettings((rows, cols), 1, SIZE))
    return scene.array, {at: scene.render(Viewpoint(*at), 0)[0] for at in scene.array.positions}


def kinds(array: CameraArray, pictures: Pictures) -> list[str]:
    return [concern.kind for concern in look_at(array, pictures)]


def shown(pictures: Pictures, order: dict[Position, Position]) -> Pictures:
    """At each place the picture of another camera."""
    return {at: pictures[order.get(at, at)] for at in pictures}


COLUMNS: dict[Position, Position] = {(0, 0): (0, 1), (0, 1): (0, 0), (1, 0): (1, 1), (1, 1): (1, 0)}
ROWS: dict[Position, Position] = {(0, 0): (1, 0), (0, 1): (1, 1), (1, 0): (0, 0), (1, 1): (0, 1)}
TRANSPOSED: dict[Position, Position] = {(0, 1): (1, 0), (1, 0): (0, 1)}
TURNED: dict[Position, Position] = {(0, 0): (1, 1), (1, 1): (0, 0), (0, 1): (1, 0), (1, 0): (0, 1)}
TWO: dict[Position, Position] = {(0, 0): (0, 1), (0, 1): (0, 0)}


@pytest.mark.parametrize("grid", [(2, 2), (1, 2), (2, 1)])
def test_nothing_is_said_of_an_ideal_array(grid: tuple[int, int]) -> None:
    assert look_at(*room(*grid)) == []


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (COLUMNS, "columns swapped"),
        (ROWS, "rows swapped"),
        (TURNED, "rows and columns swapped"),
        (TRANSPOSED, "transposed"),
        (TWO, "cameras swapped"),
    ],
)
def test_another_order_is_told_with_the_one_that_fits(order: dict[Position, Position], words: str) -> None:
    array, pictures = room()
    concerns = look_at(array, shown(pictures, order))
    assert [concern.kind for concern in concerns] == ["order"]
    # These orders undo themselves: what is shown at a place belongs where its own camera is.
    there = [order.get(at, at) for at in array.positions]
    fits = "{},{} {},{}; {},{} {},{}".format(*[number for at in there for number in at])
    assert words in concerns[0].text
    assert concerns[0].text.endswith(fits)


def test_a_pair_in_reverse_is_told() -> None:
    for grid in ((1, 2), (2, 1)):
        array, pictures = room(*grid)
        first, second = array.positions
        (concern,) = look_at(array, shown(pictures, {first: second, second: first}))
        assert concern.kind == "order"
        assert "in reverse" in concern.text


def test_a_rough_rig_is_misaligned_and_a_rough_rig_in_another_order_is_told() -> None:
    scene = RoughScene.of(SceneSettings((2, 2), 1, SIZE), RoughRigSettings(1))
    pictures = {at: scene.render(Viewpoint(*at), 0)[0] for at in scene.array.positions}
    (concern,) = look_at(scene.array, pictures)
    assert concern.kind == "misaligned"
    assert "rectify" in concern.text
    assert kinds(scene.array, shown(pictures, COLUMNS)) == ["order"]


def test_two_equal_pictures_are_told() -> None:
    array, pictures = room()
    (concern,) = look_at(array, pictures | {(1, 0): pictures[0, 1]})
    assert concern.kind == "equal"
    assert "0,1 and 1,0" in concern.text


def test_a_camera_upside_down_is_told() -> None:
    array, pictures = room()
    (concern,) = look_at(array, pictures | {(1, 1): np.ascontiguousarray(pictures[1, 1][::-1, ::-1])})
    assert concern.kind == "upside down"
    assert concern.text.startswith("camera 1,1")


@pytest.mark.parametrize(
    ("turn", "words"),
    [(cv2.ROTATE_90_CLOCKWISE, "counter-clockwise"), (cv2.ROTATE_90_COUNTERCLOCKWISE, "s clockwise")],
)
def test_a_camera_on_its_side_is_told_with_the_way_back(turn: int, words: str) -> None:
    array, pictures = room()
    square = {at: np.ascontiguousarray(picture[:, :270]) for at, picture in pictures.items()}
    turned = square | {(1, 1): np.asarray(cv2.rotate(square[1, 1], turn), np.uint8)}
    (concern,) = look_at(replace(array, width=270), turned)
    assert concern.kind == "on its side"
    assert concern.text.startswith("camera 1,1")
    assert words in concern.text


def moved_right(picture: Picture, by_px: int) -> Picture:
    wider = cv2.copyMakeBorder(picture, 0, 0, by_px, 0, cv2.BORDER_REFLECT)
    return np.asarray(wider[:, : picture.shape[1]], np.uint8)


def test_points_behind_infinity_are_told_where_a_calibration_says_where_that_is() -> None:
    array, pictures = room(1, 2)
    assert kinds(array, pictures | {(0, 1): moved_right(pictures[0, 1], 25)}) == ["behind infinity"]


def flat(value: int) -> Pictures:
    return {at: np.full((*SIZE[::-1], 3), value, np.uint8) for at in room()[1]}


def test_nothing_is_said_where_nothing_can_be_seen() -> None:
    array, pictures = room()
    draw = np.random.default_rng(0)
    noise = {at: draw.integers(0, 256, picture.shape, np.uint8) for at, picture in pictures.items()}
    stripes = (np.indices(SIZE[::-1])[1] // 8 % 2 * 200).astype(np.uint8)
    repeated = {at: np.repeat(np.roll(stripes, 3 * at[1], axis=1)[..., None], 3, axis=2) for at in pictures}
    dark = {at: (picture // 32).astype(np.uint8) for at, picture in pictures.items()}
    for made in (flat(0), flat(128), noise, repeated, dark):
        assert not {"misaligned", "order", "upside down"} & set(kinds(array, made))


def test_nothing_is_said_of_disparities_on_both_sides_of_zero() -> None:
    array, pictures = room(1, 2)
    without = CameraArray(1, 2, *SIZE, 24.0, (0,), (0, 1), Calibration.nominal(*SIZE))
    assert array.real == without.real
    assert kinds(without, pictures | {(0, 1): moved_right(pictures[0, 1], 25)}) == []


def write(folder: Path, pictures: Pictures) -> Path:
    for (row, col), picture in pictures.items():
        write_png(folder / f"{row}_{col}.png", picture)
    views = [[[f"{row}_{col}.png"] for col in (0, 1)] for row in (0, 1)]
    (folder / "array.json").write_text(json.dumps({"rows": 2, "cols": 2, "fps": 10, "views": views}))
    return folder


def test_encode_warns_and_with_strict_it_stops(tmp_path: Path) -> None:
    _, pictures = room()
    folder = write(tmp_path, shown(pictures, COLUMNS))
    out = tmp_path / "out.mcap"
    fast = ("--preset", "ultrafast", "--disparity-range", "0,64", "--matcher", "sgbm")
    done = mvcodec("encode", folder, out, *fast)
    assert done.returncode == 0
    assert "columns swapped" in done.stderr
    out.unlink()
    assert "columns swapped" in fails(1, "encode", folder, out, "--strict")
    assert not out.exists()


@pytest.mark.shared_data
@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here")
@pytest.mark.parametrize(
    "name",
    [
        *("tsukuba", "cones", "teddy", "venus", "art", "moebius", "antinous", "bicycle", "kitti"),
        *("shop_s1", "shop_s2", "shop_v2", "shop_v3", "shop_v4", "shop_17x17"),
    ],
)
def test_nothing_is_said_of_real_arrays(name: str) -> None:
    source = open_input([DATA / name])
    first = next(iter(source.frame_sets(slice(0, 1))))
    assert look_at(source.array, first.pictures) == []


MIDDLE = (1, 1)


def odd(picture: Picture, kind: str) -> Picture:
    elsewhere = np.random.default_rng(0).integers(0, 256, (18, 32, 3), np.uint8)
    made = {
        "dark": picture // 32,
        "blank": np.full_like(picture, 120),
        "mirrored": np.ascontiguousarray(picture[:, ::-1]),
        "alone": np.asarray(cv2.resize(elsewhere, SIZE), np.uint8),
    }
    return made[kind]


@pytest.mark.parametrize("kind", ["dark", "blank", "mirrored", "alone"])
def test_a_camera_that_fits_no_other_is_told_with_the_reason(kind: str) -> None:
    array, pictures = room(3, 3)
    whole = replace(array, real_rows=(0, 1, 2), real_cols=(0, 1, 2))
    assert look_at(whole, pictures) == []
    (concern,) = look_at(whole, pictures | {MIDDLE: odd(pictures[MIDDLE], kind)})
    assert concern.kind == kind
    assert "camera 1,1" in concern.text


def test_rectify_tells_of_another_order(tmp_path: Path) -> None:
    _, pictures = room()
    folder = write(tmp_path, shown(pictures, COLUMNS))
    done = mvcodec("rectify", folder, tmp_path / "rig.json")
    assert done.returncode == 0
    assert "columns swapped" in done.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--focal", "9"], "expected 48 to 48000 px"),
        (["--focal", "500", "--fov", "60"], "not allowed with"),
        (["--fov", "170"], "expected degrees up to 150"),
        (["--focal", "500", "--board", "chessboard:9x6:25mm"], "--from scene"),
    ],
)
def test_a_focal_length_that_cannot_be_is_refused(tmp_path: Path, options: list[str], words: str) -> None:
    folder = write(tmp_path, room()[1])
    assert words in fails(2, "rectify", folder, tmp_path / "rig.json", *options)


def test_rectify_with_strict_stops_at_another_order(tmp_path: Path) -> None:
    _, pictures = room()
    folder = write(tmp_path, shown(pictures, COLUMNS))
    out = tmp_path / "rig.json"
    assert "columns swapped" in fails(1, "rectify", folder, out, "--strict")
    assert not out.exists()


@pytest.mark.parametrize("kind", ["dark", "blank", "mirrored", "alone"])
@pytest.mark.parametrize("grid", [(1, 2), (1, 3)])
def test_one_of_a_few_cameras_that_fits_no_other_is_told(grid: tuple[int, int], kind: str) -> None:
    array, pictures = room(*grid)
    whole = replace(array, real_cols=tuple(range(grid[1])))
    assert look_at(whole, pictures) == []
    (concern,) = look_at(whole, pictures | {(0, 1): odd(pictures[0, 1], kind)})
    assert concern.kind == kind
    assert "0,1" in concern.text

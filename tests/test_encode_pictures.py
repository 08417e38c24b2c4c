"""`mvcodec.encode`: pictures in memory -> a file; what wrong pictures and settings say."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mvcodec

SETTINGS: dict[str, Any] = {"preset": "ultrafast", "matcher": "sgbm", "disparity_range_px": (0.0, 8.0)}


def views(
    seed: int = 1, rows: int = 2, cols: int = 2, size: tuple[int, int] = (48, 64)
) -> np.ndarray[Any, Any]:
    """uint8 (rows, cols, H, W, 3): one picture of grey tiles, 2 px farther from view to view."""
    height, width = size
    rng = np.random.default_rng(seed)
    tiles = rng.integers(0, 256, (height // 8 + 4, width // 8 + 4, 1)).astype(np.uint8)
    wide = tiles.repeat(8, 0).repeat(8, 1).repeat(3, 2)
    return np.stack(
        [
            np.stack([wide[2 * row : 2 * row + height, 2 * col : 2 * col + width] for col in range(cols)])
            for row in range(rows)
        ]
    )


def test_arrays_become_a_file(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    frames = [views(seed) for seed in range(3)]
    info = mvcodec.encode(frames, path, fps=12.5, qp=10, **SETTINGS)
    assert (info.frames, info.header.settings["qp"], info.header.array.fps) == (3, 10, 12.5)
    with mvcodec.open(path) as video:
        assert (video.array.rows, video.array.cols, len(video)) == (2, 2, 3)
        assert video.times_s == pytest.approx((0, 0.08, 0.16))
        for number, frame in enumerate(video):
            for row, col in video.array.real:
                error = frame.pictures[row, col].astype(int) - frames[number][row, col]
                assert np.abs(error).mean() < 6


def test_mappings_give_the_same_file_as_arrays(tmp_path: Path) -> None:
    one, other = tmp_path / "array.mcap", tmp_path / "mapping.mcap"
    array = views()
    mapping = {(row, col): array[row, col] for row in range(2) for col in range(2)}
    mvcodec.encode([array], one, **SETTINGS)
    mvcodec.encode(iter([mapping]), other, **SETTINGS)
    assert one.read_bytes() == other.read_bytes()


def test_places_that_are_apart_leave_virtual_views_between_them(tmp_path: Path) -> None:
    array = views()
    corners = {(2 * row, 4 * col): array[row, col] for row in range(2) for col in range(2)}
    info = mvcodec.encode([corners], tmp_path / "x.mcap", **SETTINGS)
    found = info.header.array
    assert (found.rows, found.cols, found.real_rows, found.real_cols) == (3, 5, (0, 2), (0, 4))


def test_corners_of_a_dense_grid_can_be_chosen(tmp_path: Path) -> None:
    info = mvcodec.encode([views(rows=1, cols=3)], tmp_path / "x.mcap", real="corners", **SETTINGS)
    assert (info.header.array.cols, info.header.array.real) == (3, ((0, 0), (0, 2)))


def test_a_config_is_a_start_for_single_settings(tmp_path: Path) -> None:
    config = mvcodec.EncoderConfig(crf=30, **SETTINGS)
    info = mvcodec.encode([views()], tmp_path / "x.mcap", config=config, gop=7, fps=25)
    assert {"crf": 30, "gop": 7}.items() <= info.header.settings.items()
    assert "qp" not in info.header.settings


def test_depth_needs_a_calibration(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with pytest.raises(mvcodec.SettingError, match="calibration: found none given"):
        mvcodec.encode([views()], path, depth=True, **SETTINGS)
    assert not path.exists()
    calibration = mvcodec.Calibration(60, 60, 31.5, 23.5, 0.1)
    mvcodec.encode([views()], path, depth=True, calibration=calibration, **SETTINGS)
    with mvcodec.open(path) as video:
        assert video.array.calibration == calibration


GOOD = views()


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (
            GOOD[0],
            r"frame 1: found an array of shape \(2, 48, 64, 3\), uint8, expected uint8 \(R, C, H, W, 3\)",
        ),
        (GOOD.astype(np.float32), r"frame 1: found an array of shape .*, float32, expected uint8"),
        (
            views(size=(48, 80)),
            r"frame 1, view r00_c00: found a picture of shape \(48, 80, 3\), uint8, expected",
        ),
        (GOOD[:, :1], r"frame 1, view r00_c01: found no picture, expected one of every real camera"),
        ({(0, 0): GOOD[0, 0][..., 0]}, r"frame 1, view \(0, 0\): found a picture of shape \(48, 64\), uint8"),
        ({"left": GOOD[0, 0]}, r"frame 1: found the places \['left'\], expected \(row, col\) -> picture"),
        ({}, r"frame 1: found the places \[\]"),
        ("words", r"frame 1: found an array of shape \(\), str"),
    ],
)
def test_a_wrong_frame_set_is_named_and_those_before_it_are_kept(
    tmp_path: Path, second: Any, message: str
) -> None:
    path = tmp_path / "x.mcap"
    with pytest.raises(mvcodec.InputError, match=message) as caught:
        mvcodec.encode([GOOD, second], path, **SETTINGS)
    assert caught.value.__notes__ == [f"{path} holds the 1 frame sets before that"]
    with mvcodec.open(path) as video:
        assert len(video) == 1


def test_an_iterable_that_fails_keeps_what_came_before(tmp_path: Path) -> None:
    def failing() -> Iterator[Any]:
        yield GOOD
        raise ZeroDivisionError("camera unplugged")

    with pytest.raises(ZeroDivisionError, match="camera unplugged"):
        mvcodec.encode(failing(), tmp_path / "x.mcap", **SETTINGS)
    assert mvcodec.read_info(tmp_path / "x.mcap").frames == 1


def test_settings_are_checked_before_anything_is_written(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    for changes, message in (
        ({"qpp": 3}, "qpp: found no such setting, expected one of qp, crf, bitrate_kbps, rate, codec"),
        ({"qp": 99}, r"qp: found 99, expected a whole number, 1\.\.51"),
        ({"fps": 0}, "^fps: found 0, expected"),
        ({"rho": -1}, "^rho: found -1, expected"),
        ({"real": "0x1"}, "found 0x1"),
        ({"gop": 31}, r"gop: found 31, expected 1\.\.30"),
    ):
        with pytest.raises(mvcodec.SettingError, match=message):
            mvcodec.encode([GOOD], path, **{**SETTINGS, **changes})
        assert not path.exists()
    with pytest.raises(mvcodec.InputError, match="frames: found no frame set, expected at least one"):
        mvcodec.encode([], path)
    with pytest.raises(mvcodec.SettingError, match=r"output: found .*x\.mp4, expected a file name"):
        mvcodec.encode([GOOD], tmp_path / "x.mp4")


def test_paths_may_be_text_everywhere(tmp_path: Path) -> None:
    path = str(tmp_path / "x.mcap")
    mvcodec.encode([GOOD], path, **SETTINGS)
    copy = str(tmp_path / "copy.mcap")
    with mvcodec.McapReader.open(path) as reader, mvcodec.McapWriter(copy) as writer:
        writer.push([packet for _, packet in reader.packets()])
    assert mvcodec.read_info(copy).frames == 1
    with pytest.raises(mvcodec.InputError, match="nowhere: found nothing there"):
        mvcodec.open_input(str(tmp_path / "nowhere"))

"""``mvcodec render`` on a small file, in a process of its own: every style, every ending, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import fails, succeeds
from PIL import Image
from small_arrays import HEIGHT, WIDTH, picture, write_array

from mvcodec.array import Calibration, Viewpoint
from mvcodec.capture.picture_files import read_picture
from mvcodec.capture.video_input import VideoView
from mvcodec.decoding.decoder import Decoder
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import Picture
from mvcodec.synthesis.linear import Linear

FRAMES = 4
QUICK = ("--synthesizer", "linear")
"""Compiles little, and is there whatever the default is."""

CALIBRATION = Calibration(100.0, 100.0, (WIDTH - 1) / 2, (HEIGHT - 1) / 2, 0.05)


@pytest.fixture(scope="module")
def coded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("coded")
    array = write_array(folder / "array", frames=FRAMES, calibration=CALIBRATION)
    succeeds("encode", array, folder / "x.mcap", "--qp", "20", "--disparity-range", "0,8", "--quiet")
    return folder / "x.mcap"


def in_library(coded: Path, frame: int, *places: tuple[float, float]) -> list[Picture]:
    """What the library renders there."""
    with Decoder.open(coded, slice(frame, frame + 1)) as decoder:
        (decoded,) = decoder
    return [Linear().render(decoded, Viewpoint(*place)).pixels for place in places]


def frames_of(path: Path) -> list[Picture]:
    with Image.open(path) as animation:
        pictures = []
        for number in range(getattr(animation, "n_frames", 1)):
            animation.seek(number)
            pictures.append(np.asarray(animation.convert("RGB"), np.uint8))
        return pictures


def test_the_middle_as_a_picture(coded: Path, tmp_path: Path) -> None:
    assert succeeds("render", coded, tmp_path / "a.png", *QUICK) == ""
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png"), in_library(coded, 0, (1, 1))[0])


def test_a_path_while_time_goes_on(coded: Path, tmp_path: Path) -> None:
    path = tmp_path / "way.json"
    path.write_text(json.dumps({"viewpoints": [[0, 0], [0, 2], [2, 2]]}))
    succeeds("render", coded, tmp_path / "a.mp4", "--path", path, "--frames", "1:", *QUICK)
    video = VideoView(tmp_path / "a.mp4")
    assert (video.size, video.count, video.fps) == ((WIDTH, HEIGHT), FRAMES - 1, 10)
    places = ((0, 0), (0, 2), (2, 2))
    for number, (place, shown) in enumerate(zip(places, video.pictures(range(3)), strict=True)):
        assert psnr(shown, picture(place, number + 1)) > 30


@pytest.mark.parametrize(("name", "path"), [("a.gif", "sweep"), ("a.webp", "circle")])
def test_time_stands_while_the_viewpoint_goes_round(
    coded: Path, tmp_path: Path, name: str, path: str
) -> None:
    succeeds("render", coded, tmp_path / name, "--path", path, "--frames", "2:3", *QUICK)
    shown = frames_of(tmp_path / name)
    assert len(shown) == 20  # two seconds of them
    places = [(1, 0), (1, 2)] if path == "sweep" else [(1, 0), (0, 1)]
    first, other = in_library(coded, 2, *places)
    assert psnr(shown[0], first) > 25
    assert psnr(shown[10 if path == "sweep" else 5], other) > 25
    assert psnr(shown[0], other) < 25


def test_two_eyes(coded: Path, tmp_path: Path) -> None:
    succeeds("render", coded, tmp_path / "pair.png", "--style", "side-by-side", "--view", "0,1", *QUICK)
    assert read_picture(tmp_path / "pair.png").shape == (HEIGHT, 2 * WIDTH, 3)
    succeeds("render", coded, tmp_path / "a.webp", "--style", "anaglyph", "--path", "lemniscate", *QUICK)
    glasses = frames_of(tmp_path / "a.webp")
    assert len(glasses) == FRAMES
    assert glasses[0].shape == (HEIGHT, WIDTH, 3)


def test_two_eyes_see_nothing_farther_apart_than_is_comfortable(tmp_path: Path) -> None:
    # Measured as a viewer would: by matching one half of the picture against the other.
    sample = Path(__file__).resolve().parent.parent / "samples" / "room_2x2.mcap"
    succeeds("render", sample, tmp_path / "pair.png", "--style", "side-by-side", "--quiet")
    pair = cv2.cvtColor(read_picture(tmp_path / "pair.png"), cv2.COLOR_RGB2GRAY)
    width = pair.shape[1] // 2
    reach = width // 10 // 16 * 16
    matcher = cv2.StereoSGBM.create(-reach, 2 * reach, 5, 200, 800, uniquenessRatio=10, disp12MaxDiff=1)
    parallax = matcher.compute(pair[:, :width].copy(), pair[:, width:].copy()) / 16
    parallax = parallax[parallax >= -reach]  # matched at all
    assert abs(np.median(parallax)) < 0.01 * width
    assert 0.02 * width < np.percentile(parallax, 99.5) < 0.031 * width
    assert np.percentile(parallax, 0.5) > -0.03 * width


def test_mosaics(coded: Path, tmp_path: Path) -> None:
    succeeds("render", coded, tmp_path / "nine.mp4", "--style", "mosaic", *QUICK)
    nine = VideoView(tmp_path / "nine.mp4")
    assert (nine.size, nine.count) == ((3 * WIDTH, 3 * HEIGHT), FRAMES)
    succeeds("render", coded, tmp_path / "grid.png", "--style", "mosaic", "--grid", "2x2", *QUICK)
    expected = in_library(coded, 0, (0, 0), (0, 2), (2, 0), (2, 2))
    sheet = np.vstack([np.hstack(expected[:2]), np.hstack(expected[2:])])
    np.testing.assert_array_equal(read_picture(tmp_path / "grid.png"), sheet)


def test_a_quilt_gets_the_name_that_viewers_want_and_tells_it(coded: Path, tmp_path: Path) -> None:
    told = succeeds("render", coded, tmp_path / "q.png", "--style", "quilt", "--grid", "2x3", *QUICK)
    path = tmp_path / "q_qs3x2a1.5.png"
    assert told == f"{path}\n"
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert read_picture(path).shape == (2 * HEIGHT, 3 * WIDTH, 3)
    assert succeeds("render", coded, path, "--style", "quilt", "--grid", "2x3", "-y", *QUICK) == ""


def test_slice_and_refocus(coded: Path, tmp_path: Path) -> None:
    succeeds("render", coded, tmp_path / "e.png", "--style", "epipolar", "--grid", "1x5", *QUICK)
    views = in_library(coded, 0, *((1, col / 2) for col in range(5)))
    expected = np.stack([view[HEIGHT // 2] for view in views])
    np.testing.assert_array_equal(read_picture(tmp_path / "e.png"), expected)
    for px in ("1", "-3"):
        succeeds("render", coded, tmp_path / f"r{px}.png", "--refocus", px, "--grid", "3x3", *QUICK)
    # The photograph in the background moves by one px a step.
    truth = picture((1, 1), 0)[8:20, 60:88]
    sharp, blurred = (read_picture(tmp_path / f"r{px}.png")[8:20, 60:88] for px in ("1", "-3"))
    assert psnr(sharp, truth) > psnr(blurred, truth) + 6


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("a.avi", "", ".mp4, .png, .gif, .webp"),
        ("a.png", "--path sweep", "none for a.png, which holds one picture"),
        ("a.gif", "--path zigzag", "one of sweep, circle, lemniscate"),
        ("a.gif", "--path sweep --view 0,0", "not allowed with"),
        ("a.gif", "--path sweep --style quilt", "--path"),
        ("a.gif", "--path sweep --style epipolar", "--path"),
        ("a.gif", "--style cubist", "side-by-side"),
        ("a.gif", "--view 0,2.5", "col 0..2"),
        ("a.gif", "--refocus nan", "expected a number"),
        ("a.gif", "--grid 3x3", "--grid: found 3x3"),
        ("a.gif", "--style quilt --grid 999x999", "1024 views"),
        ("a_qs8x6a1.5.gif", "--style quilt --grid 3x3", "_qs3x3a1.5"),
        ("a.gif", "--frames 9:", "--frames"),
        ("a.gif", "--synthesizer brush", "linear"),
    ],
)
def test_settings_that_are_refused(
    coded: Path, tmp_path: Path, name: str, options: str, message: str
) -> None:
    line = fails(2, "render", coded, tmp_path / name, *options.split())
    assert message.removeprefix("--") in line
    assert not list(tmp_path.iterdir())


def test_bad_input_and_output(coded: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.gif"
    assert "nowhere" in fails(1, "render", tmp_path / "nowhere", out)
    assert "way.json" in fails(1, "render", coded, out, "--path", tmp_path / "way.json")
    (tmp_path / "bad.mcap").write_bytes(b"no MCAP at all" * 100)
    assert "bad.mcap" in fails(1, "render", tmp_path / "bad.mcap", out)
    cut = tmp_path / "cut.gif"
    cut.write_bytes(coded.read_bytes()[:2000])
    assert "another file" in fails(2, "render", cut, cut)
    (tmp_path / "folder.gif").mkdir()
    assert "it is a folder" in fails(1, "render", coded, tmp_path / "folder.gif")
    assert not out.exists()

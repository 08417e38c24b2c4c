"""Every command on a small array, each in a process of its own, from the array to pictures and figures."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import fails, mvcodec, succeeds
from small_arrays import FAR_PX, HEIGHT, NEAR_PX, WIDTH, picture, write_array

from mvcodec import __version__
from mvcodec.array import Calibration
from mvcodec.capture import open_input
from mvcodec.evaluation.metrics import psnr

CALIBRATION = Calibration(100.0, 100.0, (WIDTH - 1) / 2, (HEIGHT - 1) / 2, 0.05)
FRAMES = 4
TOOLS = Path(__file__).parents[1] / "tools"


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("input") / "array"
    return write_array(folder, frames=FRAMES, calibration=CALIBRATION, disparity_per_step_px=(0.0, 4.0))


@pytest.fixture(scope="module")
def coded(array: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("coded") / "x.mcap"
    done = mvcodec("encode", array, path, "--qp", "22")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert f"{FRAMES} frame sets of 4 cameras" in done.stdout
    return path


def manifest(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "array.json").read_text())
    return document


def read(path: Path) -> np.ndarray[Any, np.dtype[np.uint8]]:
    image = cv2.imread(str(path))
    assert image is not None, path
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)


def test_info_has_the_documented_form(coded: Path) -> None:
    info = json.loads(succeeds("info", coded, "--json"))
    assert info["grid"] == [3, 3]
    assert info["real"] == [[0, 0], [0, 2], [2, 0], [2, 2]]
    assert info["frames"] == FRAMES
    assert info["fps"] == 10.0
    assert info["size"] == [WIDTH, HEIGHT]
    assert info["calibration"] == "given"
    assert set(info["bits"]) == {"total", "texture", "disparity", "enhancement", "other"}
    assert info["bits"]["total"] == 8 * coded.stat().st_size
    assert info["bits"]["total"] == sum(info["bits"][part] for part in ("texture", "disparity", "other"))
    low, high = info["disparity_range_px"]
    assert low <= 2 * FAR_PX
    assert high >= 2 * NEAR_PX
    assert f"{FRAMES} frame sets" in succeeds("info", coded)


def test_decoded_array_against_its_original(array: Path, coded: Path, tmp_path: Path) -> None:
    assert succeeds("decode", coded, tmp_path / "out") == ""
    stated = manifest(tmp_path / "out")
    assert stated["real"] == [[0, 0], [0, 2], [2, 0], [2, 2]]
    assert "first_frame" not in stated
    result = json.loads(succeeds("compare", array, tmp_path / "out", "--json"))
    assert len(result["views"]) == 9
    assert result["psnr_y"]["real"] > 38
    assert result["psnr_y"]["virtual"] > 25
    assert result["psnr_y"]["worst"] <= result["psnr_y"]["virtual"] <= result["psnr_y"]["all"]
    text = succeeds("compare", array, tmp_path / "out")
    assert f"{result['psnr_y']['virtual']:.2f}" in text


def test_frame_ranges_keep_their_place_in_the_original(array: Path, tmp_path: Path) -> None:
    succeeds("encode", array, tmp_path / "x.mcap", "--frames", "1:", "--qp", "20", "--quiet")
    succeeds("decode", tmp_path / "x.mcap", tmp_path / "out", "--frames", "-2:-1")
    assert manifest(tmp_path / "out")["first_frame"] == 2
    assert psnr(read(tmp_path / "out" / "r00_c00" / "000000.png"), picture((0, 0), 2)) > 38
    assert json.loads(succeeds("compare", array, tmp_path / "out", "--json"))["psnr_y"]["real"] > 38


def test_standard_input_decodes_to_the_same_pictures(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path / "file", "--frames", "1:3")
    succeeds("decode", "-", tmp_path / "pipe", "--frames", "1:3", stdin=coded.read_bytes())
    names = sorted(path.relative_to(tmp_path / "file") for path in (tmp_path / "file").rglob("*.*"))
    assert len(names) == 2 * 9 + 1
    for name in names:
        assert (tmp_path / "file" / name).read_bytes() == (tmp_path / "pipe" / name).read_bytes()


def test_a_finer_grid_states_where_its_real_cameras_are(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path / "out", "--grid", "5x3", "--frames", ":1")
    stated = manifest(tmp_path / "out")
    assert (stated["rows"], stated["cols"]) == (5, 3)
    assert stated["real"] == [[0, 0], [0, 2], [4, 0], [4, 2]]
    assert stated["rho"] == 0.5
    assert stated["calibration"]["baseline_m"] == CALIBRATION.baseline_m
    assert open_input([tmp_path / "out"]).frame_count == 1


def test_a_coarser_grid_has_wider_steps(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path / "out", "--grid", "2x2", "--frames", ":1")
    stated = manifest(tmp_path / "out")
    assert stated["real"] == [[0, 0], [0, 1], [1, 0], [1, 1]]
    assert stated["rho"] == 1.0
    assert stated["calibration"]["baseline_m"] == 2 * CALIBRATION.baseline_m
    assert stated["disparity_per_step_px"] == [0.0, 8.0]


def test_single_views_as_pictures(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path, "--view", "0,2", "--view", "0.5,1.25", "--frames", "2:")
    files = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.png"))
    assert files == [f"{view}/{n:06d}.png" for view in ("r0.500_c1.250", "r00_c02") for n in range(2)]
    assert psnr(read(tmp_path / "r00_c02" / "000001.png"), picture((0, 2), 3)) > 38


def test_videos_of_the_views_and_back_in(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path / "views", "--format", "mp4", "--grid", "2x2")
    videos = [tmp_path / "views" / f"r{row:02d}_c{col:02d}.mp4" for row in range(2) for col in range(2)]
    done = mvcodec("encode", *videos, tmp_path / "x.mcap", "--grid", "2x2", "--json")
    assert done.returncode == 0, done.stderr
    info = json.loads(done.stdout)
    assert (info["grid"], info["frames"], info["calibration"]) == ([2, 2], FRAMES, "nominal")


def test_mosaics(coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path / "all.png", "--format", "mosaic", "--frames", "1:")
    sheet = read(tmp_path / "all.png")
    assert sheet.shape == (3 * HEIGHT, 3 * WIDTH, 3)
    assert psnr(sheet[-HEIGHT:, :WIDTH], picture((2, 0), 1)) > 38
    (tmp_path / "all.mp4").write_bytes(b"old")
    assert "-y overwrites it" in fails(1, "decode", coded, tmp_path / "all.mp4")
    succeeds("decode", coded, tmp_path / "all.mp4", "-y")
    video = open_input([tmp_path / "all.mp4"], grid=(1, 1), real="all")
    assert (video.frame_count, video.array.width) == (FRAMES, 3 * WIDTH)


def test_a_folder_is_overwritten_where_that_is_asked_and_nothing_else_is_in_it(
    coded: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    succeeds("decode", coded, out, "--frames", ":1")
    assert "it holds array.json already; -y overwrites it" in fails(1, "decode", coded, out)
    succeeds("decode", coded, out, "--frames", ":2", "-y")
    assert manifest(out)["frames"] == 2
    (out / "mine.txt").write_text("keep")
    assert "it holds other things, such as mine.txt" in fails(1, "decode", coded, out, "-y")
    assert (out / "mine.txt").read_text() == "keep"


def test_the_ending_says_what_is_written_and_the_end_tells_it(coded: Path, tmp_path: Path) -> None:
    one = tmp_path / "one.mp4"
    done = mvcodec("decode", coded, one, "--view", "1,0.5", "--frames", "1:")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == f"mvcodec: {one}: {FRAMES - 1} frames of 1 view, 10 fps, 0.30 s\n"
    video = open_input([one], grid=(1, 1), real="all")
    assert (video.frame_count, video.array.width, video.array.height) == (FRAMES - 1, WIDTH, HEIGHT)
    assert mvcodec("decode", coded, tmp_path / "x.mcap", "--frames", ":1", "--quiet").stderr == ""
    assert "clean" in succeeds("validate", tmp_path / "x.mcap")
    succeeds("decode", coded, tmp_path / "o.mp4", "--format", "png", "--view", "0,0", "--frames", ":1")
    assert len(list((tmp_path / "o.mp4").glob("*/000000.png"))) == 1


def test_a_file_is_compared_as_what_it_decodes_to(array: Path, coded: Path, tmp_path: Path) -> None:
    succeeds("decode", coded, tmp_path / "out", "--frames", "1:3")
    folder = json.loads(succeeds("compare", array, tmp_path / "out", "--json"))
    assert json.loads(succeeds("compare", array, coded, "--frames", "1:3", "--json")) == folder
    assert "--provenance" in fails(2, "compare", array, coded, "--provenance", tmp_path / "out")


def test_encode_tells_its_bits_beside_simulcast(array: Path, tmp_path: Path) -> None:
    out = tmp_path / "x.mcap"
    text = succeeds("encode", array, out, "--frames", ":1", "--matcher", "sgbm")
    assert re.search(r"; about \d+% of all 9 views as simulcast, going by the real ones\n$", text)
    again = succeeds("encode", array, out, "--frames", ":1", "--matcher", "sgbm", "-y", "--json")
    info = json.loads(again)
    assert info["simulcast_bits_estimated"] == pytest.approx(info["bits"]["texture"] * 9 / 4, abs=1)
    alone = succeeds("encode", array, out, "--frames", ":1", "--real", "all", "-y", "--matcher", "sgbm")
    assert "simulcast" not in alone


def test_info_states_how_a_file_was_made_and_how_long_it_plays(coded: Path) -> None:
    info = json.loads(succeeds("info", coded, "--json"))
    assert (info["codec"], info["rate"], info["matcher"]) == ("h264", {"qp": 22}, "joint")
    assert info["encoder"] == f"mvcodec {__version__}"
    assert info["duration_s"] == pytest.approx(FRAMES / 10)
    assert info["megabytes"] == coded.stat().st_size / 1e6
    assert info["mbit_per_s"] == pytest.approx(8 * info["megabytes"] / info["duration_s"])
    os.utime(coded, (0, 86_399))
    assert json.loads(succeeds("info", coded, "--json"))["created"] == "1970-01-01T23:59:59Z"
    text = succeeds("info", coded)
    assert "created      1970-01-01 23:59:59 UTC, as the system dates the file" in text
    for part in ("h264, QP 22", "joint", f"mvcodec {__version__}", "0.40 s", "Mbit/s"):
        assert part in text


def test_every_setting_at_once(array: Path, tmp_path: Path) -> None:
    maps = "--disparity-qp 30 --disparity-scale 2 --disparity-median 0"
    options = f"--real all --crf 24 {maps} --gop 2 --matcher sgbm --preset veryfast --frames :3"
    out = succeeds(
        "encode", array, tmp_path / "x.mcap", *options.split(), "--disparity-range", "-2,6", "--json"
    )
    info = json.loads(out)
    assert len(info["real"]) == 9
    assert info["frames"] == 3
    low, high = info["disparity_range_px"]
    assert -2 <= low < high <= 6
    assert info["disparity_scale"] == 2
    assert "maps of half size" in succeeds("info", tmp_path / "x.mcap")
    assert "clean" in succeeds("validate", tmp_path / "x.mcap")
    rated = succeeds(
        "encode", array, tmp_path / "y.mcap", "--bitrate", "300", "--disparity-range", "auto", "--json"
    )
    assert json.loads(rated)["frames"] == FRAMES


def test_a_range_is_widened_and_told_or_narrowed_as_the_pictures_ask_unless_it_is_exact(
    array: Path, tmp_path: Path
) -> None:
    options = array, tmp_path / "x.mcap", "--frames", ":1", "--disparity-range", "0,2", "--dry-run"
    done = mvcodec("encode", *options)
    assert "beyond the stated 0..2 px; widened to 0..8 px (--exact-range keeps it as stated)" in done.stderr
    assert json.loads(done.stdout)["disparity_range_px"] == [0, 8]
    wide = mvcodec("encode", *options[:-2], "-200,200", "--dry-run")
    assert "the pictures show" not in wide.stderr
    low, high = json.loads(wide.stdout)["disparity_range_px"]
    assert -8 <= low <= 0
    assert 4 <= high <= 16
    exact = mvcodec("encode", *options, "--exact-range")
    assert "the pictures show" not in exact.stderr
    assert json.loads(exact.stdout)["disparity_range_px"] == [0, 2]
    told = fails(2, "encode", array, tmp_path / "x.mcap", "--disparity-range", "auto", "--exact-range")
    assert (
        told
        == "mvcodec: error: --exact-range: found no range, expected --disparity-range LO,HI, which it keeps"
    )


def test_a_pair_of_cameras_that_are_both_real(tmp_path: Path) -> None:
    write_array(tmp_path / "pair", 1, 2, 2)
    succeeds("encode", tmp_path / "pair", tmp_path / "x.mcap", "--real", "all", "--quiet")
    succeeds("decode", tmp_path / "x.mcap", tmp_path / "out", "--grid", "1x3")
    assert manifest(tmp_path / "out")["real"] == [[0, 0], [0, 2]]


def test_launchers_are_the_same_commands(array: Path, tmp_path: Path) -> None:
    calls: dict[str, list[str | Path]] = {
        "encode.py": [array, tmp_path / "x.mcap", "--frames", ":1", "--quiet"],
        "decode.py": [tmp_path / "x.mcap", tmp_path / "out", "--view", "1,1"],
    }
    for tool, arguments in calls.items():
        subprocess.run([sys.executable, TOOLS / tool, *arguments], check=True)
    assert (tmp_path / "out" / "r01_c01" / "000000.png").is_file()


def test_sample_scene_is_an_array_like_any_other(tmp_path: Path) -> None:
    options = "--grid 2x3 --frames 2 --size 64x48 --seed 5 --quiet"
    assert succeeds("sample", tmp_path / "a", *options.split()) == ""
    source = open_input([tmp_path / "a"])
    assert (source.array.rows, source.array.cols, source.frame_count) == (2, 3, 2)
    assert (source.array.width, source.array.height) == (64, 48)
    assert source.truth((1, 2), 1) is not None
    succeeds("sample", tmp_path / "b", *options.split())
    first, second = (tmp_path / name / "r01_c02" / "000001.png" for name in "ab")
    assert first.read_bytes() == second.read_bytes()


def test_another_codec_goes_all_the_way(array: Path, tmp_path: Path) -> None:
    coded, clean, decoded = tmp_path / "x.mcap", tmp_path / "clean.mcap", tmp_path / "views"
    fast = ("--preset", "ultrafast", "--frames", ":2", "--matcher", "sgbm", "--quiet")
    succeeds("encode", array, coded, "--codec", "vp9", *fast)
    assert json.loads(succeeds("info", coded, "--json"))["frames"] == 2
    succeeds("recover", coded, clean, "--quiet")
    succeeds("validate", clean)
    succeeds("decode", clean, decoded, "--quiet")
    found = json.loads(succeeds("compare", array, decoded, "--frames", ":2", "--quiet", "--json"))
    assert found["psnr_y"]["real"] > 30

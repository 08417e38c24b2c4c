"""Runs of `mvcodec evaluate`: interrupted, of other codecs, with a layer, and with what cannot be."""

from __future__ import annotations

import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
from command_line import COMMAND, fails, mvcodec, succeeds
from evaluate_reports import FAST, point_times, report
from small_arrays import write_array

from mvcodec.cli.main import main
from mvcodec.container import read_info

pytest_plugins = ("ctrl_c",)


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("arrays") / "small", 2, 3, frames=2)


@pytest.mark.usefixtures("heeding_ctrl_c")
def test_an_interrupted_run_goes_on_where_it_stopped(array: Path, tmp_path: Path) -> None:
    # Enough points that a busy machine cannot be through with them before the signal comes.
    qps = [str(qp) for qp in range(12, 48, 4)]
    arguments = [str(array), "--output", str(tmp_path / "r"), "--qp", ",".join(qps), *FAST]
    arguments += ["--anchors", "simulcast", "--anchor-codecs", "h264"]
    with subprocess.Popen(
        [*COMMAND, "evaluate", *arguments, "--jobs", "1"], stderr=subprocess.PIPE, text=True
    ) as process:
        deadline = time.monotonic() + 60
        while len(point_times(tmp_path / "r")) < 3 and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert errors.strip().splitlines()[-1] == "mvcodec: error: interrupted"
    kept = point_times(tmp_path / "r")
    assert 3 <= len(kept) < 3 * len(qps)
    assert not (tmp_path / "r" / "report.json").exists()
    succeeds("evaluate", *arguments)
    assert kept.items() <= point_times(tmp_path / "r").items()
    assert len(report(tmp_path / "r")["curves"][0]["points"]) == len(qps)


@pytest.mark.parametrize("codec", ["hevc", "av1"])
def test_our_own_streams_in_another_codec(array: Path, tmp_path: Path, codec: str) -> None:
    arguments = ("--qp", "30,40", "--codec", codec, "--anchors", "simulcast", "--anchor-codecs", "h264")
    succeeds("evaluate", array, "--output", tmp_path, *arguments, *FAST)
    document = report(tmp_path)
    names = [curve["name"] for curve in document["curves"]]
    assert names == ["mvcodec", "simulcast", "simulcast-h264", "simulcast-b-h264"]
    assert [curve["codec"] for curve in document["curves"]] == [codec, codec, "h264", "h264"]
    for path in (tmp_path / "points").glob("*.mcap"):
        assert read_info(path).header.codec == codec
    h264 = [point["qp"] for point in document["curves"][2]["points"]]
    assert h264 == ([25, 29] if codec == "av1" else [30, 40])


def test_with_a_layer_the_base_its_layer_and_their_hull_are_measured(array: Path, tmp_path: Path) -> None:
    arguments = ("--qp", "24,38", "--enhance", "auto", "--anchors", "simulcast", "--anchor-codecs", "h264")
    succeeds("evaluate", array, "--output", tmp_path, *arguments, *FAST)
    document = report(tmp_path)
    curves = {curve["name"]: curve["points"] for curve in document["curves"]}
    assert list(curves) == ["mvcodec", "mvcodec-base", "mvcodec-enhanced", "simulcast", "simulcast-b"]
    assert list(document["bd_rate"]) == ["simulcast", "simulcast-b"]
    measured = [*curves["mvcodec-base"], *curves["mvcodec-enhanced"]]
    assert len(measured) == 4
    assert all(point in measured for point in curves["mvcodec"])
    assert all(point["bits_split"]["enhancement"] == 0 for point in curves["mvcodec-base"])
    for base, both in zip(curves["mvcodec-base"], curves["mvcodec-enhanced"], strict=True):
        assert both["bits_split"]["texture"] == base["bits_split"]["texture"]
        assert both["bits_split"]["enhancement"] > 0


def test_pictures_that_occur_twice_are_told(tmp_path: Path) -> None:
    folder = write_array(tmp_path / "array", frames=2)
    shutil.copy(folder / "r00_c00" / "000000.png", folder / "r01_c01" / "000001.png")
    arguments = ("--qp", "30", "--anchors", "simulcast", "--anchor-codecs", "h264", *FAST)
    done = mvcodec("evaluate", folder, "--output", tmp_path / "r", *arguments)
    assert done.returncode == 0
    assert "1 pictures of the input repeat others (such as r00_c00 frame 0 = r01_c01 frame 1)" in done.stderr
    assert report(tmp_path / "r")["repeated_pictures"] == [
        [{"view": [0, 0], "frame": 0}, {"view": [1, 1], "frame": 1}]
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--disparity-scale", "3"), "--disparity-scale: found 3"),
        (("--qp", "60"), "--qp: found 60, expected a whole number, 1..51"),
        (("--qp", "a"), "expected whole numbers such as 22,27,32,37"),
        (("--anchors", "best"), "--anchors: found best, expected some of simulcast, pvs"),
        (("--anchor-codecs", "vp8"), "--anchor-codecs: found vp8, expected one of h264, hevc, av1"),
        (("--gop", "99"), "--gop: found 99, expected 1..10"),
        (("--synthesizer", "magic"), "synthesizer: found magic"),
        (("--frames", "7:"), "--frames: found 7:"),
    ],
)
def test_bad_settings_are_told_before_anything_is_measured(
    array: Path, tmp_path: Path, options: tuple[str, str], message: str
) -> None:
    arguments = ("--disparity-range", "0,8", *options)
    assert message in fails(2, "evaluate", array, "--output", tmp_path / "r", *arguments)
    assert not (tmp_path / "r").exists()


def test_a_file_is_no_report(array: Path, tmp_path: Path) -> None:
    (tmp_path / "r").write_text("x")
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "thesis.tex").touch()
    line = fails(1, "evaluate", array, "--output", tmp_path / "own")
    assert line.endswith("it holds other things, such as thesis.tex; name another folder")
    assert "a report is a folder" in fails(1, "evaluate", array, "--output", tmp_path / "r")


def test_what_is_not_installed_is_named_with_its_extra(
    array: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert main(["evaluate", str(array), "--output", str(tmp_path / "r")]) == 1
    assert "pip install 'bjontegaard>=" in capsys.readouterr().err

"""The tools that show how the maps' quantiser and the video encoder's settings for maps were chosen."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from small_arrays import write_array

TOOLS = Path(__file__).parents[1] / "tools"


def run(tool: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, TOOLS / tool, *arguments], capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("arrays") / "small", frames=2)


def test_every_coding_is_measured_and_no_coding_lies_beyond_the_hull(array: Path) -> None:
    done = run("disparity_qp.py", array, "--qp", "24,34", "--offsets=-8,8", "--json")
    assert done.returncode == 0, done.stderr
    codings = json.loads(done.stdout)["codings"]
    assert len(codings) == 2 * 2 * 3
    for qp in (24, 34):
        assert sum(each["chosen"] for each in codings if each["qp"] == qp) == 1
    assert all(each["excess"] > -1e-9 for each in codings)
    assert all(abs(each["excess"]) < 1e-9 for each in codings if each["on_hull"])
    assert any(each["on_hull"] for each in codings)
    for scale in (1, 2):
        shares = [each["maps"] for each in codings if each["qp"] == 24 and each["scale"] == scale]
        assert shares == sorted(shares, reverse=True)


def test_a_wrong_qp_is_one_line(array: Path) -> None:
    done = run("disparity_qp.py", array, "--qp", "0")
    assert done.returncode == 2
    assert done.stderr.startswith("disparity_qp: error: qp: found 0, expected")
    assert len(done.stderr.splitlines()) == 1


def test_the_usual_settings_are_the_measure_of_the_others(array: Path) -> None:
    usual, finer = "psy=0:aq-mode=0", "psy=0:aq-mode=0:chroma-qp-offset=0:ipratio=4"
    done = run(
        "map_settings.py",
        array,
        "--qp",
        "24,34",
        "--disparity-range",
        "0,8",
        "--set",
        usual,
        "--set",
        finer,
        "--json",
    )
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["disparity_range_px"] == [0, 8]
    trials = document["trials"]
    assert [trial["parameters"] for trial in trials] == 2 * [usual, usual, finer]
    for first, same, other in (trials[:3], trials[3:]):
        assert first["excess"] == same["excess"] == 0
        assert first == same
        assert other["maps_kbit"] > first["maps_kbit"], "keyframes of a finer quantiser"


def test_wrong_settings_are_told(array: Path) -> None:
    for arguments, message in (
        (("--qp", "27"), "--qp: found 27, expected at least two"),
        (("--codec", "av1"), "--codec: found av1, expected one of h264, hevc"),
        (("--qp", "a"), "argument --qp: found 'a', expected whole numbers"),
    ):
        done = run("map_settings.py", array, *arguments)
        assert done.returncode == 2
        assert message in done.stderr.splitlines()[-1]

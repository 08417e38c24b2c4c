"""The tool that shows what the video encoder's settings for maps cost."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from small_arrays import write_array

TOOL = Path(__file__).parents[1] / "tools" / "map_settings.py"


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("arrays") / "small", frames=2)


def test_the_usual_settings_are_the_measure_of_the_others(array: Path) -> None:
    usual, finer = "psy=0:aq-mode=0", "psy=0:aq-mode=0:chroma-qp-offset=0:ipratio=4"
    done = run(array, "--qp", "24,34", "--disparity-range", "0,8", "--set", usual, "--set", finer, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["disparity_range_px"] == [0, 8]
    trials = document["trials"]
    assert [trial["parameters"] for trial in trials] == 2 * [usual, usual, finer]
    for first, same, other in (trials[:3], trials[3:]):
        assert first["excess"] == same["excess"] == 0
        assert first == same
        assert other["maps_kbit"] > first["maps_kbit"], "keyframes of a finer quantiser"


def test_wrong_settings_are_one_line(array: Path) -> None:
    for arguments, message in (
        (("--qp", "27"), "--qp: found 27, expected at least two"),
        (("--codec", "av1"), "--codec: found av1, expected one of h264, hevc"),
        (("--qp", "a"), "argument --qp: found 'a', expected whole numbers"),
    ):
        done = run(array, *arguments)
        assert done.returncode == 2
        assert message in done.stderr.splitlines()[-1]

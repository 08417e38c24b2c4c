"""The tool that shows how the maps' quantiser was chosen."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from small_arrays import write_array

TOOL = Path(__file__).parents[1] / "tools" / "disparity_qp.py"


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def array(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_array(tmp_path_factory.mktemp("arrays") / "small", frames=2)


def test_every_coding_is_measured_and_no_coding_lies_beyond_the_hull(array: Path) -> None:
    done = run(array, "--qp", "24,34", "--offsets=-8,8", "--json")
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


def test_wrong_settings_are_one_line(array: Path) -> None:
    done = run(array, "--qp", "0")
    assert done.returncode == 2
    assert done.stderr.startswith("disparity_qp: error: qp: found 0, expected")
    assert len(done.stderr.splitlines()) == 1

"""The tool that measures growth: what its pictures show, and what it says of a line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import time_growth

from mvcodec.layers.refinement import make_matcher

TOOL = Path(__file__).parents[1] / "tools" / "time_growth.py"


def test_its_cameras_see_two_planes_of_the_disparities_that_it_says() -> None:
    array, frame_set = time_growth.planes(2, 2, (96, 64), 20)
    values = make_matcher("realtime").match(array, frame_set.pictures, (0.0, 19.0))[1, 1].values_px
    far, near = np.median(values[:8]), np.median(values[20:30, 36:52])
    assert abs(far - 6) < 0.5
    assert abs(near - 14) < 0.5


@pytest.mark.parametrize("exponent", [1, 2])
def test_the_power_is_that_of_the_last_step(exponent: int) -> None:
    line = [(1.0, 5.0, 0.0), (10.0, 1.0, 0.0), (40.0, 4.0**exponent, 0.0)]
    assert abs(time_growth.power(line) - exponent) < 1e-9


def test_the_figure_has_every_line(tmp_path: Path) -> None:
    line = [(1.0, 1.0, 10.0), (2.0, 2.0, 20.0)]
    lines = {(sweep, what): line for sweep, (_, measured) in time_growth.SWEEPS.items() for what in measured}
    time_growth.draw(lines, tmp_path / "growth.svg")
    drawn = (tmp_path / "growth.svg").read_text()
    assert drawn.count('id="legend_') == len(time_growth.SWEEPS) + 1


def test_an_unknown_sweep_is_named() -> None:
    done = subprocess.run(
        [sys.executable, TOOL, "--sweeps", "colours"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "found colours, expected some of size, levels" in done.stderr

"""The times at which pictures were taken reach what is written of them."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from mvcodec.array import Calibration, CameraArray
from mvcodec.capture import open_input
from mvcodec.capture.video_input import VideoView
from mvcodec.output.forms import OutputPlan, open_form
from mvcodec.output.video_file import Mp4Writer

TIMES_NS = [0, 40_000_000, 80_000_000, 60_080_000_000, 60_120_000_000]
"""25 a second, and a minute's pause."""

PICTURE = np.full((16, 24, 3), 90, np.uint8)


@pytest.mark.parametrize(("form", "name"), [("mp4", ""), ("mosaic", "m.mp4"), ("array", "")])
def test_a_pause_is_a_pause(tmp_path: Path, form: str, name: str) -> None:
    array = CameraArray(1, 2, 24, 16, 25.0, (0,), (0, 1), Calibration.nominal(24, 16))
    plan = OutputPlan(array, array.viewpoints(1, 2), (1, 2))
    with open_form(form, tmp_path / name, plan) as writer:
        for time_ns in TIMES_NS:
            writer.push([PICTURE] * 2, time_ns)
    if form == "array":
        source = open_input([tmp_path])
        assert [item.time_ns for item in source.frame_sets()] == TIMES_NS
        assert source.array.fps == 25.0
        return
    view = VideoView(tmp_path / (name or "r00_c01.mp4"))
    assert view.times_ns == pytest.approx(TIMES_NS, abs=60_000)
    assert view.fps == 25.0


def test_times_of_a_constant_rate_are_not_written(tmp_path: Path) -> None:
    array = CameraArray(1, 1, 24, 16, 30000 / 1001, (0,), (0,), Calibration.nominal(24, 16))
    plan = OutputPlan(array, array.viewpoints(1, 1), (1, 1), first_frame=7)
    with open_form("array", tmp_path, plan) as writer:
        for number in range(7, 12):
            writer.push([PICTURE], round(number * 1e9 / array.fps))
    assert "times_ns" not in (tmp_path / "array.json").read_text()


@pytest.mark.parametrize("fps", [30000 / 1001, 24.0, 12.5, 1 / 3, 1e-4, 1 / 86400])
def test_a_constant_rate_is_exact(tmp_path: Path, fps: float) -> None:
    with Mp4Writer(tmp_path / "v.mp4", 24, 16, fps) as writer:
        for number in range(4):
            writer.push(PICTURE, round(number * 1e9 / fps))
    view = VideoView(tmp_path / "v.mp4")
    assert view.fps == pytest.approx(fps, rel=1e-6)
    assert view.times_ns == pytest.approx([number * 1e9 / fps for number in range(4)], rel=1e-6, abs=2)


def test_a_pause_that_mp4_cannot_say_is_shortened(tmp_path: Path) -> None:
    with warnings.catch_warnings(record=True) as told, Mp4Writer(tmp_path / "v.mp4", 24, 16, 25.0) as writer:
        warnings.simplefilter("always")
        for days in (0, 30, 60):
            writer.push(PICTURE, days * 86_400 * 10**9)
            writer.push(PICTURE, days * 86_400 * 10**9 + 40_000_000)
    assert ["v.mp4: pauses of more than" in str(warning.message) for warning in told] == [True]
    times = VideoView(tmp_path / "v.mp4").times_ns
    assert times is not None
    assert times[1] == 40_000_000
    assert times[2] > 7 * 3600 * 10**9

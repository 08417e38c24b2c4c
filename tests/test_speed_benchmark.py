"""The benchmark of speed on pictures of a few pixels: its rows are made, and say what they are asked for."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import cv2
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))


def test_a_row_is_the_ratio_of_the_times_that_count() -> None:
    from speed_measures import Row

    row = Row("work", 30.0, 10.0, 50.0, 20.0, 4, 3)
    assert row.ratio == 3.0
    by_cpu = Row("work", 30.0, 10.0, 50.0, 20.0, 4, 3, by_cpu=True)
    assert by_cpu.to_json()["ratio"] == 2.5
    assert json.loads(json.dumps(row.to_json()))["must"] == 4


def test_both_sides_take_turns() -> None:
    from speed_measures import take_turns

    calls: list[str] = []
    row = take_turns("work", lambda: calls.append("ours"), lambda: calls.append("theirs"), repeats=3)
    assert calls == ["ours", "theirs"] * 4  # once for all that is done but once
    assert 0 <= row.ours_ms < 1000


def test_matching_is_measured_at_every_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    import speed_encoding

    monkeypatch.setattr(speed_encoding, "REPEATS", 1)
    threads = cv2.getNumThreads()
    try:
        rows = list(speed_encoding.matching_rows((64, 48)))
    finally:
        cv2.setNumThreads(threads)
    assert [row.work.split(", ")[1].split(" /")[0] for row in rows] == ["realtime", "balanced", "best"]
    assert all(row.by_cpu and row.ratio > 0 and row.must is not None for row in rows)


def test_two_threads_are_measured_against_one() -> None:
    from speed_threads import thread_rows

    threads = cv2.getNumThreads()
    rows = list(thread_rows((64, 48), repeats=1))
    assert [row.work.split(",")[0] for row in rows] == [
        "maps of a frame set",
        "one virtual view",
        "decode a frame set",
    ]
    assert all(row.must == 0.59 and row.ratio > 0 for row in rows)
    assert cv2.getNumThreads() == threads


def test_the_chain_and_stock_code_run_on_the_same_pictures() -> None:
    import speed_encoding
    from speed_measures import material, stock_code

    made = material(64, 48, frames=2)
    speed_encoding.encode_all(made, "realtime")
    stock_code(made, "veryfast")()


def test_unknown_rows_are_a_usage_error() -> None:
    command = [sys.executable, str(BENCHMARKS / "speed.py"), "--rows", "matching,cooking"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--rows: found matching,cooking, expected some of encoding, matching" in done.stderr

"""What the tests of `mvcodec evaluate` run it with, and read of its reports."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FAST = ("--preset", "ultrafast", "--disparity-range", "0,8", "--synthesizer", "linear")


def report(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "report.json").read_text())
    return document


def point_times(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in (folder / "points").glob("*.json")}

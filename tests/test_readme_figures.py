"""README's tables of figures: what stands in them, and where."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

TOOL = Path(__file__).parents[1] / "tools" / "readme_figures.py"
README = "# x\n\n<!-- figures -->\nold\n<!-- end of figures -->\n\nafter\n"
QUALITY = {"sets": {"wide": {"psnr_y": 33.337, "worst_psnr_y": 31.0, "ssim": 0.91234}}}


def delta(percent: float | None, overlap: list[float] | None, **lead: Any) -> dict[str, Any]:
    return {"all": percent, "overlap_db": overlap, "overtaken": None, "anchor_ahead_kbps": [], **lead}


def report(name: str, deltas: dict[str, Any], codec: str = "h264") -> dict[str, Any]:
    return {"input": f"some/{name}", "curves": [{"codec": codec}], "bd_rate": deltas}


def crossing(kbps: float, at_most: bool = False) -> dict[str, Any]:
    return {"kbps": kbps, "psnr_y": 34.84, "at_most": at_most}


def run(folder: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, TOOL, folder / "README.md", "--quality", folder / "quality.json", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def lines_of(tmp_path: Path, *reports: dict[str, Any]) -> list[str]:
    (tmp_path / "README.md").write_text(README)
    (tmp_path / "quality.json").write_text(json.dumps(QUALITY))
    paths = []
    for number, document in enumerate(reports):
        paths.append(tmp_path / f"{number}.json")
        paths[-1].write_text(json.dumps(document))
    done = run(tmp_path, "--reports", *paths)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "README.md").read_text()
    assert text.startswith("# x\n\n<!-- figures -->\n\n| set |")
    assert text.endswith("\n\n<!-- end of figures -->\n\nafter\n")
    return text.splitlines()


def test_synthesis_has_a_line_for_each_set(tmp_path: Path) -> None:
    assert "| wide | 33.34 | 31.00 | 0.9123 |" in lines_of(tmp_path)


def test_each_bd_rate_stands_beside_the_quality_that_it_holds_for(tmp_path: Path) -> None:
    first = {
        "simulcast": delta(-79.04, [29.31, 34.0]),
        "pvs": delta(12.0, [31.0, 33.96], overtaken=crossing(16490.0), anchor_ahead_kbps=[[16490, 20000]]),
        "pvs-rows": delta(-1.0, [30, 31], overtaken=crossing(17000.0), anchor_ahead_kbps=[[17000, 20000]]),
    }
    second = {"simulcast": delta(None, None)}
    lines = lines_of(tmp_path, report("a", first), report("b", second, "hevc"))
    assert "| input | codec | simulcast | pvs | pvs-rows | first overtaken |" in lines
    assert (
        "| a | h264 | -79.0 % (29.3 - 34.0) | +12.0 % (31.0 - 34.0) | -1.0 % (30.0 - 31.0)"
        " | pvs: 16.49 Mbit/s, 34.8 dB |"
    ) in lines
    assert "| b | hevc | no common quality |  |  |  |" in lines


def test_an_anchor_that_is_ahead_everywhere_or_before_it_is_passed_is_named(tmp_path: Path) -> None:
    everywhere = {
        "pvs": delta(None, None, overtaken=crossing(1000.0, True), anchor_ahead_kbps=[[1000, 8000]])
    }
    passed = {
        "simulcast": delta(-5.0, [30, 35], anchor_ahead_kbps=[[100, 250]]),
        "pvs": delta(-5.0, [30, 35], overtaken=crossing(700.0), anchor_ahead_kbps=[[100, 200], [700, 800]]),
    }
    lines = lines_of(tmp_path, report("a", everywhere), report("b", passed))
    assert "| a | h264 | no common quality |  | pvs: everywhere, <= 1.00 Mbit/s, 34.8 dB |" in lines
    last = "pvs: 0.70 Mbit/s, 34.8 dB; simulcast: 0.10 - 0.25 Mbit/s; pvs: 0.10 - 0.20 Mbit/s"
    assert lines[-5].endswith(f"| {last} |")


def test_a_report_without_the_ranges_of_rates_is_read(tmp_path: Path) -> None:
    old = {"all": -5.0, "overlap_db": [30, 35], "overtaken": crossing(700.0)}
    assert lines_of(tmp_path, report("a", {"pvs": old}))[-5].endswith("| pvs: 0.70 Mbit/s, 34.8 dB |")


def test_a_readme_without_the_marks_is_refused(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("nothing")
    (tmp_path / "quality.json").write_text(json.dumps(QUALITY))
    done = run(tmp_path)
    assert done.returncode == 1
    assert "no place for the figures" in done.stderr
    assert (tmp_path / "README.md").read_text() == "nothing"


def test_speed_has_a_line_for_each_work(tmp_path: Path) -> None:
    row = {"ours_ms": 19.1, "theirs_ms": 3.7, "ours_cpu_ms": 30.0, "theirs_cpu_ms": 6.0, "ratio": 5.162}
    rows = [
        row | {"work": "a / b", "must": 5, "by_cpu": False, "note": "52.5 frame sets a second; must be 25"},
        row | {"work": "c / d", "must": None, "by_cpu": True, "note": ""},
    ]
    (tmp_path / "README.md").write_text(README)
    (tmp_path / "speed.json").write_text(json.dumps({"rows": rows}))
    command: list[str | Path] = [
        sys.executable,
        TOOL,
        tmp_path / "README.md",
        "--speed",
        tmp_path / "speed.json",
    ]
    subprocess.run(command, check=True)
    lines = (tmp_path / "README.md").read_text().splitlines()
    assert "| a / b, 52.5 frame sets a second | 19.1 | 3.7 | 5.16 | 5 |" in lines
    assert "| c / d | 30.0 | 6.0 | 5.16 |  |" in lines

"""The tool that prints the thesis's tables: tiny made-up rows, small arrays of one's own, the real sets."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
from small_arrays import write_array
from thesis import grid, maps, pairs, reasons
from thesis.lines import BETAS
from thesis.thesis_figures import LayerFigures, ViewFigures

from mvcodec.evaluation.regions import BadPixels

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"
TABLES = ROOT.parent / "shared" / "reference" / "thesis_tables.json"


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("reproduce_thesis", ROOT / "tools" / "reproduce_thesis.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Printed = Callable[[], list[str]]


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Printed:
    def lines() -> list[str]:
        return capsys.readouterr().out.splitlines()

    return lines


def layers_of(deepest: int) -> LayerFigures:
    return LayerFigures(2, deepest, 0.9, deepest / 4)


def words(line: str) -> str:
    return " ".join(line.split())


def test_prints_pairs(tool: ModuleType, printed: Printed) -> None:
    row = pairs.PairRow("Cones", "DILS, SAD", 0.5, ViewFigures(29.384, 20.09, 0.4081), 31.66, 0.68)
    other = replace(row, method="DILS, SAD, a layer a level", thesis_psnr=None, thesis_ssim=None)
    depths = {("Cones", "SAD", "runs"): layers_of(40), ("Cones", "SAD", "levels"): layers_of(1)}
    tool.print_pairs(pairs.PairTable((row, other), depths))
    lines = printed()
    assert words(lines[2]) == "Cones DILS, SAD 0.50 29.38 31.66 0.408 0.68 20.09"
    assert words(lines[3]) == "Cones DILS, SAD, a layer a level 0.50 29.38 - 0.408 - 20.09"
    assert lines[4] == "Cones, SAD: layers by the thesis's split: 2, the deepest of 40 disparities"
    assert [line for line in lines[5:] if line] == []


def test_prints_maps(tool: ModuleType, printed: Printed) -> None:
    rates = tuple(BadPixels(share, share + 0.01, share + 0.02) for share in (0.2, 0.1, 0.05))
    row = maps.MapRow(maps.THESIS_DLR, "Venus", rates, 1.0, (2.5, 3.2, 18.3))
    ours = replace(row, method=maps.OUR_DLR, thesis_percent=None)
    tool.print_maps(maps.MapTable((row, ours), {"Venus": layers_of(18)}))
    lines = printed()
    assert lines[1].split() == ["Venus", "average"]
    assert lines[2].startswith("DLR, the thesis's steps ")
    assert lines[2].split()[-2:] == ["10.00/11.00/12.00", "11.00"]
    assert lines[3].split() == ["thesis,", "SAD-DLR", "2.5/3.2/18.3", "8.00"]
    assert lines[4].split() == ["DLR,", "ours", "10.00/11.00/12.00", "11.00"]
    assert "the deepest of 18 disparities, the largest of 90% of the pixels" in lines[6]
    assert lines[9].split()[-3:] == ["20.0/21.0", "10.0/11.0", "5.0/6.0"]


def test_prints_the_grid(tool: ModuleType, printed: Printed) -> None:
    rows = [
        grid.GridRow(
            "1-to-9",
            3,
            "row 7",
            route,
            "DILS",
            beta,
            ViewFigures(32 + beta, 22 + beta, 0.5 + beta / 10),
            None,
            theirs,
        )
        for route in ("ul", "lr")
        for beta, theirs in zip(BETAS, (0.78, None, 0.76) if route == "lr" else (None,) * 3, strict=True)
    ]
    tool.print_grid(grid.GridTable(tuple(rows), {}))
    lines = printed()
    ours = "32.25 32.50 32.75 - - - 0.525 0.550 0.575"
    assert words(lines[4]) == f"1-to-9 3 row 7 ul DILS {ours} - - - 22.25 22.50 22.75"
    assert words(lines[5]) == f"1-to-9 3 row 7 lr DILS {ours} 0.78 - 0.76 22.25 22.50 22.75"
    assert words(lines[8]) == "DILS 1-to-9: 0.550"


def test_prints_orderings(tool: ModuleType, printed: Printed) -> None:
    there = reasons.Ordering("DILS above LI", "Cones", "0.5 > 0.4", holds=True)
    gone = replace(there, holds=False, figures="0.4 <= 0.5", why="layers are deep")
    tool.print_orderings((there, gone))
    assert [words(line) for line in printed()] == [
        "The thesis's orderings",
        "yes DILS above LI Cones 0.5 > 0.4",
        "NO DILS above LI Cones 0.4 <= 0.5",
        "measured: layers are deep",
        "1 of 2 appear",
    ]


def test_the_tool_finds_the_thesis_from_anywhere(tool: ModuleType) -> None:
    found: Path = tool.TABLES
    assert found.is_absolute()
    assert found == TABLES


def test_the_tool_measures_one_chapter(tmp_path: Path) -> None:
    write_array(tmp_path / "tsukuba", 1, 5, frames=1, disparity_per_step_px=(0.0, 5.0))
    write_array(tmp_path / "cones", 1, 3, frames=1, disparity_per_step_px=(0.0, 5.0))
    triple = {"Tsukuba": [0.1, 0.2, 0.3], "Cones": [0.4, 0.5, 0.6]}
    both = {"psnr": triple, "ssim": triple}
    table: dict[str, object] = {"LI": both, "DILS_SAD": both, "DILS_ADCensus": both}
    tables = tmp_path / "tables.json"
    tables.write_text(json.dumps({"table_4_2_4_3": table | {"beta": [0.25, 0.5, 0.75]}}))
    command = [
        sys.executable,
        str(ROOT / "tools" / "reproduce_thesis.py"),
        "--data",
        ".",
        "--tables",
        tables.name,
    ]
    ended = subprocess.run(
        [*command, "--only", "4"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr == ""  # no progress bar where nobody looks
    assert "Tables 4.2 - 4.5" in ended.stdout
    assert "of 8 appear" in ended.stdout
    assert "Table 5.2" not in ended.stdout
    assert "Tables 6.5" not in ended.stdout


def test_the_tool_names_what_is_missing(tmp_path: Path) -> None:
    command = [sys.executable, "tools/reproduce_thesis.py", "--data", str(tmp_path)]
    tables = tmp_path / "none.json"
    ended = subprocess.run(
        [*command, "--tables", str(tables)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert ended.stderr.startswith("reproduce_thesis: ")
    assert ended.stderr.count("\n") == 1
    assert "none.json" in ended.stderr


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is absent")
def test_the_tool_prints_every_table() -> None:
    command = [sys.executable, "tools/reproduce_thesis.py", "--data", str(DATA), "--tables", str(TABLES)]
    ended = subprocess.run([*command, "--json"], cwd=ROOT, capture_output=True, text=True, check=True)
    document = json.loads(ended.stdout)
    assert {"tables_4_2_to_4_5", "table_5_2", "tables_6_5_to_6_10", "orderings"} <= set(document)
    by_chapter = {name: len(document[name]) for name in ("table_5_2", "tables_6_5_to_6_10")}
    assert by_chapter == {
        "table_5_2": len(maps.PAIRS) * len(maps.METHODS),
        "tables_6_5_to_6_10": len(BETAS) * grid.steps(),
    }
    for ordering in document["orderings"]:
        assert bool(ordering["why"]) != ordering["holds"]
        # A reason states what was measured.
        assert ordering["holds"] or any(character.isdigit() for character in ordering["why"])

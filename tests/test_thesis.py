"""The thesis's tables: small arrays of one's own through the whole of it, orderings, and the real pairs."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_arrays import picture, write_array

from mvcodec.errors import InputError
from mvcodec.evaluation.regions import BadPixels
from mvcodec.evaluation.thesis import grid, maps, pairs
from mvcodec.evaluation.thesis.figures import ThesisTables, ViewFigures
from mvcodec.evaluation.thesis.orderings import find_orderings
from mvcodec.frames import DisparityMap, Picture
from mvcodec.stereo.fixed_window import FixedWindow

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"
TABLES = ROOT.parent / "shared" / "reference" / "thesis_tables.json"


class NoTables(ThesisTables):
    """A thesis whose every figure is 0.5, with the keys that are looked up by name."""

    def __init__(self) -> None:
        pass

    def at(self, *keys: str | int) -> object:
        if keys[-1] == "beta":
            return [0.25, 0.5, 0.75]
        return 0.5


def test_figures_of_a_picture_and_their_mean() -> None:
    black, grey = np.zeros((16, 16, 3), np.uint8), np.full((16, 16, 3), 20, np.uint8)
    same, dark = ViewFigures.measure(grey, grey), ViewFigures.measure(grey, black)
    assert same.psnr_saturated == same.psnr == 100.0
    assert same.ssim == pytest.approx(1.0)
    assert dark.psnr_saturated == pytest.approx(10 * np.log10(255))
    assert dark.psnr == pytest.approx(10 * np.log10(255**2 / 400))
    assert ViewFigures.mean([same, dark]).psnr == pytest.approx((100 + dark.psnr) / 2)


def test_tables_of_the_thesis_are_looked_up_and_missed_by_name(tmp_path: Path) -> None:
    path = tmp_path / "tables.json"
    with pytest.raises(InputError, match=r"tables\.json: found No such file"):
        ThesisTables(path)
    path.write_text("[1]")
    with pytest.raises(InputError, match="no JSON object"):
        ThesisTables(path)
    path.write_text('{"a": {"b": [1, 2]}}')
    tables = ThesisTables(path)
    assert tables.at("a", "b", 1) == 2
    with pytest.raises(InputError, match="no entry a/b/2"):
        tables.at("a", "b", 2)


def test_views_between_two_ends(tmp_path: Path) -> None:
    write_array(tmp_path / "tsukuba", 1, 5, frames=1, disparity_per_step_px=(0.0, 5.0))
    write_array(tmp_path / "cones", 1, 3, frames=1, disparity_per_step_px=(0.0, 5.0))
    table = pairs.measure_pairs(tmp_path, NoTables())
    assert len(table.rows) == (3 + 1) * len(pairs.METHODS)
    assert {row.beta for row in table.rows if row.set_name == "Cones"} == {0.5}
    for row in table.rows:
        assert (row.thesis_ssim is None) == (row.method.endswith("filled") or "level" in row.method)
        assert 0 < row.figures.ssim <= 1
    best = table.mean("Tsukuba", "DILS, SAD, a layer a level")
    assert best.ssim > 0.9
    assert best.ssim > table.mean("Tsukuba", "LI, SAD").ssim
    assert set(table.deepest_px) == {(s, m) for s in pairs.WINDOWS for m in ("SAD", "AD-Census")}


def test_sets_without_a_hint_or_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="tsukuba"):
        pairs.measure_pairs(tmp_path, NoTables())
    write_array(tmp_path / "tsukuba", 1, 5, frames=1)
    with pytest.raises(InputError, match="no disparity_per_step_px"):
        pairs.measure_pairs(tmp_path, NoTables())


def test_views_within_a_cell(tmp_path: Path) -> None:
    write_array(tmp_path / "shop_17x17", 6, 5, frames=1, disparity_per_step_px=(0.0, 4.0))
    table = grid.measure_grid(tmp_path, NoTables(), ["1-to-5"])
    places = {(row.level, row.route) for row in table.rows if row.method == "DILS"}
    assert places == {(1, ""), (2, ""), (3, "ul"), (3, "lr")}
    assert {row.method for row in table.rows} == {method.name for method in grid.METHODS}
    assert {row.beta for row in table.rows} == set(grid.BETAS)
    filled, holes = (table.mean(f"DILS, a layer a level{rest}") for rest in ("", ", holes left"))
    assert filled.ssim > holes.ssim
    assert filled.ssim > 0.85
    by_level = [table.mean("DILS", levels=[level]).ssim for level in grid.LEVELS]
    assert np.mean(by_level) == pytest.approx(table.mean("DILS").ssim, abs=0.05)
    with pytest.raises(InputError, match="6x5 views, expected at least 9x9"):
        grid.measure_grid(tmp_path, NoTables(), ["1-to-9"])


def test_each_pair_is_matched_once() -> None:
    class Counting:
        calls = 0

        def match_pair(
            self, left: Picture, right: Picture, range_px: tuple[float, float]
        ) -> tuple[DisparityMap, DisparityMap]:
            self.calls += 1
            return FixedWindow().match_pair(left, right, range_px)

    counting = Counting()
    matcher = grid.RememberingMatcher(counting)
    views = [picture((0, col), 0) for col in range(3)]
    first = matcher.match_pair(views[0], views[1], (0.0, 4.0))
    again = matcher.match_pair(views[0].copy(), views[1].copy(), (0.0, 4.0))
    assert counting.calls == 1
    assert first[0] is again[0]
    matcher.match_pair(views[0], views[2], (0.0, 4.0))
    matcher.match_pair(views[0], views[1], (0.0, 5.0))
    assert counting.calls == 3


def figures(similarity: float) -> ViewFigures:
    return ViewFigures(30.0, 25.0, similarity)


def made_up_tables() -> tuple[pairs.PairTable, maps.MapTable, grid.GridTable]:
    """Tables in which every ordering of the thesis appears."""
    by_method = {"LI, SAD": 0.4, "LI, SAD, holes filled": 0.5, "DILS, SAD": 0.6, "DILS, AD-Census": 0.7}
    by_method |= {"DILS, SAD, a layer a level": 0.8, "DILS, AD-Census, a layer a level": 0.9}
    pair_rows = [
        pairs.PairRow(name, method, 0.5, figures(ssim), None, None)
        for name in pairs.WINDOWS
        for method, ssim in by_method.items()
    ]
    depths = {(name, kind): 7 for name in pairs.WINDOWS for kind in ("SAD", "AD-Census")}
    shares = {"FW-SAD": 0.2, "SAD-DLR": 0.1, "SSD+MF": 0.2, "ADCensus": 0.05, "SGBM": 0.07}
    map_rows = [
        maps.MapRow(method, pair.name, (BadPixels(share, share, share),) * 3, None)
        for pair in maps.PAIRS
        for method, share in shares.items()
    ]
    grid_rows = [
        grid.GridRow(
            span, level, route, method.name, beta, figures(0.9 - 0.1 * i - 0.05 * (level == 3)), None
        )
        for i, span in enumerate(grid.SPANS)
        for method in grid.METHODS
        for level in method.levels
        for route in (("ul", "lr") if level == 3 else ("",))
        for beta in grid.BETAS
    ]
    lowered = [
        replace(row, figures=figures(row.figures.ssim - 0.3))
        if row.method == "LI" or row.method.endswith("holes left")
        else row
        for row in grid_rows
    ]
    return (
        pairs.PairTable(tuple(pair_rows), depths),
        maps.MapTable(tuple(map_rows)),
        grid.GridTable(tuple(lowered)),
    )


def test_orderings_that_appear_need_no_reason() -> None:
    orderings = find_orderings(*made_up_tables())
    assert all(ordering.holds for ordering in orderings)
    assert not any(ordering.why for ordering in orderings)
    text = " ".join(ordering.statement for ordering in orderings)
    for said in ("DILS above LI", "AD-Census above SAD", "filling above holes", "short above long baseline"):
        assert said in text
    assert "levels 1 and 2 above level 3" in text


def test_orderings_that_do_not_appear_say_so_and_why() -> None:
    pair_table, map_table, grid_table = made_up_tables()
    worse = [
        replace(row, figures=figures(0.3)) if (row.set_name, row.method) == ("Cones", "DILS, SAD") else row
        for row in pair_table.rows
    ]
    raised = [
        replace(row, figures=figures(0.99)) if row.method == "DILS, holes left" else row
        for row in grid_table.rows
    ]
    worst = [
        replace(row, rates=(BadPixels(0.19, 0.19, 0.19),) * 3) if row.method == "SAD-DLR" else row
        for row in map_table.rows
    ]
    orderings = find_orderings(
        replace(pair_table, rows=tuple(worse)), maps.MapTable(tuple(worst)), grid.GridTable(tuple(raised))
    )
    missing = {(ordering.statement, ordering.where): ordering for ordering in orderings if not ordering.holds}
    assert "7 disparities" in missing["DILS above LI", "Cones"].why
    assert ("filling above holes, DILS", "1-to-5") in missing
    assert any(statement.startswith("DLR cuts") for statement, _ in missing)
    assert ("DILS above LI", "Tsukuba") not in missing
    assert all(ordering.why for ordering in missing.values())


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


@pytest.mark.shared_data
@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is absent")
def test_table_5_2_is_near_the_thesis() -> None:
    table = maps.measure_maps(DATA, ThesisTables(TABLES))
    raw = {row.pair: row.bad1 for row in table.of("FW-SAD")}
    printed = json.loads(TABLES.read_text())["table_5_2_bad1_percent"]["FW-SAD"]
    # The same method with the same windows; Venus's search range and the masks differ.
    for first, pair in ((0, "Tsukuba"), (6, "Teddy"), (9, "Cones")):
        assert 100 * raw[pair].non_occluded == pytest.approx(printed[first], abs=3)
        assert 100 * raw[pair].all == pytest.approx(printed[first + 1], abs=3)
        assert 100 * raw[pair].discontinuity == pytest.approx(printed[first + 2], abs=5)
    assert table.average_percent("ADCensus") < table.average_percent("SAD-DLR")
    assert table.average_percent("SAD-DLR") < 0.75 * table.average_percent("FW-SAD")


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is absent")
def test_the_tool_prints_every_table() -> None:
    command = [sys.executable, "tools/reproduce_thesis.py", "--data", str(DATA), "--tables", str(TABLES)]
    ended = subprocess.run([*command, "--json"], cwd=ROOT, capture_output=True, text=True, check=True)
    document = json.loads(ended.stdout)
    assert {"tables_4_2_to_4_5", "table_5_2", "tables_6_5_to_6_10", "orderings"} <= set(document)
    assert all(ordering["holds"] or ordering["why"] for ordering in document["orderings"])

"""What the thesis says of its methods, looked for in made-up tables, and why it is not there."""

from __future__ import annotations

from dataclasses import replace

from thesis import grid, maps, pairs, reasons
from thesis.lines import BETAS, LINES, SPANS
from thesis.orderings import find_orderings
from thesis.thesis_figures import LayerFigures, ViewFigures

from mvcodec.evaluation.regions import BadPixels


def figures(similarity: float) -> ViewFigures:
    return ViewFigures(30.0, 25.0, similarity)


def layers(deepest: int) -> LayerFigures:
    return LayerFigures(2, deepest, 0.9, deepest / 4)


def made_up_tables() -> tuple[pairs.PairTable, maps.MapTable, grid.GridTable]:
    """Tables in which every ordering of the thesis appears."""
    by_method = {"LI, SAD": 0.4, "LI, SAD, holes filled": 0.5, "DILS, SAD": 0.6, "DILS, AD-Census": 0.7}
    by_method |= {"DILS, SAD, a layer a level": 0.8, "DILS, AD-Census, a layer a level": 0.9}
    pair_rows = [
        pairs.PairRow(name, method, 0.5, figures(ssim), None, None)
        for name in pairs.WINDOWS
        for method, ssim in by_method.items()
    ]
    depths = {
        (name, kind, split): layers(deepest)
        for name in pairs.WINDOWS
        for kind in ("SAD", "AD-Census")
        for split, deepest in (("runs", 7), ("levels", 1))
    }
    shares = dict.fromkeys(maps.METHODS, 0.1) | {"FW-SAD": 0.2, "SSD+MF": 0.2, "ADCensus": 0.05}
    map_rows = [
        maps.MapRow(method, pair.name, (BadPixels(share, share, share),) * 3, 0.75, None)
        for pair in maps.PAIRS
        for method, share in shares.items()
    ]
    grid_rows = [
        grid.GridRow(
            line.span,
            line.level,
            line.name,
            route.value if route else "",
            method.name,
            beta,
            figures(0.9 - 0.1 * list(SPANS).index(line.span) - 0.05 * (line.level == 3)),
            None,
            None,
        )
        for line in LINES
        for route in line.routes
        for method in grid.METHODS
        if line.level in method.levels
        for beta in BETAS
    ]
    lowered = [
        replace(row, figures=figures(row.figures.ssim - 0.3))
        if row.method == "LI" or row.method.endswith("holes left")
        else row
        for row in grid_rows
    ]
    cells = {(span, split): layers(n) for span in SPANS for split, n in (("runs", 7), ("levels", 1))}
    return (
        pairs.PairTable(tuple(pair_rows), depths),
        maps.MapTable(tuple(map_rows), {pair.name: layers(7) for pair in maps.PAIRS}),
        grid.GridTable(tuple(lowered), cells),
    )


def test_orderings_that_appear_need_no_reason() -> None:
    orderings = find_orderings(*made_up_tables())
    assert all(ordering.holds for ordering in orderings)
    assert not any(ordering.why for ordering in orderings)
    text = " ".join(ordering.statement for ordering in orderings)
    for said in ("DILS above LI", "AD-Census above SAD", "filling above holes", "short above long baseline"):
        assert said in text
    assert "levels 1 and 2 above level 3" in text


def test_orderings_are_those_of_the_tables_at_hand() -> None:
    pair_table, map_table, grid_table = made_up_tables()
    single = [
        find_orderings(pairs=pair_table),
        find_orderings(maps=map_table),
        find_orderings(grid=grid_table),
    ]
    assert all(single)
    assert sum(single, ()) == find_orderings(pair_table, map_table, grid_table)


def test_orderings_that_do_not_appear_say_what_was_measured() -> None:
    pair_table, map_table, grid_table = made_up_tables()
    worse = [
        replace(row, figures=figures(0.3)) if (row.set_name, row.method) == ("Cones", "DILS, SAD") else row
        for row in pair_table.rows
    ]
    raised = [
        replace(row, figures=replace(figures(0.99), hole_share=0.125))
        if row.method == "DILS, holes left" and row.span == "1-to-5"
        else row
        for row in grid_table.rows
    ]
    worst = [
        replace(row, rates=(BadPixels(0.19, 0.19, 0.25),) * 3) if row.method == maps.THESIS_DLR else row
        for row in map_table.rows
    ]
    orderings = find_orderings(
        replace(pair_table, rows=tuple(worse)),
        replace(map_table, rows=tuple(worst)),
        replace(grid_table, rows=tuple(raised)),
    )
    missing = {
        (ordering.statement, ordering.where): ordering.why for ordering in orderings if not ordering.holds
    }
    steps = maps.THESIS_DLR
    assert set(missing) == {
        ("DILS above LI", "Cones"),
        ("filling above holes, DILS", "1-to-5"),
        (f"{steps}: cuts FW-SAD's bad pixels by 30%", "all pixels, mean of the pairs"),
        (f"{steps} below FW-SAD", "average of table 5.2"),
    }
    layered = missing["DILS above LI", "Cones"]
    assert "holds 7 disparities, and pixels lie 1.75 px" in layered
    assert "with that alone changed it appears (0.800 > 0.400)" in layered
    assert "against 12.5% of the pixels" in missing["filling above holes, DILS", "1-to-5"]
    refined = missing[f"{steps} below FW-SAD", "average of table 5.2"]
    assert "non-occluded 20.0 -> 19.0 %" in refined
    assert "discontinuity 20.0 -> 25.0 %" in refined
    assert "Tsukuba 90%, Venus 90%" in refined
    assert "with a layer a level it helps (10.00 < 20.00 % on average)" in refined


def test_a_cause_needs_a_counter_example() -> None:
    deep, flat = layers(40), layers(1)
    explained = reasons.deep_layers(deep, flat, (figures(0.8), figures(0.7)))
    assert "with that alone changed it appears (0.800 > 0.700)" in explained
    open_still = reasons.deep_layers(deep, flat, (figures(0.7), figures(0.8)))
    assert "does not explain it: with a layer a level 0.700 <= 0.800" in open_still


def test_holes_are_blamed_for_most_of_the_error_only() -> None:
    full = ViewFigures(30.0, 25.0, 0.5, 0.02, 0.6)
    told = reasons.other_measures(full, ViewFigures(31.0, 24.0, 0.6, 0.01, 0.1))
    assert told.startswith("PSNR 25.00 > 24.00, psnr_sat 30.00 <= 31.00")
    assert "2.0% of the pixels with 60% of the squared error" in told
    assert told.endswith("most of the first one's error is in its holes")
    told = reasons.other_measures(replace(full, hole_error_share=0.4), full)
    assert told.endswith("elsewhere, so holes do not explain it")


def test_a_refinement_that_fails_with_fine_layers_too_says_so() -> None:
    _, table, _ = made_up_tables()
    rows = [
        replace(row, rates=(BadPixels(0.3, 0.3, 0.3),) * 3) if row.method == maps.THESIS_DLR_LEVELS else row
        for row in table.rows
    ]
    told = reasons.refinement(replace(table, rows=tuple(rows)), maps.THESIS_DLR)
    assert "nor is that all: a layer a level has 30.00 % on average (FW-SAD 20.00), with 25% of" in told
    assert reasons.refinement(table, maps.OUR_DLR).endswith("which says where and does not explain it")

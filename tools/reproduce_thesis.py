"""Measure the thesis's systems and print them side by side with its own tables.

    python tools/reproduce_thesis.py --data ../shared/data [--only 4 5 6] [--json]

Its "PSNR" is saturated 8-bit arithmetic and compares with the column psnr_sat only; SSIM compares directly. A
dash stands where the thesis has no figure for the same place, method and route. Takes about a minute and a
half on two cores, most of it for chapter 6.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

from thesis import grid, maps, pairs
from thesis.grid import GridRow, GridTable
from thesis.lines import BETAS, SPANS
from thesis.maps import THRESHOLDS_PX, MapTable
from thesis.orderings import find_orderings
from thesis.pairs import PairTable
from thesis.reasons import Ordering
from thesis.thesis_figures import Step, ThesisTables

from mvcodec.cli.progress import progress
from mvcodec.errors import MvCodecError, SettingError

TABLES = Path(__file__).resolve().parents[2] / "shared" / "reference" / "thesis_tables.json"
CHAPTERS = (4, 5, 6)

_Table = TypeVar("_Table", PairTable, MapTable, GridTable)


def print_pairs(table: PairTable) -> None:
    """Tables 4.2 - 4.5."""
    print("Tables 4.2 - 4.5: views between the ends; Teddy and Venus have no original in between here")
    print(
        f"{'':8} {'':33} {'beta':>4}  {'psnr_sat':>8} {'thesis':>6}  {'ssim':>5} {'thesis':>6}  {'psnr':>5}"
    )
    for row in table.rows:
        figures = row.figures
        print(
            f"{row.set_name:8} {row.method:33} {row.beta:4.2f}  {figures.psnr_saturated:8.2f}"
            f" {_shown(row.thesis_psnr, 6, 2)}  {figures.ssim:5.3f} {_shown(row.thesis_ssim, 6, 2)}"
            f"  {figures.psnr:5.2f}"
        )
    for (set_name, map_name, split), layers in table.layers.items():
        if split == "runs":
            print(
                f"{set_name}, {map_name}: layers by the thesis's split: {layers.count}, the deepest of"
                f" {layers.deepest} disparities"
            )
    print()


def print_maps(table: MapTable) -> None:
    """Table 5.2, and the other thresholds."""
    methods = list(dict.fromkeys(row.method for row in table.rows))
    names = list(dict.fromkeys(row.pair for row in table.rows))
    print("Table 5.2: pixels off by more than 1 px, percent, non-occluded / all / near depth edges")
    print(f"{'':39} " + " ".join(f"{name:>18}" for name in names) + f" {'average':>8}")
    for method in methods:
        ours = [
            f"{100 * r.bad1.non_occluded:.2f}/{100 * r.bad1.all:.2f}/{100 * r.bad1.discontinuity:.2f}"
            for r in table.of(method)
        ]
        print(f"{method:39} " + " ".join(f"{o:>18}" for o in ours) + f" {table.average_percent(method):8.2f}")
        theirs = [row.thesis_percent for row in table.of(method)]
        if all(theirs):
            texts = ["/".join(f"{share:g}" for share in triple or ()) for triple in theirs]
            average = sum(share for triple in theirs for share in triple or ()) / (3 * len(theirs))
            name = "  thesis, " + maps.THESIS_ROWS[method]
            print(f"{name:39} " + " ".join(f"{text:>18}" for text in texts) + f" {average:8.2f}")
    print("(the thesis's SSD+MF is the benchmark's own entry, with other settings)")
    for pair, layers in table.layers.items():
        print(
            f"{pair}, FW-SAD: layers by the thesis's split: {layers.count}, the deepest of {layers.deepest}"
            f" disparities, the largest of {layers.largest_share:.0%} of the pixels"
        )
    print("\nNon-occluded / all at " + ", ".join(f"{t:g}" for t in THRESHOLDS_PX) + " px, percent")
    for method in methods:
        cells = [
            " ".join(f"{100 * rate.non_occluded:.1f}/{100 * rate.all:.1f}" for rate in row.rates)
            for row in table.of(method)
        ]
        print(f"{method:39} " + " | ".join(f"{cell:>30}" for cell in cells))
    print()


def print_grid(table: GridTable) -> None:
    """Tables 6.5 - 6.10."""
    betas = ", ".join(f"{beta:g}" for beta in BETAS)
    print(
        "Tables 6.5 - 6.10: shop_17x17 beside the thesis's Lego, the same rows and columns, counted from 1,"
    )
    print(f"at beta {betas} between the cameras. The thesis's level 3 goes by lr; its third items of 1-to-9")
    print("are of row or column 9, where a camera stands, and have no counterpart; nor has 1-to-17, ours.")
    header = f"{'psnr_sat':^17}  {'thesis':^17}  {'ssim':^17}  {'thesis':^14}  {'psnr':^17}"
    print(f"{'':8} {'level':22} {'':37} {header}")
    places = dict.fromkeys((row.span, row.level, row.line, row.route, row.method) for row in table.rows)
    for place in places:
        span, level, line, route, method = place
        rows = [r for r in table.rows if (r.span, r.level, r.line, r.route, r.method) == place]
        print(f"{span:8} {level} {line:9} {route:10} {method:37} {_three_betas(rows)}")
    print("\nMean SSIM of levels 1, 2, 3")
    spans = [span for span in SPANS if any(row.span == span for row in table.rows)]
    for method in dict.fromkeys(row.method for row in table.rows):
        levels = sorted({row.level for row in table.rows if row.method == method})
        cells = [
            " ".join(f"{table.mean(method, [span], [level]).ssim:.3f}" for level in levels) for span in spans
        ]
        print(f"  {method:37} " + "   ".join(f"{s}: {c:17}" for s, c in zip(spans, cells, strict=True)))
    print()


def _three_betas(rows: list[GridRow]) -> str:
    columns = (
        [f"{row.figures.psnr_saturated:5.2f}" for row in rows],
        [_shown(row.thesis_psnr, 5, 2) for row in rows],
        [f"{row.figures.ssim:5.3f}" for row in rows],
        [_shown(row.thesis_ssim, 4, 2) for row in rows],
        [f"{row.figures.psnr:5.2f}" for row in rows],
    )
    return "  ".join(" ".join(cells) for cells in columns)


def print_orderings(orderings: tuple[Ordering, ...]) -> None:
    """What the thesis's tables say, and whether ours say so too."""
    print("The thesis's orderings")
    for ordering in orderings:
        print(
            f"  {'yes' if ordering.holds else 'NO':3} {ordering.statement:55} {ordering.where:30}"
            f" {ordering.figures}" + (f"\n      measured: {ordering.why}" if ordering.why else "")
        )
    missing = sum(not ordering.holds for ordering in orderings)
    print(f"  {len(orderings) - missing} of {len(orderings)} appear")


def pairs_to_json(table: PairTable) -> dict[str, object]:
    """The form of ``--json``."""
    layers = [
        {"set_name": set_name, "map": map_name, "split": split, **asdict(figures)}
        for (set_name, map_name, split), figures in table.layers.items()
    ]
    return {"tables_4_2_to_4_5": [asdict(row) for row in table.rows], "layers_4": layers}


def maps_to_json(table: MapTable) -> dict[str, object]:
    """The form of ``--json``."""
    rows = [
        {
            "method": row.method,
            "pair": row.pair,
            "own_share": row.own_share,
            "thesis_percent": row.thesis_percent,
            "percent": {
                f"{threshold:g}": {name: 100 * share for name, share in asdict(rate).items()}
                for threshold, rate in zip(THRESHOLDS_PX, row.rates, strict=True)
            },
        }
        for row in table.rows
    ]
    layers = [{"pair": pair, **asdict(figures)} for pair, figures in table.layers.items()]
    return {"table_5_2": rows, "layers_5": layers}


def grid_to_json(table: GridTable) -> dict[str, object]:
    """The form of ``--json``."""
    layers = [
        {"span": span, "split": split, **asdict(figures)} for (span, split), figures in table.layers.items()
    ]
    return {"tables_6_5_to_6_10": [asdict(row) for row in table.rows], "layers_6": layers}


def _shown(value: float | None, width: int, digits: int) -> str:
    return f"{'-':>{width}}" if value is None else f"{value:{width}.{digits}f}"


def watched(chapter: int, total: int, measure: Callable[[Step], _Table]) -> _Table:
    """Measure, with a progress bar."""
    with progress(f"chapter {chapter}", total, unit="measurement") as bar:
        return measure(bar.update)


def run(arguments: argparse.Namespace) -> dict[str, object]:
    """Measure the chapters that are wanted, and print each table as it is ready; returns the document."""
    thesis, data = ThesisTables(arguments.tables), arguments.data
    pair_table = map_table = grid_table = None
    document: dict[str, object] = {}
    if 4 in arguments.only:
        pair_table = watched(4, pairs.STEPS, lambda step: pairs.measure_pairs(data, thesis, step))
        document |= pairs_to_json(pair_table)
        if not arguments.json:
            print_pairs(pair_table)
    if 5 in arguments.only:
        map_table = watched(5, maps.STEPS, lambda step: maps.measure_maps(data, thesis, step))
        document |= maps_to_json(map_table)
        if not arguments.json:
            print_maps(map_table)
    if 6 in arguments.only:
        grid_table = watched(6, grid.steps(), lambda step: grid.measure_grid(data, thesis, step=step))
        document |= grid_to_json(grid_table)
        if not arguments.json:
            print_grid(grid_table)
    orderings = find_orderings(pair_table, map_table, grid_table)
    document["orderings"] = [asdict(ordering) for ordering in orderings]
    if not arguments.json:
        print_orderings(orderings)
    return document


def main() -> int:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--data", type=Path, required=True, metavar="DIR")
    parser.add_argument("--tables", type=Path, default=TABLES, metavar="FILE", help="default: %(default)s")
    parser.add_argument(
        "--only", type=int, nargs="+", choices=CHAPTERS, default=CHAPTERS, help="chapters (default: all)"
    )
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # a table is seen when it is ready
    started = time.perf_counter()
    try:
        document = run(arguments)
    except MvCodecError as error:
        print(f"reproduce_thesis: {error}", file=sys.stderr)
        return 2 if isinstance(error, SettingError) else 1
    if arguments.json:
        print(json.dumps(document, indent=2))
    else:
        print(f"\n{time.perf_counter() - started:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Measure the thesis's systems and print them side by side with its own tables.

    python tools/reproduce_thesis.py --data ../shared/data [--json]

Its "PSNR" is saturated 8-bit arithmetic and compares with the column psnr_sat only; SSIM compares directly.
Takes about a minute and a half on two cores, most of it for the grid.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path

from mvcodec.errors import MvCodecError, SettingError
from mvcodec.evaluation.thesis.figures import ThesisTables
from mvcodec.evaluation.thesis.grid import BETAS, SPANS, GridRow, GridTable, measure_grid
from mvcodec.evaluation.thesis.maps import METHODS as MAP_METHODS
from mvcodec.evaluation.thesis.maps import PAIRS, THRESHOLDS_PX, MapTable, measure_maps
from mvcodec.evaluation.thesis.orderings import Ordering, find_orderings
from mvcodec.evaluation.thesis.pairs import PairTable, measure_pairs

TABLES = Path("../shared/reference/thesis_tables.json")


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
    for (set_name, map_name), depth in table.deepest_px.items():
        print(f"{set_name}, {map_name}: the deepest layer of the thesis's split holds {depth} disparities")
    print()


def print_maps(table: MapTable) -> None:
    """Table 5.2, and the other thresholds."""
    names = [pair.name for pair in PAIRS]
    print("Table 5.2: pixels off by more than 1 px, percent, non-occluded / all / near depth edges")
    print(f"{'':14} " + " ".join(f"{name:>18}" for name in names) + f" {'average':>8}")
    for method in MAP_METHODS:
        ours = [
            f"{100 * r.bad1.non_occluded:.2f}/{100 * r.bad1.all:.2f}/{100 * r.bad1.discontinuity:.2f}"
            for r in table.of(method)
        ]
        print(f"{method:14} " + " ".join(f"{o:>18}" for o in ours) + f" {table.average_percent(method):8.2f}")
        theirs = [row.thesis_percent for row in table.of(method)]
        if all(theirs):
            texts = ["/".join(f"{share:g}" for share in triple or ()) for triple in theirs]
            average = sum(share for triple in theirs for share in triple or ()) / (3 * len(theirs))
            print(f"{'  thesis':14} " + " ".join(f"{text:>18}" for text in texts) + f" {average:8.2f}")
    print("(the thesis's SSD+MF is the benchmark's own entry, with other settings)")
    print("\nNon-occluded / all at " + ", ".join(f"{t:g}" for t in THRESHOLDS_PX) + " px, percent")
    for method in MAP_METHODS:
        cells = [
            " ".join(f"{100 * rate.non_occluded:.1f}/{100 * rate.all:.1f}" for rate in row.rates)
            for row in table.of(method)
        ]
        print(f"{method:14} " + " | ".join(f"{cell:>30}" for cell in cells))
    print()


def print_grid(table: GridTable) -> None:
    """Tables 6.5 - 6.10."""
    betas = ", ".join(f"{beta:g}" for beta in BETAS)
    print(
        "Tables 6.5 - 6.10: within the upper left cell of shop_17x17 (the thesis: Lego), mean of two rows or"
    )
    print(f"columns, at beta {betas}")
    header = f"{'psnr_sat':^17}  {'ssim':^17}  {'thesis ssim':^14}  {'psnr':^17}"
    print(f"{'':8} {'level':6} {'':37} {header}")
    places = dict.fromkeys((row.span, row.level, row.route, row.method) for row in table.rows)
    for span, level, route, method in places:
        rows = [r for r in table.rows if (r.span, r.level, r.route, r.method) == (span, level, route, method)]
        print(f"{span:8} {level} {route:4} {method:37} {_three_betas(rows)}")
    print("\nMean SSIM of levels 1, 2, 3")
    for method in dict.fromkeys(row.method for row in table.rows):
        levels = sorted({row.level for row in table.rows if row.method == method})
        cells = [
            " ".join(f"{table.mean(method, [span], [level]).ssim:.3f}" for level in levels) for span in SPANS
        ]
        print(f"  {method:37} " + "   ".join(f"{s}: {c:17}" for s, c in zip(SPANS, cells, strict=True)))
    print()


def _three_betas(rows: list[GridRow]) -> str:
    columns = (
        [f"{row.figures.psnr_saturated:5.2f}" for row in rows],
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
            f"  {'yes' if ordering.holds else 'NO':3} {ordering.statement:52} {ordering.where:30}"
            f" {ordering.figures}" + (f"\n      because {ordering.why}" if ordering.why else "")
        )
    missing = sum(not ordering.holds for ordering in orderings)
    print(f"  {len(orderings) - missing} of {len(orderings)} appear")


def to_json(
    pairs: PairTable, maps: MapTable, grid: GridTable, orderings: tuple[Ordering, ...]
) -> dict[str, object]:
    """The form of ``--json``."""
    return {
        "tables_4_2_to_4_5": [asdict(row) for row in pairs.rows],
        "deepest_layer": [
            {"set_name": set_name, "map": map_name, "disparities": depth}
            for (set_name, map_name), depth in pairs.deepest_px.items()
        ],
        "table_5_2": [
            {
                "method": row.method,
                "pair": row.pair,
                "thesis_percent": row.thesis_percent,
                "percent": {
                    f"{threshold:g}": {name: 100 * share for name, share in asdict(rate).items()}
                    for threshold, rate in zip(THRESHOLDS_PX, row.rates, strict=True)
                },
            }
            for row in maps.rows
        ],
        "tables_6_5_to_6_10": [asdict(row) for row in grid.rows],
        "orderings": [asdict(ordering) for ordering in orderings],
    }


def _shown(value: float | None, width: int, digits: int) -> str:
    return f"{'-':>{width}}" if value is None else f"{value:{width}.{digits}f}"


def main() -> int:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--data", type=Path, required=True, metavar="DIR")
    parser.add_argument("--tables", type=Path, default=TABLES, metavar="FILE", help="default: %(default)s")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    started = time.perf_counter()
    try:
        thesis = ThesisTables(arguments.tables)
        pairs = measure_pairs(arguments.data, thesis)
        maps = measure_maps(arguments.data, thesis)
        grid = measure_grid(arguments.data, thesis)
    except MvCodecError as error:
        print(f"reproduce_thesis: {error}", file=sys.stderr)
        return 2 if isinstance(error, SettingError) else 1
    orderings = find_orderings(pairs, maps, grid)
    if arguments.json:
        print(json.dumps(to_json(pairs, maps, grid, orderings), indent=2))
        return 0
    print_pairs(pairs)
    print_maps(maps)
    print_grid(grid)
    print_orderings(orderings)
    print(f"\n{time.perf_counter() - started:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""What the thesis's tables say of its methods, looked for in ours."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from statistics import fmean

from thesis import reasons
from thesis.grid import GridTable
from thesis.lines import SPANS
from thesis.maps import OUR_DLR, PAIRS, RAW, THESIS_DLR, MapTable
from thesis.pairs import WINDOWS, PairTable
from thesis.reasons import Ordering
from thesis.thesis_figures import ViewFigures

LEAST_DLR_CUT = 0.3
ALIKE_SSIM = 0.03
_LEVELWISE = ", a layer a level"


def find_orderings(
    pairs: PairTable | None = None, maps: MapTable | None = None, grid: GridTable | None = None
) -> tuple[Ordering, ...]:
    """Every ordering of the thesis, by SSIM (pictures) or share of bad pixels (maps), of the tables given."""
    return (
        *(_of_pairs(pairs) if pairs else ()),
        *(_of_maps(maps) if maps else ()),
        *(_of_grid(grid) if grid else ()),
    )


def _of_pairs(table: PairTable) -> Iterator[Ordering]:
    for name in WINDOWS:
        line, sad, census = (
            table.mean(name, method) for method in ("LI, SAD", "DILS, SAD", "DILS, AD-Census")
        )
        fine_sad, fine_census = (
            table.mean(name, method + _LEVELWISE) for method in ("DILS, SAD", "DILS, AD-Census")
        )
        layers = {key[1:]: figures for key, figures in table.layers.items() if key[0] == name}
        yield _above(
            "DILS above LI",
            name,
            sad,
            line,
            reasons.deep_layers(layers["SAD", "runs"], layers["SAD", "levels"], (fine_sad, line)),
        )
        yield _above(
            "AD-Census above SAD in DILS",
            name,
            census,
            sad,
            reasons.deep_layers(
                layers["AD-Census", "runs"], layers["AD-Census", "levels"], (fine_census, fine_sad)
            ),
        )
        yield _above(f"DILS{_LEVELWISE} above LI", name, fine_sad, line)
        yield _above(f"AD-Census above SAD in DILS{_LEVELWISE}", name, fine_census, fine_sad)


def _of_maps(table: MapTable) -> Iterator[Ordering]:
    for method in (THESIS_DLR, OUR_DLR):
        raw, refined = table.of(RAW), table.of(method)
        cuts = [1 - after.bad1.all / before.bad1.all for before, after in zip(raw, refined, strict=True)]
        texts = ", ".join(f"{pair.name} {cut:.0%}" for pair, cut in zip(PAIRS, cuts, strict=True))
        holds = fmean(cuts) >= LEAST_DLR_CUT
        yield Ordering(
            f"{method}: cuts FW-SAD's bad pixels by {LEAST_DLR_CUT:.0%}",
            "all pixels, mean of the pairs",
            f"{fmean(cuts):.1%} ({texts})",
            holds,
            "" if holds else reasons.refinement(table, method),
        )
        for better, worse in ((method, RAW), ("ADCensus", method)):
            first, second = table.average_percent(better), table.average_percent(worse)
            below = round(first, 1) < round(second, 1)  # the thesis's table has one decimal
            yield Ordering(
                f"{better} below {worse}",
                "average of table 5.2",
                f"{first:.2f}, {second:.2f} %",
                below,
                "" if below else reasons.refinement(table, method),
            )


def _of_grid(table: GridTable) -> Iterator[Ordering]:
    for splits in ("", _LEVELWISE):
        dils = "DILS" + splits
        for span in SPANS:
            yield from _of_span(table, dils, span)
        for short, long in pairwise(SPANS):
            yield _above(
                f"short above long baseline, {dils}",
                f"{short}, {long}",
                table.mean(dils, [short]),
                table.mean(dils, [long]),
            )


def _of_span(table: GridTable, dils: str, span: str) -> Iterator[Ordering]:
    line, ours, finer = (table.mean(name, [span], (1, 2)) for name in ("LI", dils, "DILS" + _LEVELWISE))
    deep = reasons.deep_layers(table.layers[span, "runs"], table.layers[span, "levels"], (finer, line))
    where = f"{span}, levels 1 and 2"
    yield _above(f"{dils} above LI", where, ours, line, deep if dils == "DILS" else "")
    filled, holes = table.mean(dils, [span]), table.mean(f"{dils}, holes left", [span])
    yield _above(f"filling above holes, {dils}", span, filled, holes)
    lower = min((table.mean(dils, [span], [level]) for level in (1, 2)), key=lambda figures: figures.ssim)
    yield _above(f"levels 1 and 2 above level 3, {dils}", span, lower, table.mean(dils, [span], [3]))
    routes = [table.mean(dils, [span], [3], route) for route in ("ul", "lr")]
    alike = abs(routes[0].ssim - routes[1].ssim) <= ALIKE_SSIM
    yield Ordering(
        f"routes UL and LR alike, {dils}",
        f"{span}, level 3",
        f"{routes[0].ssim:.3f}, {routes[1].ssim:.3f}",
        alike,
        "" if alike else reasons.other_measures(*routes),
    )


def _above(
    statement: str, where: str, first: ViewFigures, second: ViewFigures, special: str = ""
) -> Ordering:
    """`first` has the higher SSIM; where not, `special` says why, and what else was measured."""
    holds = first.ssim > second.ssim
    figures = f"{first.ssim:.3f} {'>' if holds else '<='} {second.ssim:.3f}"
    if holds:
        return Ordering(statement, where, figures, holds)
    told = (
        [special, reasons.other_measures(first, second)]
        if special
        else [reasons.other_measures(first, second)]
    )
    return Ordering(statement, where, figures, holds, "; ".join(told))

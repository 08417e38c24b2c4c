"""What the thesis's tables say of its methods, looked for in ours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean

from mvcodec.evaluation.thesis.grid import SPANS, GridTable
from mvcodec.evaluation.thesis.maps import PAIRS, MapTable
from mvcodec.evaluation.thesis.pairs import WINDOWS, PairTable

LEAST_DLR_CUT = 0.3
ALIKE_SSIM = 0.03
UNEXPLAINED = "nothing that was measured here explains it"
_LEVELWISE = ", a layer a level"


@dataclass(frozen=True, slots=True)
class Ordering:
    """One statement and what was found.

    Attributes:
        statement: what the thesis has.
        where: set, span or mean that it was looked for in.
        figures: what was compared.
        holds: whether it appears.
        why: where it does not appear, what keeps it from appearing.
    """

    statement: str
    where: str
    figures: str
    holds: bool
    why: str = ""


def find_orderings(pairs: PairTable, maps: MapTable, grid: GridTable) -> tuple[Ordering, ...]:
    """Every ordering of the thesis, by SSIM (pictures) or share of bad pixels (maps)."""
    return (*_of_pairs(pairs), *_of_maps(maps), *_of_grid(grid))


def _of_pairs(table: PairTable) -> Iterator[Ordering]:
    for set_name in WINDOWS:

        def ssim(method: str, set_name: str = set_name) -> float:
            return table.mean(set_name, method).ssim

        for splits in ("", _LEVELWISE):
            dils, census = ssim("DILS, SAD" + splits), ssim("DILS, AD-Census" + splits)
            depth = table.deepest_px[set_name, "SAD"]
            finer = ssim("DILS, SAD" + _LEVELWISE)
            yield _above(
                f"DILS{splits} above LI",
                set_name,
                dils,
                ssim("LI, SAD"),
                f"runs of the histogram merge: the deepest layer holds {depth} disparities, and one shift"
                f" serves them all; a layer a level has {finer:.3f}",
            )
            deepest = table.deepest_px[set_name, "AD-Census"]
            finer = ssim("DILS, AD-Census" + _LEVELWISE)
            yield _above(
                f"AD-Census above SAD in DILS{splits}",
                set_name,
                census,
                dils,
                f"a better map makes longer runs: layers of up to {deepest} disparities (SAD: {depth}) hide"
                f" its gain; a layer a level has {finer:.3f}",
            )


def _of_maps(table: MapTable) -> Iterator[Ordering]:
    raw, refined = table.of("FW-SAD"), table.of("SAD-DLR")
    cuts = [1 - after.bad1.all / before.bad1.all for before, after in zip(raw, refined, strict=True)]
    texts = ", ".join(f"{pair.name} {cut:.0%}" for pair, cut in zip(PAIRS, cuts, strict=True))
    yield Ordering(
        f"DLR cuts FW-SAD's bad pixels by {LEAST_DLR_CUT:.0%}",
        "all pixels, mean of the pairs",
        f"{fmean(cuts):.1%} ({texts})",
        holds := fmean(cuts) >= LEAST_DLR_CUT,
        "" if holds else UNEXPLAINED,
    )
    for better, worse in pairwise(("ADCensus", "SAD-DLR", "FW-SAD")):
        first, second = table.average_percent(better), table.average_percent(worse)
        yield Ordering(
            f"{better} below {worse}",
            "average of table 5.2",
            f"{first:.2f}, {second:.2f} %",
            first < second,
            "" if first < second else UNEXPLAINED,
        )


def _of_grid(table: GridTable) -> Iterator[Ordering]:
    for splits in ("", _LEVELWISE):
        dils = "DILS" + splits
        for span in SPANS:

            def ssim(method: str, *levels: int, span: str = span) -> float:
                return table.mean(method, [span], levels or (1, 2, 3)).ssim

            finer = ssim("DILS" + _LEVELWISE, 1, 2)
            yield _above(
                f"{dils} above LI",
                f"{span}, levels 1 and 2",
                ssim(dils, 1, 2),
                ssim("LI", 1, 2),
                f"runs of the histogram merge into deep layers, and one shift serves each; a layer a level"
                f" has {finer:.3f}",
            )
            yield _above(f"filling above holes, {dils}", span, ssim(dils), ssim(f"{dils}, holes left"))
            low = min(ssim(dils, 1), ssim(dils, 2))
            yield _above(f"levels 1 and 2 above level 3, {dils}", span, low, ssim(dils, 3))
            routes = [
                fmean(
                    r.figures.ssim for r in table.rows if (r.method, r.span, r.route) == (dils, span, route)
                )
                for route in ("ul", "lr")
            ]
            yield Ordering(
                f"routes UL and LR alike, {dils}",
                f"{span}, level 3",
                f"{routes[0]:.3f}, {routes[1]:.3f}",
                alike := abs(routes[0] - routes[1]) <= ALIKE_SSIM,
                "" if alike else UNEXPLAINED,
            )
        for short, long in pairwise(SPANS):
            yield _above(
                f"short above long baseline, {dils}",
                f"{short}, {long}",
                table.mean(dils, [short]).ssim,
                table.mean(dils, [long]).ssim,
            )


def _above(statement: str, where: str, first: float, second: float, why: str = UNEXPLAINED) -> Ordering:
    holds = first > second
    return Ordering(
        statement, where, f"{first:.3f} {'>' if holds else '<='} {second:.3f}", holds, "" if holds else why
    )

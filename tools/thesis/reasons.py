"""Why an ordering of the thesis does not appear in our tables, from what the same run measured.

A cause is named only where the run has the counter-example: the same pictures and maps with that one thing
changed, and the ordering is there. Otherwise it is said what was measured and that it does not explain it.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import fmean

from thesis.maps import PAIRS, RAW, THESIS_DLR, THESIS_DLR_LEVELS, MapTable
from thesis.thesis_figures import LayerFigures, ViewFigures

_MOST = 0.5


@dataclass(frozen=True, slots=True)
class Ordering:
    """One statement and what was found.

    Attributes:
        statement: what the thesis has.
        where: set, span or mean that it was looked for in.
        figures: what was compared.
        holds: whether it appears.
        why: where it does not appear, what was measured, and whether that explains it.
    """

    statement: str
    where: str
    figures: str
    holds: bool
    why: str = ""


def deep_layers(
    runs: LayerFigures, levels: LayerFigures, with_levels: tuple[ViewFigures, ViewFigures]
) -> str:
    """Whether the depth of the layers keeps a view of DILS from being the better one.

    Args:
        runs, levels: layers of the map, by the thesis's split and with a layer a level.
        with_levels: the two that are compared, with a layer a level wherever there are layers.
    """
    first, second = (figures.ssim for figures in with_levels)
    measured = (
        f"the deepest layer ({runs.count} in all) holds {runs.deepest} disparities, and pixels lie"
        f" {runs.shift_error_px:.2f} px from the one that their layer is moved by"
        f" ({levels.shift_error_px:.2f} with a layer a level)"
    )
    if first > second:
        return f"{measured}; with that alone changed it appears ({first:.3f} > {second:.3f})"
    return f"{measured}, which does not explain it: with a layer a level {first:.3f} <= {second:.3f}"


def other_measures(first: ViewFigures, second: ViewFigures) -> str:
    """What PSNR says of two views whose SSIM is not as expected, and how much of their error is in holes."""
    by_psnr = [
        f"{name} {ours:.2f} {'>' if ours > theirs else '<='} {theirs:.2f}"
        for name, ours, theirs in (
            ("PSNR", first.psnr, second.psnr),
            ("psnr_sat", first.psnr_saturated, second.psnr_saturated),
        )
    ]
    holes = [
        f"{figures.hole_share:.1%} of the pixels with {figures.hole_error_share:.0%} of the squared error"
        for figures in (first, second)
    ]
    if first.hole_error_share > _MOST:
        verdict = "most of the first one's error is in its holes"
    else:
        verdict = "most of the first one's error is elsewhere, so holes do not explain it"
    return f"{', '.join(by_psnr)}; holes: {holes[0]}, against {holes[1]}: {verdict}"


def refinement(table: MapTable, method: str) -> str:
    """Where a refinement of FW-SAD's maps falls short, by region, and what its layers leave it to work on."""
    cuts = []
    for region in ("non_occluded", "all", "discontinuity"):
        raw, refined = (fmean(getattr(row.bad1, region) for row in table.of(name)) for name in (RAW, method))
        cuts.append(f"{region.replace('_', '-')} {100 * raw:.1f} -> {100 * refined:.1f} %")
    regions = f"bad pixels, mean of the pairs: {', '.join(cuts)}"
    if method != THESIS_DLR:
        return f"{regions}, which says where and does not explain it"
    largest = ", ".join(f"{pair.name} {table.layers[pair.name].largest_share:.0%}" for pair in PAIRS)
    deepest = ", ".join(f"{table.layers[pair.name].deepest}" for pair in PAIRS)
    raw, finer = table.average_percent(RAW), table.average_percent(THESIS_DLR_LEVELS)
    own = fmean(row.own_share for row in table.of(THESIS_DLR_LEVELS))
    measured = (
        f"{regions}; the largest layer of the thesis's split holds {largest} of the pixels (up to {deepest}"
        " disparities deep), and inside of one layer nothing is refined"
    )
    if finer < raw:
        return f"{measured}; with a layer a level it helps ({finer:.2f} < {raw:.2f} % on average)"
    return (
        f"{measured}; nor is that all: a layer a level has {finer:.2f} % on average (FW-SAD {raw:.2f}), with"
        f" {1 - own:.0%} of the pixels beyond their layer's edges or under a nearer layer, and filled"
    )

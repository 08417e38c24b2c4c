"""How far two rate-distortion curves lie apart: Bjontegaard's deltas, and where one overtakes the other.

Bjontegaard (VCEG-M33) with piecewise cubics (PCHIP) over the logarithm of the rate, by the library
`bjontegaard`; only where the curves have quality (BD-rate) or rate (BD-PSNR) in common.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

METHOD = "pchip"

SHORT_SHARE = 0.5
"""A common range below this share of what both curves span is called short."""

FEW_POINTS = 4
_STEPS = 4001

RatePoint = tuple[float, float]
"""(kbit/s, dB)."""


@dataclass(frozen=True, slots=True)
class CurveDelta:
    """A tested curve against an anchor's; None where the curves have no range in common.

    Attributes:
        rate_percent: BD-rate: what the tested curve's bits differ by at equal quality; negative is
            better.
        psnr_db: BD-PSNR: what its quality differs by at equal rate; positive is better.
        overlap_db: (lo, hi), the quality that both reach: where rate_percent holds.
        warnings: what a reader of the figures must know.
    """

    rate_percent: float | None
    psnr_db: float | None
    overlap_db: tuple[float, float] | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Overtaking:
    """The rate from which on an anchor stays better, to the end of the rates that were compared.

    Attributes:
        kbps, psnr_y: the last crossing, or where the comparison begins.
        at_most: the anchor is better at every compared rate: it overtakes here or below.
    """

    kbps: float
    psnr_y: float
    at_most: bool


@dataclass(frozen=True, slots=True)
class AnchorLead:
    """Where an anchor is better than the tested curve.

    Attributes:
        ranges_kbps: every (from, to) of rates in which it is, ascending.
        overtaking: the beginning of the last of them, if that one goes on to the end of the compared
            rates; else None.
    """

    ranges_kbps: tuple[tuple[float, float], ...]
    overtaking: Overtaking | None


def hull(points: Sequence[RatePoint]) -> list[RatePoint]:
    """The points that no mixture of two others beats, dB over the logarithm of the rate; ascending."""
    kept: list[RatePoint] = []
    for point in front(points):
        while len(kept) > 1 and _slope(kept[-2], point) >= _slope(kept[-2], kept[-1]):
            kept.pop()
        kept.append(point)
    return kept


def _slope(one: RatePoint, other: RatePoint) -> float:
    """dB for each e-fold of the rate."""
    return (other[1] - one[1]) / float(np.log(other[0] / one[0]))


def compare_curves(anchor: Sequence[RatePoint], tested: Sequence[RatePoint]) -> CurveDelta:
    """Bjontegaard's deltas of a tested curve.

    A curve is made monotonic first: a point that costs more than another and is no better is left
    out (`curve_warnings` says so).
    """
    warnings: list[str] = []
    fronts = front(anchor), front(tested)
    if min(map(len, fronts)) < 2:
        return CurveDelta(None, None, None, ("fewer than two points: no figures",))
    (rate_a, db_a), (rate_t, db_t) = (np.array(points).T for points in fronts)
    overlap = _common(db_a, db_t)
    if overlap is None:
        warnings.append("no quality in common: no BD-rate")
    elif (
        share := (overlap[1] - overlap[0]) / (max(db_a[-1], db_t[-1]) - min(db_a[0], db_t[0]))
    ) < SHORT_SHARE:
        warnings.append(
            f"short overlap: {overlap[0]:.2f} to {overlap[1]:.2f} dB, {share:.0%} of what both curves span"
        )
    # The library loads pyplot, half a second: on use.
    from bjontegaard import bd_psnr, bd_rate

    options = {"method": METHOD, "require_matching_points": False, "min_overlap": 0}
    percent = None if overlap is None else float(bd_rate(rate_a, db_a, rate_t, db_t, **options))
    common_rate = _common(np.log10(rate_a), np.log10(rate_t))
    if common_rate is None:
        warnings.append("no rate in common: no BD-PSNR")
    decibel = None if common_rate is None else float(bd_psnr(rate_a, db_a, rate_t, db_t, **options))
    return CurveDelta(percent, decibel, overlap, tuple(warnings))


def curve_warnings(curve: Sequence[RatePoint]) -> list[str]:
    """What makes a curve a weak ground for figures."""
    warnings = []
    left_out = len(curve) - len(front(curve))
    if left_out:
        warnings.append(f"not monotonic: {left_out} of {len(curve)} points are left out of BD figures")
    if len(curve) < FEW_POINTS:
        warnings.append(f"a curve of {len(curve)} points; {FEW_POINTS} or more are usual")
    return warnings


def anchor_lead(anchor: Sequence[RatePoint], tested: Sequence[RatePoint]) -> AnchorLead:
    """Where an anchor is better than the tested curve.

    They are compared from the lowest rate that both have to the anchor's highest. Above its highest rate
    a curve counts as flat: its last point fits into more bits, too. So an anchor that ends below the
    tested curve's lowest rate is compared over the whole of that curve.
    """
    ours, theirs = front(tested), front(anchor)
    if not ours or not theirs:
        return AnchorLead((), None)
    low = max(ours[0][0], theirs[0][0])
    high = (theirs if theirs[-1][0] >= ours[0][0] else ours)[-1][0]
    rates = np.geomspace(low, high, _STEPS) if high > low else np.array([low])
    quality = _quality(theirs, rates)
    ahead = quality > _quality(ours, rates)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], ahead, [False]))))
    starts, ends = edges[::2], edges[1::2]
    ranges = tuple((float(rates[s]), float(rates[e - 1])) for s, e in zip(starts, ends, strict=True))
    if not ahead[-1]:
        return AnchorLead(ranges, None)
    start = int(starts[-1])
    return AnchorLead(ranges, Overtaking(float(rates[start]), float(quality[start]), start == 0))


def front(curve: Sequence[RatePoint]) -> list[RatePoint]:
    """The points that no other one beats in rate and quality, by rising rate."""
    kept: list[RatePoint] = []
    for rate, decibel in sorted(curve, key=lambda point: (point[0], -point[1])):
        if not kept or decibel > kept[-1][1]:
            kept.append((rate, decibel))
    return kept


def _quality(curve: Sequence[RatePoint], rates: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.interpolate import PchipInterpolator

    rate, decibel = np.array(curve).T
    if len(curve) == 1:
        return np.full(rates.shape, decibel[0])
    inside = np.clip(rates, rate[0], rate[-1])
    return np.asarray(PchipInterpolator(np.log10(rate), decibel)(np.log10(inside)), np.float64)


def _common(a: NDArray[np.float64], b: NDArray[np.float64]) -> tuple[float, float] | None:
    low, high = float(max(a[0], b[0])), float(min(a[-1], b[-1]))
    return (low, high) if low < high else None

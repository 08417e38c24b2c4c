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
    """Where an anchor begins to be better.

    Attributes:
        kbps, psnr_y: the crossing.
        at_most: the anchor is better wherever both were measured; it overtakes here or below.
    """

    kbps: float
    psnr_y: float
    at_most: bool


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


def overtaking(anchor: Sequence[RatePoint], tested: Sequence[RatePoint]) -> Overtaking | None:
    """The lowest rate from which an anchor is better than the tested curve; None if it never is.

    Above its highest rate the tested curve counts as flat: its last point fits into more bits, too.
    """
    ours, theirs = front(tested), front(anchor)
    if not ours or not theirs or theirs[-1][0] < ours[0][0]:
        return None
    low, high = max(ours[0][0], theirs[0][0]), theirs[-1][0]
    rates = np.geomspace(low, high, _STEPS) if high > low else np.array([low])
    ahead = _quality(theirs, rates) > _quality(ours, rates)
    if not ahead.any():
        return None
    first = int(ahead.argmax())
    return Overtaking(float(rates[first]), float(_quality(theirs, rates[first : first + 1])[0]), first == 0)


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

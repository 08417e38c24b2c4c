"""Distances of rate-distortion curves, against curves whose distance is known."""

from __future__ import annotations

import math

import pytest

from mvcodec.evaluation.bd import RatePoint, anchor_lead, compare_curves, curve_warnings, front, hull

RATES = (100.0, 200.0, 400.0, 800.0)


def line(rates: tuple[float, ...] = RATES, slope_db: float = 3.0, at_100: float = 30.0) -> list[RatePoint]:
    """A curve that gains `slope_db` with each doubling of the rate."""
    return [(rate, at_100 + slope_db * math.log2(rate / 100)) for rate in rates]


def test_half_the_bits_is_minus_fifty_percent_and_a_doubling_worth_of_quality() -> None:
    delta = compare_curves(line(), [(rate / 2, decibel) for rate, decibel in line()])
    assert delta.rate_percent == pytest.approx(-50)
    assert delta.psnr_db == pytest.approx(3.0)
    assert delta.overlap_db == pytest.approx((30, 39))
    assert delta.warnings == ()


def test_only_the_quality_that_both_reach_counts_and_is_stated() -> None:
    # Above 34 dB the tested curve is not measured; what the anchor does there matters by its tangent alone.
    anchor = [*line((100.0, 150.0, 250.0)), (900.0, 60.0)]
    tested = [(rate * 0.8, decibel) for rate, decibel in line((80.0, 100.0, 150.0, 250.0))]
    delta = compare_curves(anchor, tested)
    assert delta.overlap_db == pytest.approx((30, 30 + 3 * math.log2(2.5)))
    assert delta.rate_percent == pytest.approx(-20, abs=2)
    (warning,) = delta.warnings
    assert warning.startswith("short overlap: 30.00 to 33.97 dB, 13%")


def test_curves_without_common_quality_have_no_bd_rate() -> None:
    delta = compare_curves(line(at_100=50), line())
    assert delta.rate_percent is None
    assert delta.overlap_db is None
    assert delta.psnr_db == pytest.approx(-20)
    assert "no quality in common: no BD-rate" in delta.warnings


def test_one_point_is_no_curve() -> None:
    delta = compare_curves(line(), line()[:1])
    assert (delta.rate_percent, delta.psnr_db, delta.overlap_db) == (None, None, None)
    assert delta.warnings


def test_points_that_cost_more_and_are_no_better_are_left_out_and_told() -> None:
    dented = [*line(), (500.0, 31.0)]
    assert front(dented) == line()
    assert compare_curves(line(), dented).rate_percent == pytest.approx(0)
    assert curve_warnings(dented) == ["not monotonic: 1 of 5 points are left out of BD figures"]
    assert curve_warnings(line()) == []
    assert "3 points" in curve_warnings(line()[1:])[0]


def test_the_order_of_points_does_not_matter() -> None:
    tested = [(rate * 1.3, decibel) for rate, decibel in line()]
    assert compare_curves(line()[::-1], tested[::-1]) == compare_curves(line(), tested)


def test_an_anchor_that_is_steeper_overtakes_where_the_curves_cross() -> None:
    anchor = [(rate, 30 + 6 * math.log2(rate / 200)) for rate in RATES]
    lead = anchor_lead(anchor, line())
    assert lead.overtaking is not None
    assert lead.overtaking.kbps == pytest.approx(400, rel=0.01)
    assert lead.overtaking.psnr_y == pytest.approx(36, abs=0.1)
    assert not lead.overtaking.at_most
    (ahead,) = lead.ranges_kbps
    assert ahead == pytest.approx((lead.overtaking.kbps, 800))


def test_a_curve_that_ends_is_overtaken_at_its_best_quality() -> None:
    ended = [(rate, decibel + 2) for rate, decibel in line()[:2]]
    found = anchor_lead(line(), ended).overtaking
    assert found is not None
    assert found.psnr_y == pytest.approx(35, abs=0.05)
    assert found.kbps == pytest.approx(100 * 2 ** (5 / 3), rel=0.01)


def test_an_anchor_that_is_always_better_overtakes_at_most_there() -> None:
    lead = anchor_lead(line(at_100=31), line())
    assert lead.overtaking is not None
    assert lead.overtaking.at_most
    assert lead.overtaking.kbps == 100
    (ahead,) = lead.ranges_kbps
    assert ahead == pytest.approx((100, 800))
    never = anchor_lead(line(at_100=29), line())
    assert (never.ranges_kbps, never.overtaking) == ((), None)


def test_an_anchor_of_far_fewer_bits_is_ahead_everywhere_and_has_no_bd_psnr() -> None:
    anchor = line((100, 200, 400, 800), slope_db=2, at_100=29)
    tested = line((1000, 2000, 4000, 8000), slope_db=2, at_100=28 - 2 * math.log2(10))
    lead = anchor_lead(anchor, tested)
    assert lead.overtaking is not None
    assert lead.overtaking.at_most
    assert lead.overtaking.kbps == 1000
    assert lead.overtaking.psnr_y == pytest.approx(35)
    (ahead,) = lead.ranges_kbps
    assert ahead == pytest.approx((1000, 8000))
    delta = compare_curves(anchor, tested)
    assert delta.psnr_db is None
    assert delta.rate_percent is not None
    assert delta.rate_percent > 900
    assert "no rate in common: no BD-PSNR" in delta.warnings


def test_an_anchor_of_far_fewer_bits_that_ends_at_less_quality_is_passed() -> None:
    tested = line((1000, 2000, 4000, 8000), at_100=28 - 3 * math.log2(10))
    lead = anchor_lead(line((100, 200), at_100=28), tested)
    assert lead.overtaking is None
    (ahead,) = lead.ranges_kbps
    assert ahead == pytest.approx((1000, 2000), rel=0.01)
    worse = anchor_lead(line((100, 200), at_100=20), tested)
    assert (worse.ranges_kbps, worse.overtaking) == ((), None)


def test_an_anchor_that_leads_at_low_rates_alone_does_not_overtake() -> None:
    flat = line(slope_db=2, at_100=31)
    lead = anchor_lead(flat, line())
    assert lead.overtaking is None
    (ahead,) = lead.ranges_kbps
    assert ahead == pytest.approx((100, 200), rel=0.01)


def test_curves_that_cross_more_than_once_are_overtaken_at_the_last_crossing() -> None:
    wave = [(rate, decibel + shift) for (rate, decibel), shift in zip(line(), (1, -1, -1, 1), strict=True)]
    lead = anchor_lead(wave, line())
    assert lead.overtaking is not None
    assert 400 < lead.overtaking.kbps < 800
    assert not lead.overtaking.at_most
    first, last = lead.ranges_kbps
    assert first[0] == 100
    assert 100 < first[1] < 200
    assert last == pytest.approx((lead.overtaking.kbps, 800))


def test_a_hull_has_the_points_that_no_mixture_of_others_beats() -> None:
    below = (math.sqrt(200.0) * 10, 33.4)  # half way between the second and the third is 33.5
    points = [(100.0, 30.0), (100.0, 33.0), (1000.0 / 5, 34.0), (1000.0, 36.0), below, (90.0, 20.0)]
    assert hull(points) == [(90.0, 20.0), (100.0, 33.0), (200.0, 34.0), (1000.0, 36.0)]
    assert hull(points[:1]) == points[:1]

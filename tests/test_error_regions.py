"""Where error sits: each pixel in one region, shares of pixels and error known from a made-up view."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_arrays import photograph

from mvcodec.array import Viewpoint
from mvcodec.evaluation.error_regions import REGIONS, ErrorMeter, flat, noise_variance, region_numbers
from mvcodec.frames import Picture, RenderedView

FILLED, EDGES, FLAT, TEXTURE = range(len(REGIONS))
HEIGHT, WIDTH = 40, 60


def original() -> Picture:
    """Stripes 8 levels high in the lower half, nothing in the upper one."""
    picture = np.full((HEIGHT, WIDTH, 3), 100, np.uint8)
    picture[HEIGHT // 2 :: 2] += 8
    return picture


def rendered(pixels: Picture) -> RenderedView:
    """A view with a depth edge between columns 29 and 30, the right 10 columns filled."""
    disparity = np.zeros((HEIGHT, WIDTH), np.float32)
    disparity[:, 30:] = 2.5
    seen = np.full((HEIGHT, WIDTH), 3, np.uint8)
    seen[:, 50:] = 0
    return RenderedView(Viewpoint(0, 0), pixels, disparity, seen)


def test_each_pixel_is_in_the_first_region_that_fits() -> None:
    numbers = region_numbers(original(), rendered(original()))
    assert (numbers[:, 50:] == FILLED).all()
    assert (numbers[:, 25:35] == EDGES).all()
    for columns in (slice(0, 25), slice(35, 50)):
        assert (numbers[: HEIGHT // 2 - 2, columns] == FLAT).all()
        assert (numbers[HEIGHT // 2 :, columns] == TEXTURE).all()


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("step", "is_flat"), [(1, True), (2, False), (-2, False), (0, True)])
def test_flat_is_where_neither_direction_has_a_gradient_of_two_levels(
    axis: int, step: int, is_flat: bool
) -> None:
    ramp = 128 + step * np.arange(-20, 20)
    plane = np.repeat(ramp[:, None], 30, axis=1).astype(np.uint8)
    assert (flat(plane if axis == 0 else plane.T)[:-3, :-3] == is_flat).all()


def test_shares_of_a_known_error() -> None:
    first = original()
    wrong = first.copy()
    wrong[:, 50:] += 30
    wrong[:10, :20] += 10
    meter = ErrorMeter()
    meter.push(first, rendered(wrong))
    meter.push(first, rendered(first))  # adds pixels, no error
    shares = meter.result()
    filled, flats = HEIGHT * 10 * 900, 10 * 20 * 100
    total = filled + flats
    assert shares.regions["filled"].error_share == pytest.approx(filled / total)
    assert shares.regions["flat"].error_share == pytest.approx(flats / total)
    assert shares.regions["edges"].error_share == shares.regions["texture"].error_share == 0
    assert shares.regions["filled"].share == pytest.approx(10 / WIDTH)
    assert shares.regions["edges"].psnr_y == 100
    assert shares.regions["filled"].psnr_y == pytest.approx(10 * math.log10(255**2 / 450))
    assert shares.worst_share == pytest.approx(0.02 * HEIGHT * WIDTH * 900 / total)
    mean = (HEIGHT * 10 * 30 + 10 * 20 * 10) / (HEIGHT * WIDTH)
    assert shares.brightness_share == pytest.approx(mean**2 * HEIGHT * WIDTH / total)


def test_a_photograph_made_brighter_is_all_brightness() -> None:
    picture = photograph("coffee")[:HEIGHT, :WIDTH].clip(0, 200)
    meter = ErrorMeter()
    meter.push(picture, rendered(picture + np.uint8(5)))
    assert meter.result().brightness_share == pytest.approx(1)


def test_without_error_no_share_of_it_is_named() -> None:
    meter = ErrorMeter()
    meter.push(original(), rendered(original()))
    document = meter.result().to_json()
    assert document["worst_share"] is document["brightness_share"] is document["noise_share"] is None
    assert list(document["regions"]) == list(REGIONS)
    assert {region["error_share"] for region in document["regions"].values()} == {None}
    assert sum(region["share"] for region in document["regions"].values()) == pytest.approx(1)


@pytest.mark.parametrize("deviation", [1.0, 3.0, 8.0])
def test_noise_is_found_beneath_ramps_and_edges(deviation: float) -> None:
    across = np.linspace(40, 200, 300)[None] + np.where(np.arange(200) % 50 < 25, 0, 20)[:, None]
    noisy = across + np.random.default_rng(1).normal(0, deviation, across.shape)
    assert noise_variance(np.rint(noisy).astype(np.uint8)) == pytest.approx(deviation**2, rel=0.15)


def test_a_clean_picture_has_no_noise_and_a_tiny_one_none_that_shows() -> None:
    assert noise_variance(np.repeat(np.arange(60, dtype=np.uint8)[None], 40, axis=0)) == 0
    assert noise_variance(np.zeros((2, 1), np.uint8)) == 0


def test_a_perfect_view_of_a_noisy_original_is_all_noise() -> None:
    rng, clean = np.random.default_rng(2), np.full((80, 120, 3), 120, np.uint8)
    noisy = np.repeat(np.rint(clean[..., :1] + rng.normal(0, 4, (80, 120, 1))), 3, axis=2).astype(np.uint8)
    shape = clean.shape[:2]
    view = RenderedView(Viewpoint(0, 0), clean, np.zeros(shape, np.float32), np.ones(shape, np.uint8))
    meter = ErrorMeter()
    meter.push(noisy, view)
    assert meter.result().noise_share == pytest.approx(1, abs=0.1)

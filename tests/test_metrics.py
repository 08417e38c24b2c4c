"""The figures of merit, against scikit-image, closed forms and the thesis's own figures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from skimage.metrics import structural_similarity
from small_arrays import photograph

from mvcodec.errors import SettingError
from mvcodec.evaluation.metrics import bad_pixel_rate, luma, psnr, psnr_saturated, psnr_yuv, ssim


def reference_ssim(picture: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    settings = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False, "data_range": 255}
    return float(structural_similarity(picture, other, **settings))  # type: ignore[no-untyped-call]


def noisy(picture: NDArray[np.uint8], sigma: float) -> NDArray[np.uint8]:
    noise = np.random.default_rng(7).normal(0, sigma, picture.shape)
    return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


def salt_and_pepper(picture: NDArray[np.uint8], density: float) -> NDArray[np.uint8]:
    """As much salt as pepper, so that the expected figure does not depend on luck."""
    hit = np.random.default_rng(3).permutation(picture.size)[: round(density * picture.size)]
    spoilt = picture.copy()
    spoilt.flat[hit[::2]], spoilt.flat[hit[1::2]] = 0, 255
    return spoilt


def grey(value: int, side: int = 16) -> NDArray[np.uint8]:
    return np.full((side, side), value, np.uint8)


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_luma_is_the_rounded_full_range_sum(rgb: tuple[int, int, int]) -> None:
    picture = np.full((4, 4, 3), rgb, np.uint8)
    exact = 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]
    assert np.all(np.abs(luma(picture) - exact) <= 0.51)


@pytest.mark.parametrize("rgb", [(0, 0, 0), (255, 255, 255), (77, 77, 77)])
def test_luma_of_grey_is_that_grey(rgb: tuple[int, int, int]) -> None:
    assert np.all(luma(np.full((3, 3, 3), rgb, np.uint8)) == rgb[0])


def test_luma_takes_red_green_blue_in_that_order() -> None:
    red = np.zeros((1, 1, 3), np.uint8)
    red[..., 0] = 255
    assert luma(red).item() == 76


def test_identical_pictures_count_as_100_db_and_ssim_1() -> None:
    picture = photograph("astronaut")
    assert psnr(picture, picture) == 100.0
    assert psnr_saturated(picture, picture) == 100.0
    assert ssim(picture, picture) == pytest.approx(1.0)


@pytest.mark.parametrize(("step", "expected"), [(1, 48.1308), (10, 28.1308), (255, 0.0)])
def test_psnr_of_a_constant_error(step: int, expected: float) -> None:
    assert psnr(grey(0), grey(step)) == pytest.approx(expected, abs=1e-4)
    assert psnr(grey(step), grey(0)) == pytest.approx(expected, abs=1e-4)


def test_psnr_is_that_of_luma_and_not_of_the_colours() -> None:
    picture = photograph("chelsea")
    other = noisy(picture, 12)
    assert psnr(picture, other) == psnr(luma(picture), luma(other))
    over_colours = 10 * np.log10(255**2 / np.mean((picture.astype(float) - other) ** 2))
    assert psnr(picture, other) > over_colours + 1


@pytest.mark.parametrize("sigma", [0.5, 4, 25, 80])
@pytest.mark.parametrize("name", ["chelsea", "coffee", "brick"])
def test_ssim_equals_scikit_image(name: str, sigma: float) -> None:
    picture = luma(photograph(name))
    other = noisy(picture, sigma)
    expected = reference_ssim(picture, other)
    assert ssim(picture, other) == pytest.approx(expected, abs=1e-9)


def test_ssim_equals_scikit_image_on_the_smallest_picture() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (11, 12), dtype=np.uint8)
    other = picture[::-1].copy()
    expected = reference_ssim(picture, other)
    assert ssim(picture, other) == pytest.approx(expected, abs=1e-9)


def test_saturated_psnr_ignores_negative_differences_and_clips_squares() -> None:
    assert psnr_saturated(grey(10), grey(200)) == 100.0
    assert psnr_saturated(grey(200), grey(10)) == pytest.approx(10 * np.log10(255))
    assert psnr_saturated(grey(13), grey(10)) == pytest.approx(10 * np.log10(255**2 / 9))


@pytest.mark.parametrize(("density", "printed"), [(0.001, 56.74), (0.02, 44.01)])
def test_saturated_psnr_explains_the_thesis_figure_3_8(density: float, printed: float) -> None:
    picture = photograph("brick")
    other = salt_and_pepper(picture, density)
    assert psnr_saturated(picture, other) == pytest.approx(printed, abs=0.5)
    assert psnr(picture, other) < printed - 20


def test_bad_pixels_count_known_truth_only_and_exact_threshold_is_good() -> None:
    truth = np.zeros((1, 5), np.float32)
    estimate = np.array([[0, 1, 1.01, -2, 50]], np.float32)
    known = np.array([[True, True, True, True, False]])
    assert bad_pixel_rate(truth, known, estimate) == 0.5
    assert bad_pixel_rate(truth, known, estimate, 2) == 0.0
    assert bad_pixel_rate(truth, known, estimate, 0.5) == 0.75


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(SettingError, match="16x16 and 17x17"):
        psnr(grey(0), grey(0, 17))
    with pytest.raises(SettingError, match="11x11"):
        ssim(grey(0, 10), grey(0, 10))
    unknown = np.zeros((2, 2), np.bool_)
    with pytest.raises(SettingError, match="no pixel"):
        bad_pixel_rate(np.zeros((2, 2), np.float32), unknown, np.zeros((2, 2), np.float32))


def test_chroma_counts_a_quarter_of_luma_and_chroma_and_luma_the_rest() -> None:
    grey = np.full((32, 48, 3), 128, np.uint8)
    bluer = grey.copy()
    bluer[..., 2] += 20
    assert psnr_yuv(grey, grey) == 100.0
    # Cb moves by 20 / 2 of 255, coded as 9 of 224, and Cr by 20 * 0.0722 / 1.5748, coded as 1.
    cb, cr = 255 * 9 / 224, 255 * 1 / 224
    chroma = sum(20 * np.log10(255 / error) for error in (cb, cr))
    assert psnr_yuv(grey, bluer) == pytest.approx((6 * psnr(grey, bluer) + chroma) / 8, abs=0.3)
    assert psnr_yuv(grey, bluer) < psnr(grey, bluer)

"""SSIM maps, IV-PSNR, flicker and the regions that maps are scored over."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from small_arrays import photograph

from mvcodec.errors import SettingError
from mvcodec.evaluation.flicker import temporal_psnr
from mvcodec.evaluation.immersive import iv_psnr
from mvcodec.evaluation.metrics import psnr, ssim, ssim_map, ssim_picture
from mvcodec.evaluation.regions import BadPixels, bad_pixels, regions
from mvcodec.frames import DisparityMap, Picture


def noisy(picture: Picture, sigma: float, seed: int = 7) -> Picture:
    noise = np.random.default_rng(seed).normal(0, sigma, picture.shape)
    return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


def test_ssim_is_the_mean_of_its_map() -> None:
    picture = photograph("chelsea")
    other = noisy(picture, 20)
    values = ssim_map(picture, other)
    assert values.shape == (picture.shape[0] - 10, picture.shape[1] - 10)
    assert values.mean() == pytest.approx(ssim(picture, other))


def test_ssim_picture_is_dark_where_the_pictures_differ() -> None:
    picture = photograph("chelsea")
    other = picture.copy()
    other[40:60, 30:50] = noisy(other, 90)[40:60, 30:50]
    shown = ssim_picture(picture, other)
    assert shown.shape == picture.shape
    assert shown.dtype == np.uint8
    assert (shown == shown[..., :1]).all()
    assert shown[45:55, 35:45].mean() < 100
    assert (shown[70:, 70:] == 255).all()


def plain_iv_psnr(original: Picture, picture: Picture) -> float:
    """Pixel by pixel, as the paper words it."""
    import cv2

    def components(rgb: Picture) -> NDArray[np.int64]:
        return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2YCrCb), np.int64)[..., [0, 2, 1]]

    def one_way(reference: NDArray[np.int64], tested: NDArray[np.int64]) -> float:
        height, width = tested.shape[:2]
        errors = np.zeros(3)
        for y in range(height):
            for x in range(width):
                rows = [min(max(y + dy, 0), height - 1) for dy in range(-2, 3)]
                columns = [min(max(x + dx, 0), width - 1) for dx in range(-2, 3)]
                squares = [(tested[y, x] - reference[row, column]) ** 2 for row in rows for column in columns]
                errors += min(squares, key=lambda s: int(4 * s[0] + s[1] + s[2]))
        decibels = 10 * np.log10(255**2 / (errors / (height * width)))
        return float((4 * decibels[0] + decibels[1] + decibels[2]) / 6)

    first, second = components(original), components(picture)
    difference = np.array([np.clip(np.floor((first - second)[..., c].mean() + 0.5), -3, 3) for c in range(3)])
    shift = difference.astype(np.int64)
    return min(one_way(first, second + shift), one_way(second, first - shift))


@pytest.mark.parametrize("size", [(12, 17), (5, 4), (1, 9)], ids=str)
def test_iv_psnr_equals_its_plain_twin(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    original, picture = rng.integers(0, 256, (2, *size, 3), np.uint8)
    assert iv_psnr(original, picture) == pytest.approx(plain_iv_psnr(original, picture))


def test_iv_psnr_forgives_small_shifts_and_a_tint() -> None:
    picture = photograph("astronaut")
    assert iv_psnr(picture, picture) == 100.0
    shifted = np.roll(picture, (1, -2), axis=(0, 1))
    assert iv_psnr(picture, shifted) > psnr(picture, shifted) + 10
    far = np.roll(picture, (0, 9), axis=(0, 1))
    assert iv_psnr(picture, far) < iv_psnr(picture, shifted) - 5
    grey = np.full((30, 30, 3), 100, np.uint8)
    assert iv_psnr(grey, grey + np.uint8(3)) == 100.0
    assert iv_psnr(grey, grey + np.uint8(13)) == pytest.approx((4 * 28.1308 + 200) / 6, abs=1e-3)


def test_iv_psnr_counts_the_worse_direction() -> None:
    """A hole filled with what is beside it is like its surroundings, but not the other way round."""
    picture = np.full((40, 40, 3), 128, np.uint8)
    spotted = picture.copy()
    spotted[10:13, 10:13] = 255
    assert iv_psnr(picture, spotted) == pytest.approx(iv_psnr(spotted, picture))
    assert iv_psnr(picture, spotted) < 60


def test_static_errors_do_not_flicker() -> None:
    frames = [np.roll(photograph("coffee"), 3 * t, axis=1) for t in range(4)]
    offset = np.random.default_rng(0).integers(0, 20, frames[0].shape)
    tinted = [(frame // 2).astype(np.uint8) for frame in frames]
    spoilt = [(frame + offset).astype(np.uint8) for frame in tinted]
    assert temporal_psnr(tinted, tinted) == 100.0
    assert temporal_psnr(tinted, spoilt) > 50
    assert psnr(tinted[0], spoilt[0]) < 35


@pytest.mark.parametrize("step", [1, 10])
def test_flicker_of_a_picture_that_blinks(step: int) -> None:
    frames = [np.full((8, 8), 100, np.uint8) for _ in range(5)]
    blinking = [frame + np.uint8(step * (t % 2)) for t, frame in enumerate(frames)]
    assert temporal_psnr(frames, blinking) == pytest.approx(10 * np.log10(255**2 / step**2))
    assert temporal_psnr(iter(frames), iter(blinking)) == pytest.approx(10 * np.log10(255**2 / step**2))


def test_what_has_no_flicker_is_refused() -> None:
    frames = [np.zeros((4, 4), np.uint8)] * 3
    with pytest.raises(SettingError, match="1 frames, expected at least two"):
        temporal_psnr(frames[:1], frames[:1])
    with pytest.raises(SettingError, match="different length"):
        temporal_psnr(frames, frames[:2])
    with pytest.raises(SettingError, match="4x4 and 5x4"):
        temporal_psnr(frames, [np.zeros((4, 5), np.uint8)] * 3)
    with pytest.raises(SettingError, match="9x9 and 8x9"):
        iv_psnr(np.zeros((9, 9, 3), np.uint8), np.zeros((9, 8, 3), np.uint8))


def step_scene() -> tuple[DisparityMap, DisparityMap]:
    """A near strip (d = 8, columns 20 - 29) before a wall (d = 2), seen from left and right."""
    left, right = np.full((12, 50), 2, np.float32), np.full((12, 50), 2, np.float32)
    left[:, 20:30] = 8
    right[:, 12:22] = 8
    return tuple(DisparityMap(values, np.ones(values.shape, np.bool_)) for values in (left, right))  # type: ignore[return-value]


@pytest.mark.parametrize("two_maps", [True, False])
def test_occluded_is_what_the_right_camera_does_not_see(two_maps: bool) -> None:
    left, right = step_scene()
    scored = regions(left, right if two_maps else None)
    seen = scored.non_occluded[5]
    # The wall's columns 14 - 19 land where the strip lands (12 - 21), those from 24 on are the strip.
    assert not seen[14:20].any()
    assert not seen[:2].any()  # outside the right picture
    assert seen[2:12].all()
    assert seen[20:30].all()
    assert seen[31:].all()
    assert scored.all.all()


def test_slanted_surfaces_do_not_hide_themselves() -> None:
    slanted = np.broadcast_to(np.linspace(5, 17, 60, dtype=np.float32), (8, 60)).copy()
    scored = regions(DisparityMap(slanted, np.ones(slanted.shape, np.bool_)))
    assert scored.non_occluded[:, 8:].all()
    assert not scored.discontinuity.any()


def test_discontinuity_is_near_depth_edges_and_seen() -> None:
    left, right = step_scene()
    scored = regions(left, right)
    near = scored.discontinuity[5]
    assert near[20:24].all()
    assert near[31:34].all()
    assert not near[14:20].any()
    assert not near[:14].any()
    assert not near[36:].any()
    unknown = DisparityMap(left.values_px, left.valid.copy())
    unknown.valid[:, 20:30] = False
    assert not regions(unknown, right).discontinuity.any()


def test_rates_of_the_regions() -> None:
    left, right = step_scene()
    scored = regions(left, right)
    estimate = left.values_px.copy()
    estimate[:, 14:20] += 4  # occluded
    rates = bad_pixels(scored, estimate)
    assert rates == BadPixels(0.0, 6 / 50, 0.0)
    estimate[:, 20] += 1.5
    assert bad_pixels(scored, estimate).non_occluded > 0
    assert bad_pixels(scored, estimate, 2.0).non_occluded == 0
    assert bad_pixels(scored, estimate, 0.5).discontinuity > bad_pixels(scored, estimate, 2.0).discontinuity
    with pytest.raises(SettingError, match="truth maps of equal size"):
        regions(left, DisparityMap(np.zeros((3, 3), np.float32), np.ones((3, 3), np.bool_)))

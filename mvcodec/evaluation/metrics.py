"""Figures of merit for pictures and disparity maps, as ALGORITHMS section 7 defines them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Mask, Picture
from mvcodec.video.colour import to_planes

IDENTICAL_PSNR_DB = 100.0
PEAK = 255.0

SSIM_WINDOW = 11
SSIM_SIGMA = 1.5
SSIM_C1 = (0.01 * PEAK) ** 2
SSIM_C2 = (0.03 * PEAK) ** 2

CHROMA_SCALE = 255 / 224
"""Limited range to full range."""

Luma = NDArray[np.uint8]
"""uint8 (H, W), full range."""


def luma(picture: Picture) -> Luma:
    """Y of an RGB picture: 0.299 R + 0.587 G + 0.114 B, rounded to 8 bits, full range.

    Args:
        picture: uint8 (H, W, 3) RGB; a uint8 (H, W) luma plane is returned as it is.
    """
    if picture.ndim == 2:
        return picture
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def psnr(original: Picture, picture: Picture) -> float:
    """PSNR of luma in dB, the mean squared error in float64; 100 dB for identical pictures.

    Args:
        original, picture: uint8 (H, W, 3) RGB or uint8 (H, W) luma.

    Raises:
        SettingError: the pictures differ in size.
    """
    first, second = _pair(original, picture)
    # The sum of squares is an integer: exact in int64 whatever the order of the additions.
    difference = first.astype(np.int32) - second
    return decibel(float(np.square(difference).sum(dtype=np.int64)) / difference.size)


def psnr_yuv(original: Picture, picture: Picture) -> float:
    """(6 Y + Cb + Cr) / 8 of the three PSNRs in dB: luma as in `psnr`, chroma as it is coded.

    Chroma is that of BT.709 at half the size each way, scaled to the full range of 8 bits.

    Args:
        original, picture: uint8 (H, W, 3) RGB.

    Raises:
        SettingError: the pictures differ in size.
    """
    total = 6 * psnr(original, picture)
    first, second = to_planes(original), to_planes(picture)
    for one, other in ((first.u, second.u), (first.v, second.v)):
        squares = np.square(one.astype(np.int32) - other).sum(dtype=np.int64)
        total += decibel(float(squares) / one.size * CHROMA_SCALE**2)
    return total / 8


def psnr_saturated(original: Picture, picture: Picture) -> float:
    """What the thesis calls PSNR: negative differences and squares above 255 are clipped.

    ``mean(min(max(original - picture, 0)^2, 255))`` in place of the mean squared error. It never
    falls below 24 dB and must not be mixed with `psnr` (ALGORITHMS section 7).

    Args:
        original, picture: uint8 (H, W, 3) RGB or uint8 (H, W) luma; the order matters.

    Raises:
        SettingError: the pictures differ in size.
    """
    first, second = _pair(original, picture)
    positive = np.maximum(first.astype(np.int32) - second, 0)
    clipped = np.minimum(np.square(positive), 255)
    return decibel(float(clipped.sum(dtype=np.int64)) / clipped.size)


def ssim(original: Picture, picture: Picture) -> float:
    """Structural similarity of luma (Wang et al. 2004): Gaussian 11 x 11, sigma 1.5, range 255.

    The same figure as scikit-image's ``structural_similarity(gaussian_weights=True, sigma=1.5,
    use_sample_covariance=False, data_range=255)``; only the pixels whose whole window lies in the
    picture count.

    Args:
        original, picture: uint8 (H, W, 3) RGB or uint8 (H, W) luma.

    Raises:
        SettingError: the pictures differ in size, or are smaller than the window.
    """
    return float(ssim_map(original, picture).mean())


def ssim_map(original: Picture, picture: Picture) -> NDArray[np.float64]:
    """SSIM of each pixel whose whole window lies in the picture; `ssim` is its mean.

    Args:
        original, picture: uint8 (H, W, 3) RGB or uint8 (H, W) luma.

    Returns:
        float64 (H - 10, W - 10), -1..1.

    Raises:
        SettingError: the pictures differ in size, or are smaller than the window.
    """
    first, second = _pair(original, picture)
    height, width = first.shape
    if min(height, width) < SSIM_WINDOW:
        raise SettingError("ssim", f"{width}x{height}", f"pictures of at least {SSIM_WINDOW}x{SSIM_WINDOW}")
    x, y = first.astype(np.float64), second.astype(np.float64)
    mean_x, mean_y = _window_mean(x), _window_mean(y)
    # Var x + Var y appear as a sum only, so that one filter pass serves both.
    squares = _window_mean(x * x + y * y)
    cross = _window_mean(x * y)
    product, energy = mean_x * mean_y, mean_x * mean_x + mean_y * mean_y
    similarity = (2 * product + SSIM_C1) * (2 * (cross - product) + SSIM_C2)
    similarity /= (energy + SSIM_C1) * (squares - energy + SSIM_C2)
    margin = SSIM_WINDOW // 2
    return np.asarray(similarity[margin : height - margin, margin : width - margin])


def ssim_picture(original: Picture, picture: Picture) -> Picture:
    """`ssim_map` to look at, as in the thesis's figures: white = alike, black = 0 or below.

    Args:
        original, picture: uint8 (H, W, 3) RGB or uint8 (H, W) luma.

    Returns:
        uint8 (H, W, 3), grey; the border that has no window of its own repeats the map's.

    Raises:
        SettingError: as `ssim_map`.
    """
    levels = np.rint(ssim_map(original, picture).clip(0, 1) * PEAK).astype(np.uint8)
    grey = np.pad(levels, SSIM_WINDOW // 2, mode="edge")
    return np.repeat(grey[..., None], 3, axis=2)


def bad_pixel_rate(
    truth_px: FloatMap, known: Mask, estimate_px: FloatMap, threshold_px: float = 1.0
) -> float:
    """Share (0..1) of the pixels with known truth whose disparity error exceeds the threshold.

    Args:
        truth_px, estimate_px: float32 (H, W), px of the same baseline.
        known: bool (H, W), where the truth is known (or: where it is to be scored).
        threshold_px: an error of exactly this size still counts as good.

    Raises:
        SettingError: the maps differ in size, or no pixel is known.
    """
    if not truth_px.shape == known.shape == estimate_px.shape:
        found = f"{truth_px.shape}, {known.shape}, {estimate_px.shape}"
        raise SettingError("bad_pixel_rate", found, "truth, mask and estimate of equal size")
    if not known.any():
        raise SettingError("bad_pixel_rate", "no pixel with known truth", "at least one")
    error = np.abs(truth_px[known].astype(np.float64) - estimate_px[known])
    return float((error > threshold_px).mean())


def decibel(mean_squared_error: float) -> float:
    """PSNR of 8-bit values in dB; 100 dB for no error at all."""
    if mean_squared_error == 0:
        return IDENTICAL_PSNR_DB
    return float(10 * np.log10(PEAK * PEAK / mean_squared_error))


def _pair(original: Picture, picture: Picture) -> tuple[Luma, Luma]:
    if original.shape[:2] != picture.shape[:2]:
        sizes = " and ".join(f"{p.shape[1]}x{p.shape[0]}" for p in (original, picture))
        raise SettingError("pictures", sizes, "pictures of equal size")
    return luma(original), luma(picture)


def _window_mean(plane: NDArray[np.float64]) -> NDArray[np.float64]:
    kernel = cv2.getGaussianKernel(SSIM_WINDOW, SSIM_SIGMA, cv2.CV_64F)
    return np.asarray(cv2.sepFilter2D(plane, cv2.CV_64F, kernel, kernel), dtype=np.float64)

"""What a partner's grey says about the disparity between levels, pixel by pixel."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatMap = NDArray[np.float32]

CUBIC = np.float32(-0.75)
"""Of the cubic convolution (Keys 1981) that OpenCV has as well."""
# Its coefficients, in single precision: whole numbers would make it double.
TWO, THREE = np.float32(CUBIC + 2), np.float32(CUBIC + 3)
FOUR, FIVE, EIGHT = np.float32(4 * CUBIC), np.float32(5 * CUBIC), np.float32(8 * CUBIC)


@njit(cache=True, nogil=True, inline="always")
def _cubic(before, here, after, beyond, t):  # type: ignore[no-untyped-def]
    """A value t after `here`, by cubic convolution of four samples."""
    one = np.float32(1)
    far, near_end, far_end = one + t, one - t, one + one - t
    w_before = ((CUBIC * far - FIVE) * far + EIGHT) * far - FOUR
    w_here = (TWO * t - THREE) * t * t + one
    w_after = (TWO * near_end - THREE) * near_end * near_end + one
    w_beyond = ((CUBIC * far_end - FIVE) * far_end + EIGHT) * far_end - FOUR
    return w_before * before + w_here * here + w_after * after + w_beyond * beyond


@njit(cache=True, nogil=True)
def add_pull(
    disparity: FloatMap,
    grey: FloatMap,
    other_grey: FloatMap,
    other_slope: FloatMap,
    other_disparity: FloatMap,
    along_rows: bool,
    step: float,
    same_surface: float,
    grey_scale: float,
    pull: FloatMap,
    weight: FloatMap,
) -> None:
    """Add one partner's part of the normal equations of `mvcodec.stereo.subpixel.refine`.

    Args:
        disparity, grey: float32 (H, W), of the map's own camera.
        other_grey, other_slope, other_disparity: float32 (H, W), of the partner; its grey's slope along the
            baseline, grey levels a pixel.
        along_rows: whether the partner stands in the camera's row, else in its column.
        step: a pixel of disparity d is at x - step * d (y - step * d) of the partner.
        same_surface: the partner counts where its disparity differs by less, px.
        grey_scale: a difference of so many grey levels halves what it counts.
        pull, weight: float32 (H, W), added to.
    """
    height, width = disparity.shape
    last = width - 1 if along_rows else height - 1
    by, scale, one = np.float32(step), np.float32(1 / grey_scale), np.float32(1)
    near = np.float32(same_surface)
    for y in range(height):
        for x in range(width):
            d = disparity[y, x]
            at = np.float32(x if along_rows else y) - by * d
            if at < 0 or at > last:
                continue
            nearest = int(np.rint(at))
            there = other_disparity[y, nearest] if along_rows else other_disparity[nearest, x]
            if abs(there - d) >= near:
                continue
            here = int(at)
            t = at - np.float32(here)
            before, after, beyond = max(here - 1, 0), min(here + 1, last), min(here + 2, last)
            if along_rows:
                row, slopes = other_grey[y], other_slope[y]
                seen = _cubic(row[before], row[here], row[after], row[beyond], t)
                slope = slopes[here] + t * (slopes[after] - slopes[here])
            else:
                seen = _cubic(
                    other_grey[before, x], other_grey[here, x], other_grey[after, x], other_grey[beyond, x], t
                )
                slope = other_slope[here, x] + t * (other_slope[after, x] - other_slope[here, x])
            residual = grey[y, x] - seen
            off = residual * scale
            trusted = -by * slope / (one + off * off)
            pull[y, x] += trusted * residual
            weight[y, x] += trusted * -by * slope

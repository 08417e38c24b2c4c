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


RUN = 16
"""Neighbours that are fetched at once where the partner's are neighbours too."""
NOWHERE = np.int32(-1)


@njit(cache=True, nogil=True)
def _places(disparity, first, along, by, last, whole, parts, further):  # type: ignore[no-untyped-def]
    """Where the pixels of a row are seen: the pixel before that, what is left, and if the next is nearer."""
    for x in range(disparity.size):
        place = np.float32(first + along * np.int32(x)) - by * disparity[x]
        inside = (place >= np.float32(0)) & (place <= last)
        place = min(max(place, np.float32(0)), last)
        at = np.int32(place)
        whole[x], parts[x] = at, place - np.float32(at)
        further[x] = np.int32(np.rint(place)) - at if inside else NOWHERE


@njit(cache=True, nogil=True)
def _is_run(whole, start, along):  # type: ignore[no-untyped-def]
    """Whether RUN pixels are seen side by side."""
    differ = np.int32(0)
    for k in range(np.uint64(RUN)):
        differ |= (whole[start + k] - along * np.int32(k)) ^ whole[start]
    return differ == 0


@njit(cache=True, nogil=True)
def _copy(source, begin, out, there):  # type: ignore[no-untyped-def]
    for k in range(np.uint64(RUN)):
        out[there + k] = source[begin + k]


@njit(cache=True, nogil=True)
def _copy_nearer(source, begin, stride, further, out, there):  # type: ignore[no-untyped-def]
    for k in range(np.uint64(RUN)):
        one, two = source[begin + k], source[begin + stride + k]
        out[there + k] = two if further[there + k] > 0 else one


@njit(cache=True, nogil=True)
def _residuals(grey, before, here, after, beyond, parts, found):  # type: ignore[no-untyped-def]
    for x in range(grey.size):
        found[x] = grey[x] - _cubic(before[x], here[x], after[x], beyond[x], parts[x])


@njit(cache=True, nogil=True)
def _between(slopes, next_slopes, parts):  # type: ignore[no-untyped-def]
    for x in range(slopes.size):
        slopes[x] = slopes[x] + parts[x] * (next_slopes[x] - slopes[x])


@njit(cache=True, nogil=True)
def _trust(residuals, slopes, disparity, there, further, by, near, scale, trusted):  # type: ignore[no-untyped-def]
    """How much each pixel counts, times its slope: 0 where the partner has no say."""
    for x in range(residuals.size):
        off = residuals[x] * scale
        counts = (further[x] >= 0) & (abs(there[x] - disparity[x]) < near)
        value = -by * slopes[x] / (np.float32(1) + off * off)
        trusted[x] = value if counts else np.float32(0)


@njit(cache=True, nogil=True)
def _add_products(one, other, factor, total):  # type: ignore[no-untyped-def]
    for x in range(total.size):
        total[x] += one[x] * factor * other[x]


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
    stride = 1 if along_rows else width
    by, along = np.float32(step), np.int32(1 if along_rows else 0)
    flat_grey, flat_slope = other_grey.reshape(-1), other_slope.reshape(-1)
    flat_there = other_disparity.reshape(-1)
    # Rows of one array would not be told apart: then nothing is vectorised.
    whole, further = np.empty(width, np.int32), np.empty(width, np.int32)
    parts, residuals = np.empty(width, np.float32), np.empty(width, np.float32)
    trusted, there = np.empty(width, np.float32), np.empty(width, np.float32)
    before, here = np.empty(width, np.float32), np.empty(width, np.float32)
    after, beyond = np.empty(width, np.float32), np.empty(width, np.float32)
    slopes, next_slopes = np.empty(width, np.float32), np.empty(width, np.float32)
    by_one, scale, near = np.uint64(stride), np.float32(1 / grey_scale), np.float32(same_surface)
    for y in range(height):
        row = np.int32(0 if along_rows else y)
        _places(disparity[y], row, along, by, np.float32(last), whole, parts, further)
        for start in range(0, width, RUN):
            first = np.int64(whole[start])
            inside = start + RUN <= width and first >= 1 and first + (RUN - 1) * along + 2 <= last
            if inside and _is_run(whole, np.uint64(start), along):
                out = np.uint64(start)
                begin = np.uint64(y * width + first if along_rows else first * width + start)
                _copy(flat_grey, begin - by_one, before, out)
                _copy(flat_grey, begin, here, out)
                _copy(flat_grey, begin + by_one, after, out)
                _copy(flat_grey, begin + by_one + by_one, beyond, out)
                _copy(flat_slope, begin, slopes, out)
                _copy(flat_slope, begin + by_one, next_slopes, out)
                _copy_nearer(flat_there, begin, by_one, further, there, out)
                continue
            for k in range(min(RUN, width - start)):
                x = start + k
                at = int(whole[x])
                begin_at = y * width if along_rows else x
                before[x] = flat_grey[begin_at + max(at - 1, 0) * stride]
                here[x] = flat_grey[begin_at + at * stride]
                after[x] = flat_grey[begin_at + min(at + 1, last) * stride]
                beyond[x] = flat_grey[begin_at + min(at + 2, last) * stride]
                slopes[x] = flat_slope[begin_at + at * stride]
                next_slopes[x] = flat_slope[begin_at + min(at + 1, last) * stride]
                there[x] = flat_there[begin_at + min(at + max(further[x], 0), last) * stride]
        _residuals(grey[y], before, here, after, beyond, parts, residuals)
        _between(slopes, next_slopes, parts)
        _trust(residuals, slopes, disparity[y], there, further, by, near, scale, trusted)
        _add_products(trusted, residuals, np.float32(1), pull[y])
        _add_products(trusted, slopes, -by, weight[y])

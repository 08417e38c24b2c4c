"""Which matches of a pair are the only ones: repeated texture looks the same a period further on.

Semi-global matching decides such places by their surroundings, and where those are repeated as well, by
noise. Whole walls and fences then agree, from left and from right, on a multiple of the period.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask

WINDOW = 11
"""Side of the windows that are compared, px: enough that edges alone are not taken for each other."""

OWN_PX = 3.0
"""Disparities this close are the same match."""

LEAD = 0.05
"""How much better the match must correlate than any other."""

ALIKE = 0.8
"""Less correlation is not repetition: at the contour of a small object both surfaces match in part."""

_LEAST_VARIANCE = 1e-3


def unambiguous(left: FloatMap, right: FloatMap, disparity: FloatMap, span_px: tuple[float, float]) -> Mask:
    """Where no other place correlates well and as well as the match does (NCC, equation 3.6).

    Args:
        left, right: float32 (H, W), grey.
        disparity: float32 (H, W), px, of `left`: (x, y) is seen at (x - d, y) in `right`.
        span_px: (lo, hi) of the disparities that are compared, in whole px.

    Returns:
        bool (H, W).
    """
    width = left.shape[1]
    mean_left, mean_right = _mean(left), _mean(right)
    scale_left, scale_right = _scale(left, mean_left), _scale(right, mean_right)
    none = np.float32(-1)  # correlates less than anything; NumPy is slow at `where=`
    own, other = np.full((2, *left.shape), none, np.float32)
    for shift in range(math.floor(span_px[0]), math.ceil(span_px[1]) + 1):
        first, last = max(shift, 0), min(width + shift, width)
        if last - first < WINDOW:
            continue
        here, there = np.s_[:, first:last], np.s_[:, first - shift : last - shift]
        covariance = _mean(left[here] * right[there]) - mean_left[here] * mean_right[there]
        correlation = covariance * scale_left[here] * scale_right[there]
        is_own = np.abs(disparity[here] - shift) < OWN_PX
        np.maximum(own[here], np.where(is_own, correlation, none), out=own[here])
        np.maximum(other[here], np.where(is_own, none, correlation), out=other[here])
    return np.asarray((own - other > LEAD) | (other < ALIKE))


def _mean(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(cv2.blur(pixels, (WINDOW, WINDOW)), np.float32)


def _scale(pixels: FloatMap, mean: NDArray[np.float32]) -> NDArray[np.float32]:
    """What makes the contrast of each window 1."""
    variance = _mean(pixels * pixels) - mean * mean
    return np.asarray(1 / np.sqrt(np.maximum(variance, _LEAST_VARIANCE)), np.float32)

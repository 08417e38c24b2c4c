"""Which matches of a pair are the only ones: repeated texture looks the same a period further on.

Semi-global matching decides such places by their surroundings, and where those are repeated as well, by
noise. Whole walls and fences then agree, from left and from right, on a multiple of the period.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask

LEAD = 0.05
"""How much better the match must correlate than any other."""

ALIKE = 0.8
"""Less correlation is not repetition: at the contour of a small object both surfaces match in part."""

_LEAST_VARIANCE = 1e-3


def unambiguous(
    left: NDArray[np.uint8], right: NDArray[np.uint8], disparity: FloatMap, span_px: tuple[float, float]
) -> Mask:
    """Where no other place correlates well and as well as the match does (NCC, equation 3.6).

    Args:
        left, right: uint8 (H, W), grey.
        disparity: float32 (H, W), px, of `left`: (x, y) is seen at (x - d, y) in `right`.
        span_px: (lo, hi) of the disparities that are compared, in whole px.

    Returns:
        bool (H, W).
    """
    from mvcodec.kernels.rival_matches import RADIUS, compare_places, window_sums

    totals, squares = np.empty((2, *left.shape), np.int32), np.empty((2, *left.shape), np.int32)
    for grey, total, square in zip((left, right), totals, squares, strict=True):
        mirrored = np.pad(grey, RADIUS, mode="reflect")
        window_sums(mirrored, np.ones_like(mirrored), total)
        window_sums(mirrored, mirrored, square)
    rows, scales = np.pad(np.arange(len(left)), RADIUS, mode="reflect"), contrast_scales(totals, squares)
    own, other = np.full((2, *left.shape), np.float32(-1))
    lowest, highest = math.floor(span_px[0]), math.ceil(span_px[1])
    compare_places(left, right, rows, totals, scales, disparity, lowest, highest, own, other)
    return np.asarray((own - other > LEAD) | (other < ALIKE))


def contrast_scales(totals: NDArray[np.int32], squares: NDArray[np.int32]) -> NDArray[np.float32]:
    """What makes the contrast of windows 1, from their sums and sums of squares."""
    from mvcodec.kernels.rival_matches import WINDOW

    pixels = WINDOW**2
    contrast = np.maximum(pixels * squares - totals * totals, np.float32(pixels**2 * _LEAST_VARIANCE))
    return np.asarray(1 / np.sqrt(contrast), np.float32)

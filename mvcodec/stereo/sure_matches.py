"""Matches of a pair that are beyond doubt, by which ranges of disparities are estimated."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask, Picture
from mvcodec.stereo.ambiguity import unambiguous
from mvcodec.stereo.consistency import drop_speckles, left_right_check
from mvcodec.stereo.sgbm import Sgbm, SgbmSettings

_CAREFUL = SgbmSettings(block_size=3, p1=8, p2=32, uniqueness_percent=10)
_WINDOW = 5
_MIN_CONTRAST = 2.5
_MIN_CORRELATION = 0.7
_MIN_PATCH_PX = 20
_MAX_GAP_BINS = 2
_REPEATED_CLUSTER = 0.3


def sure_matches(left: Picture, right: Picture, span_px: tuple[float, float]) -> tuple[FloatMap, Mask]:
    """Disparities of a pair, and where they are beyond doubt.

    Both directions agree there, and surroundings have texture, look alike in both pictures and nowhere else
    as much.

    Args:
        left, right: uint8 (H, W, 3) RGB.
        span_px: (lo, hi) of the disparities that are compared.

    Returns:
        float32 and bool (H, W): (x, y) of left is seen at (x - d, y) in right.
    """
    raw_left, raw_right = Sgbm(_CAREFUL).raw_pair(left, right, span_px)
    sure = left_right_check(*raw_left, *raw_right, partner_is_right=True)
    values = raw_left[0]
    height, width = values.shape
    levels, levels_right = (np.asarray(cv2.cvtColor(p, cv2.COLOR_RGB2GRAY), np.uint8) for p in (left, right))
    grey, grey_right = levels.astype(np.float32), levels_right.astype(np.float32)
    columns = np.arange(width, dtype=np.float32)[None] - values
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    partner = cv2.remap(grey_right, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    # Noise has contrast of its own, but no likeness in the other picture: both are asked for.
    sure &= _alike(grey, np.asarray(partner, np.float32))
    sure = drop_speckles(values, sure, _MIN_PATCH_PX)
    return values, _not_repeated(values, sure, unambiguous(levels, levels_right, values, span_px))


def _not_repeated(values: FloatMap, sure: Mask, unique: Mask) -> Mask:
    """Sure matches less ambiguous ones, but of these the many that say the same stay.

    On repeated texture the surroundings bring most of a wall to its place, and some of it a period
    beside. Without any of it the wall would be lost.
    """
    doubtful = sure & ~unique
    if not doubtful.any():
        return sure
    kept = drop_speckles(values, sure & unique, _MIN_PATCH_PX)
    bins = np.floor(values).astype(np.int64)
    first = bins[doubtful].min()
    counts = np.bincount(bins[doubtful] - first)
    runs = filled_runs(counts)
    most = max(counts[start:end].sum() for start, end in runs)
    for start, end in runs:
        if counts[start:end].sum() >= _REPEATED_CLUSTER * most:
            kept |= doubtful & (bins >= start + first) & (bins < end + first)
    return kept


def _mean(pixels: FloatMap) -> FloatMap:
    """Of each pixel's window."""
    return np.asarray(cv2.blur(pixels, (_WINDOW, _WINDOW)), np.float32)


def _variance(pixels: FloatMap) -> FloatMap:
    """Of each pixel's window."""
    mean = _mean(pixels)
    return np.asarray(_mean(pixels * pixels) - mean * mean, np.float32)


def textured_share(grey: FloatMap) -> float:
    """The share of a picture's pixels whose windows have contrast; float32 (H, W) of 0..255."""
    return float(np.mean(_variance(grey) > _MIN_CONTRAST**2))


def _alike(first: FloatMap, second: FloatMap) -> Mask:
    """Where windows of two pictures have contrast and correlate (NCC, equation 3.6)."""

    variance_a, variance_b = _variance(first), _variance(second)
    covariance = _mean(first * second) - _mean(first) * _mean(second)
    contrast = np.minimum(variance_a, variance_b) > _MIN_CONTRAST**2
    correlated = covariance > _MIN_CORRELATION * np.sqrt(np.maximum(variance_a * variance_b, 0))
    return np.asarray(contrast & correlated)


def filled_runs(bins: NDArray[np.int64]) -> list[tuple[int, int]]:
    """[start, end) of runs of filled bins, small gaps tolerated."""
    filled = np.flatnonzero(bins > 0)
    breaks = np.flatnonzero(np.diff(filled) > _MAX_GAP_BINS + 1)
    starts = filled[np.concatenate([[0], breaks + 1])]
    ends = filled[np.concatenate([breaks, [filled.size - 1]])] + 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))

"""Which disparities two maps agree on, and what stands in where they don't.

Everything here works along rows. Vertical pairs are handled by the same code on transposed
pictures (ULCC of the thesis, 6.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import cv2
import numpy as np

from mvcodec.frames import DisparityMap, FloatMap, Mask

SPECKLE_STEP_PX = 1.0
SPECK_STEP_PX, SPECK_REACH_PX = 1.5, 2
MEDIAN_SIZE, SMALL_MEDIAN_SIZE = 5, 3
FAR_TAIL, NEAR_TAIL = 5e-4, 1e-4
"""Of valid pixels, so many at either end are taken as wrong. What is near is a small thing more often."""
_SIXTEENTHS = 16
_SPECKLE_MARK = -32768


def left_right_check(
    values_px: FloatMap,
    known: Mask,
    other_px: FloatMap,
    other_known: Mask,
    *,
    partner_is_right: bool,
    tolerance_px: float = 1.0,
) -> Mask:
    """Pixels that the map of the partner confirms (equations 3.12 and 4.7 of the thesis).

    Args:
        values_px: float32 (H, W), px, sign of ALGORITHMS section 0.
        known: bool (H, W), where `values_px` holds a match at all.
        other_px, other_known: the same of the partner.
        partner_is_right: True when `values_px` is the left camera's map: its pixel x is at
            ``x - d`` in the partner, else at ``x + d``; rounded to the nearest pixel.
        tolerance_px: largest difference of the two disparities.

    Returns:
        bool (H, W); False where unknown, contradicted, or seen outside the partner's picture.
    """
    from mvcodec.kernels.table import kernel

    sign = 1 if partner_is_right else -1
    kept: Mask = kernel("matching_rows.consistent")(
        values_px, known, other_px, other_known, sign, tolerance_px
    )
    return kept


def fill_from_farther(values_px: FloatMap, valid: Mask, fallback_px: float) -> FloatMap:
    """Replace invalid runs of a row by the smaller of the valid disparities at their two ends.

    What one camera of a pair sees and the other does not is background, hence the farther one.
    Rows without any valid pixel take the values of the nearest row that has one.

    Args:
        values_px: float32 (H, W), px.
        valid: bool (H, W).
        fallback_px: for a map with no valid pixel at all.

    Returns:
        float32 (H, W), finite everywhere where the valid values are.
    """
    from mvcodec.kernels.table import kernel

    rows = np.flatnonzero(valid.any(axis=1))
    if rows.size == 0:
        return np.full_like(values_px, fallback_px)
    filled: FloatMap = kernel("matching_rows.fill_rows")(values_px, valid, fallback_px)
    if rows.size == len(values_px):
        return filled
    nearest = np.abs(np.arange(len(values_px))[:, None] - rows[None]).argmin(axis=1)
    return np.asarray(filled[rows[nearest]])


def drop_speckles(values_px: FloatMap, valid: Mask, min_area_px: int) -> Mask:
    """Valid pixels less those in smooth patches smaller than `min_area_px` pixels."""
    if min_area_px <= 1:
        return valid
    offset = values_px[valid].min() if valid.any() else 0.0
    scaled = np.rint((values_px - offset) * _SIXTEENTHS).clip(0, 32767)
    marked = np.where(valid, scaled, _SPECKLE_MARK).astype(np.int16)
    cv2.filterSpeckles(marked, _SPECKLE_MARK, min_area_px, int(SPECKLE_STEP_PX * _SIXTEENTHS))
    return np.asarray(marked != _SPECKLE_MARK)


def confirmed_range(
    maps: Iterable[tuple[FloatMap, Mask]], range_px: tuple[float, float]
) -> tuple[float, float]:
    """The part of a range, px, in which the valid pixels of maps lie, less FAR_TAIL and NEAR_TAIL of them.

    Args:
        maps: float32 (H, W), px, and bool (H, W) each.
        range_px: all values lie inside; it is returned where no pixel is valid.
    """
    low = math.floor(range_px[0])
    levels = math.ceil(range_px[1]) - low + 1
    counts = np.zeros(levels)
    for values, valid in maps:
        shown = valid.view(np.uint8)
        counts += cv2.calcHist([values], [0], shown, [levels], [low - 0.5, low + levels - 0.5]).ravel()
    upwards = np.cumsum(counts)
    if not upwards[-1]:
        return range_px
    first = np.searchsorted(upwards, FAR_TAIL * upwards[-1], "right")
    last = np.searchsorted(upwards, (1 - NEAR_TAIL) * upwards[-1])
    return max(range_px[0], float(low + first)), min(range_px[1], float(low + last))


def without_specks(values_px: FloatMap, fewest: int) -> FloatMap:
    """A map whose pieces of fewer than `fewest` pixels are as what is around them, see `specks.smooth_over`.

    Pieces with a gap of one pixel between them are one: wires break into such.
    """
    from mvcodec.kernels.table import kernel

    smooth = np.array(values_px, order="C")
    pieces = np.ascontiguousarray(values_px), SPECK_STEP_PX, SPECK_REACH_PX, fewest, smooth
    kernel("specks.smooth_over")(*pieces, 0, len(smooth))
    return smooth


def cross_check(
    left: tuple[FloatMap, Mask],
    right: tuple[FloatMap, Mask],
    range_px: tuple[float, float],
    *,
    tolerance_px: float = 1.0,
    speckle_area_px: int = 0,
    median_size: int = MEDIAN_SIZE,
) -> tuple[DisparityMap, DisparityMap]:
    """From two raw maps of a pair to two finished ones: check, specks out, fill, median.

    Args:
        left, right: (values, known) of either camera, as in `left_right_check`.
        range_px: the values are clipped to it.
        tolerance_px: of the check.
        speckle_area_px: smaller consistent patches are taken as mismatches.
        median_size: odd window, or 0 for none. 3 and 5 are exact; larger ones go through 8 bits.
    """
    checked = (
        left_right_check(*left, *right, partner_is_right=True, tolerance_px=tolerance_px),
        left_right_check(*right, *left, partner_is_right=False, tolerance_px=tolerance_px),
    )
    first, second = (
        _finish(values.clip(*range_px), drop_speckles(values, valid, speckle_area_px), range_px, median_size)
        for (values, _), valid in zip((left, right), checked, strict=True)
    )
    return first, second


def median(values_px: FloatMap, size: int, range_px: tuple[float, float]) -> FloatMap:
    """Median of a size x size window (borders repeated).

    OpenCV's takes float32 up to 5 x 5; larger windows run on the range spread over 8 bits.
    """
    if size <= 1:
        return values_px
    if size <= 5:
        return np.asarray(cv2.medianBlur(values_px, size), np.float32)
    low, high = range_px
    step = max(high - low, 1e-6) / 255
    codes = np.rint((values_px - low) / step).clip(0, 255).astype(np.uint8)
    smooth = cv2.medianBlur(codes, size).astype(np.float32) * np.float32(step) + np.float32(low)
    return np.asarray(smooth.clip(low, high))


def median_but_thin(
    values_px: FloatMap,
    firm: Mask,
    size: int,
    limits_px: tuple[float, float],
    range_px: tuple[float, float],
) -> FloatMap:
    """The median, but poles and wires that it would take away stay where they are firm.

    Of what is that thin, a smaller median leaves what is wider than one pixel. At the contours of what is
    left the median has its way: there it is noise that stands out.

    Args:
        values_px: float32 (H, W), px.
        firm: bool (H, W), where they may stay.
        size: of the median's window, see `median`.
        limits_px: how much nearer than the larger median the smaller one must leave a pixel, and a pixel must
            be than all that is left around it.
        range_px: see `median`.
    """
    nearer_px, thin_px = limits_px
    smooth = median(values_px, size, range_px)
    if size > SMALL_MEDIAN_SIZE:
        finer = median(values_px, SMALL_MEDIAN_SIZE, range_px)
        smooth = np.where(firm & (finer - smooth > nearer_px), finer, smooth)
    around = np.asarray(cv2.dilate(smooth, np.ones((3, 3), np.uint8)), np.float32)
    return np.where(firm & (values_px - around > thin_px), values_px, smooth)


def _finish(values: FloatMap, valid: Mask, range_px: tuple[float, float], median_size: int) -> DisparityMap:
    filled = fill_from_farther(values, valid, range_px[0])
    return DisparityMap(median(filled, median_size, range_px), valid)

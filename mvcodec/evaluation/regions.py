"""Regions that a disparity map is scored over: pixels that both cameras see, all, and those near depth edges.

After Scharstein and Szeliski (A taxonomy and evaluation of dense two-frame stereo correspondence algorithms,
IJCV 47, 2002), whose benchmark the thesis's table 5.2 is from.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from mvcodec.errors import SettingError
from mvcodec.evaluation.metrics import bad_pixel_rate
from mvcodec.frames import DisparityMap, FloatMap, Mask

AGREEMENT_PX = 1.0
GAP_PX = 2.0
"""Neighbours whose truth differs by more lie on either side of a depth edge."""

NEAR_EDGE_PX = 9
"""Side of the square around a depth edge."""


@dataclass(frozen=True, slots=True, eq=False)
class Regions:
    """Where a map is scored; each is part of what has known truth.

    Attributes:
        truth_px: float32 (H, W), px of the pair's baseline.
        non_occluded: bool (H, W), both cameras see the point.
        all: bool (H, W), truth is known.
        discontinuity: bool (H, W), non-occluded and near a depth edge.
    """

    truth_px: FloatMap
    non_occluded: Mask
    all: Mask
    discontinuity: Mask


@dataclass(frozen=True, slots=True)
class BadPixels:
    """Shares (0..1) of the pixels of each region whose error exceeds a threshold."""

    non_occluded: float
    all: float
    discontinuity: float


def regions(truth: DisparityMap, partner: DisparityMap | None = None) -> Regions:
    """The regions of a left picture.

    Args:
        truth: of the left picture, px of the pair's baseline; valid where it is known.
        partner: truth of the right picture, where there is one: a pixel is non-occluded when the two agree
            within 1 px. Without it, a pixel is occluded when one that is nearer by more than 1 px
            lands within 1 px of its target in the right picture, or when it leaves that picture.

    Raises:
        SettingError: the maps differ in size.
    """
    if partner is None:
        seen = _unhidden(truth)
    elif partner.values_px.shape == truth.values_px.shape:
        seen = _confirmed(truth, partner)
    else:
        found = f"{truth.values_px.shape} and {partner.values_px.shape}"
        raise SettingError("regions", found, "truth maps of equal size")
    return Regions(truth.values_px, seen, truth.valid, seen & near_edges(truth))


def bad_pixels(scored: Regions, estimate_px: FloatMap, threshold_px: float = 1.0) -> BadPixels:
    """Bad-pixel rates of a map over the three regions.

    Args:
        estimate_px: float32 (H, W), px of the same baseline as the truth.
        threshold_px: 0.5, 1 and 2 are usual; an error of exactly this size still counts as good.

    Raises:
        SettingError: the map has another size, or a region has no pixel.
    """
    return BadPixels(
        *(
            bad_pixel_rate(scored.truth_px, region, estimate_px, threshold_px)
            for region in (scored.non_occluded, scored.all, scored.discontinuity)
        )
    )


def near_edges(disparity: DisparityMap) -> Mask:
    """Where known neighbours differ by more than 2 px, and 4 px around: bool (H, W).

    Args:
        disparity: px; only gaps between valid pixels count.
    """
    edges = np.zeros(disparity.valid.shape, np.uint8)
    for axis in (0, 1):
        gaps = np.abs(np.diff(disparity.values_px, axis=axis)) > GAP_PX
        both_known = np.diff(disparity.valid.astype(np.int8), axis=axis) == 0
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        gaps &= both_known & disparity.valid[tuple(after)]
        edges[tuple(before)] |= gaps
        edges[tuple(after)] |= gaps
    return np.asarray(cv2.dilate(edges, np.ones((NEAR_EDGE_PX, NEAR_EDGE_PX), np.uint8)) > 0)


def _confirmed(truth: DisparityMap, partner: DisparityMap) -> Mask:
    width = truth.values_px.shape[1]
    targets = np.floor(np.arange(width) - truth.values_px + 0.5).astype(np.int64)
    inside = (targets >= 0) & (targets < width)
    places = np.arange(len(targets))[:, None], targets.clip(0, width - 1)
    agree = np.abs(truth.values_px - partner.values_px[places]) <= AGREEMENT_PX
    return np.asarray(truth.valid & inside & partner.valid[places] & agree)


def _unhidden(truth: DisparityMap) -> Mask:
    width = truth.values_px.shape[1]
    targets = np.arange(width) - truth.values_px
    seen = truth.valid & (targets >= -0.5) & (targets < width - 0.5)
    for row, (target, nearness, known) in enumerate(zip(targets, truth.values_px, truth.valid, strict=True)):
        # Every pixel of the row (down) against every known one (across).
        close = np.abs(target[:, None] - target[known]) <= AGREEMENT_PX
        nearer = nearness[known] > nearness[:, None] + AGREEMENT_PX
        seen[row] &= ~(close & nearer).any(axis=1)
    return np.asarray(seen)

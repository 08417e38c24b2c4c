"""What DILS and linear interpolation share: forward mapping of one pair and filling along rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import DisparityMap, Mask
from mvcodec.synthesis.mlvs import View


def forward_pair(
    left: View,
    right: View,
    *,
    shift_px: NDArray[np.int32],
    right_shift_px: NDArray[np.int32],
    nearness: NDArray[np.float32],
    usable: Mask,
    left_weight: float,
    fill_holes: bool,
) -> View:
    """Move the left picture's pixels to the virtual view, nearest last, blended with the right one's.

    Args:
        shift_px: int32 (H, W), by pixel of the left picture: x moves to ``x - shift_px``.
        right_shift_px: int32 (H, W): x is at ``x - right_shift_px`` in the right picture.
        nearness: float32 (H, W); where several pixels land on one place the largest stays.
        usable: bool (H, W); the other pixels of the left picture are skipped.
        left_weight: share of the left picture where both show the point.
        fill_holes: copy the nearest pixel of the row into holes; else they stay black.

    Returns:
        The view. Its disparity is filled along the row in any case (in a row of holes alone it is the left
        view's), and valid where there is a pixel, a filled one or not: the next level of MLVS works on
        filled pictures as on others, else the strips that no pair covers would stay black.
    """
    from mvcodec.kernels import pair_rows

    source = pair_rows.forward_sources(shift_px, nearness, usable)
    pixels, disparity, seen_by = pair_rows.blend_pair(
        np.ascontiguousarray(left.pixels),
        np.ascontiguousarray(right.pixels),
        left.disparity.values_px,
        left.seen_by,
        right.seen_by,
        source,
        right_shift_px,
        left_weight,
    )
    nearest = pair_rows.nearest_known(source >= 0)
    filled, disparity = pair_rows.filled_along_rows(pixels, disparity, nearest)
    if fill_holes:
        return View(filled, DisparityMap(disparity, nearest >= 0), seen_by)
    return View(pixels, DisparityMap(disparity, source >= 0), seen_by)

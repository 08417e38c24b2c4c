"""One map for a camera from the maps that its several partners gave it."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from mvcodec.frames import DisparityMap, FloatMap, Picture

_NOISE_LEVELS = 2.0


def fuse(
    candidates: Sequence[DisparityMap],
    weights: Sequence[FloatMap] | None = None,
    tolerance_px: float = 1.0,
) -> DisparityMap:
    """Fuse maps of one camera, all for the same baseline, by the weightiest agreeing group.

    In each pixel the valid candidates vote: the group within `tolerance_px` of one of its
    members that weighs most wins and is averaged by weight; between equal ones the farther,
    since false matches of an occluded pixel are mostly too near. Where no candidate is valid,
    the farthest stands.

    Args:
        candidates: one or more maps of equal shape.
        weights: float32 (H, W), positive, for each candidate (e.g. `row_texture`); None: all alike.
        tolerance_px: what counts as agreement.

    Returns:
        The fused map, valid where any candidate is.

    Raises:
        ValueError: no candidate, or not one weight map for each.
    """
    if not candidates or (weights is not None and len(weights) != len(candidates)):
        found = f"{len(candidates)} maps" + (f" and {len(weights)} weights" if weights is not None else "")
        raise ValueError(f"fuse: found {found}, expected at least one map and one weight for each")
    if len(candidates) == 1:
        return candidates[0]
    from mvcodec.kernels.table import kernel

    values = np.stack([candidate.values_px for candidate in candidates])
    valid = np.stack([candidate.valid for candidate in candidates])
    stacked = np.ones_like(values) if weights is None else np.stack(weights)
    return DisparityMap(*kernel("matching_rows.fuse_maps")(values, valid, stacked, tolerance_px))


def row_texture(picture: Picture) -> FloatMap:
    """How well matching along rows is founded: RMS luma difference along the row, 3 x 3 window.

    An edge that runs along the row matches everywhere on it, consistently; a partner in the
    other direction knows better. For vertical pairs take the transposed picture.

    Args:
        picture: uint8 (H, W, 3).

    Returns:
        float32 (H, W), grey levels over two pixels, at least 2 (the noise).
    """
    luma = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    slope = cv2.Sobel(luma, cv2.CV_32F, 1, 0, ksize=1)
    return np.asarray(np.sqrt(cv2.blur(slope * slope, (3, 3)) + _NOISE_LEVELS**2), np.float32)

"""One map for a camera from the maps that its several partners gave it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvcodec.frames import DisparityMap


def fuse(candidates: Sequence[DisparityMap], tolerance_px: float = 1.0) -> DisparityMap:
    """Fuse maps of one camera, all for the same baseline, by the largest agreeing group.

    In each pixel the valid candidates vote: the largest group within `tolerance_px` of one of
    its members wins and is averaged; between groups of one size the farther wins, since false
    matches of an occluded pixel are mostly too near. Where no candidate is valid, the farthest.

    Args:
        candidates: one or more maps of equal shape.
        tolerance_px: what counts as agreement.

    Returns:
        The fused map, valid where any candidate is.

    Raises:
        ValueError: no candidate.
    """
    if not candidates:
        raise ValueError("fuse: found no candidate, expected at least one map")
    if len(candidates) == 1:
        return candidates[0]
    from mvcodec.kernels.matching_rows import fuse_maps  # noqa: PLC0415  (Numba is slow to import)

    values = np.stack([candidate.values_px for candidate in candidates])
    valid = np.stack([candidate.valid for candidate in candidates])
    return DisparityMap(*fuse_maps(values, valid, tolerance_px))

"""Where surfaces end: over plain ground a pixel beyond their edge, where partners see it move with them.

Views are fetched with less trust at contours of maps, and never across them. A contour right at the foot of a
soft edge spoils it; where the ground is plain, a contour one pixel further out costs nothing.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap
from mvcodec.stereo.matching_view import CameraPartners

SURFACE_STEP_PX = 1.5
PLAIN_PX = 3
"""So many pixels of the farther surface must look alike: where it has detail, that would be torn off it."""
MISFIT_SHARE = 0.5


def widen(
    disparity: FloatMap, greys: NDArray[np.uint8], those: CameraPartners, plain_levels: int
) -> FloatMap:
    """A map whose surfaces reach a pixel further over plain ground, where partners see their edge move so.

    Args:
        disparity: float32 (H, W), px.
        greys: uint8 (N, H, W), of all cameras.
        those: the map's camera and its partners.
        plain_levels: grey levels below which pixels look alike; 0: nothing changes.
    """
    from mvcodec.kernels.table import kernel

    if not plain_levels:
        return disparity
    found = np.array(disparity, np.float32, order="C")
    kernel("contours.widen")(
        np.ascontiguousarray(disparity, np.float32),
        np.asarray(cv2.dilate(disparity, np.ones((3, 3), np.uint8)), np.float32),
        greys,
        those.camera,
        those.partners,
        those.steps,
        SURFACE_STEP_PX,
        PLAIN_PX,
        plain_levels,
        MISFIT_SHARE,
        found,
    )
    return found

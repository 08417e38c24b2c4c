"""Sub-pixel refinement of the maps of an array by the pictures themselves (Lucas and Kanade 1981).

Aggregated matching costs place a match to about a quarter of a pixel. Around that place grey is linear
enough for a least-squares step, in which all partners that see the point have their say at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask

WINDOW_SIGMA_PX = 1.5
MOST_PX = 0.4
GREY_SCALE = 10.0
DAMPING = 20.0
SAME_SURFACE_PX = 1.0


def refine(
    disparity: FloatMap,
    valid: Mask,
    grey: FloatMap,
    partners: Sequence[tuple[FloatMap, FloatMap]],
    steps: NDArray[np.float32],
) -> FloatMap:
    """One step towards the disparity at which the partners' grey agrees best.

    Args:
        disparity: float32 (H, W), px; only its valid pixels change, by at most MOST_PX.
        valid: bool (H, W).
        grey: float32 (H, W), of the map's own camera.
        partners: (grey, disparity) of each partner, float32 (H, W). A partner counts where its own
            disparity agrees, the less the more its grey differs (GREY_SCALE levels halve it).
        steps: float32 (P, 2): a pixel of disparity d is at (x - steps[p, 0] * d, y - steps[p, 1] * d); one of
            both is 0.

    Returns:
        float32 (H, W), px.
    """
    from mvcodec.kernels.table import kernel

    pull, weight = np.zeros_like(disparity), np.zeros_like(disparity)
    for (other_grey, other_disparity), (by_x, by_y) in zip(partners, steps, strict=True):
        along_rows = bool(by_x != 0)
        slope = cv2.Sobel(other_grey, cv2.CV_32F, int(along_rows), int(not along_rows), scale=1 / 8)
        kernel("subpixel_pull.add_pull")(
            disparity,
            grey,
            other_grey,
            np.asarray(slope, np.float32),
            other_disparity,
            along_rows,
            by_x if along_rows else by_y,
            SAME_SURFACE_PX,
            GREY_SCALE,
            pull,
            weight,
        )
    windowed_pull = np.asarray(cv2.GaussianBlur(pull, (0, 0), WINDOW_SIGMA_PX), np.float32)
    windowed_weight = np.asarray(cv2.GaussianBlur(weight, (0, 0), WINDOW_SIGMA_PX), np.float32)
    change = np.clip(windowed_pull / (windowed_weight + DAMPING), -MOST_PX, MOST_PX)
    return np.asarray(disparity + np.where(valid, change, 0), np.float32)

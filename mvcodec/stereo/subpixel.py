"""Sub-pixel refinement of the maps of an array by the pictures themselves (Lucas and Kanade 1981).

Aggregated matching costs place a match to about a quarter of a pixel. Around that place grey is linear
enough for a least-squares step, in which all partners that see the point have their say at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import FloatMap, Mask
from mvcodec.stereo.partners import partners, steps
from mvcodec.workers import run_all

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


def refine_maps(
    array: CameraArray,
    greys: Mapping[Position, NDArray[np.uint8]],
    maps: Mapping[Position, FloatMap],
    valid: Mapping[Position, Mask],
    range_px: tuple[float, float],
    count: int,
    cameras: Sequence[Position] | None = None,
) -> dict[Position, FloatMap]:
    """So many steps of refinement of all maps, each from where the last one left them.

    Args:
        greys: uint8 (H, W) of each camera; maps: float32 (H, W), px; valid: bool (H, W), what may change.
        range_px: the values are clipped to it.
        cameras: whose maps are wanted: the last step is theirs alone; None: all.
    """
    smooth = {camera: grey.astype(np.float32) for camera, grey in greys.items()}
    found, wanted = dict(maps), list(maps) if cameras is None else list(cameras)
    for step in range(count):
        moving = wanted if step == count - 1 else list(found)
        moved = run_all(partial(_refined, array, smooth, found, valid), moving)
        found |= dict(zip(moving, moved, strict=True))
    return {camera: np.clip(found[camera], *range_px) for camera in wanted}


def _refined(
    array: CameraArray,
    greys: Mapping[Position, FloatMap],
    maps: Mapping[Position, FloatMap],
    valid: Mapping[Position, Mask],
    camera: Position,
) -> FloatMap:
    """One step of one camera's map, by its partners that have one."""
    beside = [partner for partner in partners(array, camera) if partner in maps]
    if not beside:
        return maps[camera]
    said = [(greys[partner], maps[partner]) for partner in beside]
    return refine(
        maps[camera],
        valid[camera],
        greys[camera],
        said,
        steps(array, camera, beside),
    )

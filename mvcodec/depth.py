"""Disparity -> metric depth and points in space, by the calibration."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray
from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.frames import DecodedSet, FloatMap

MAX_MM = 65535

MOST_BEHIND = 0.5
"""Where more of the pixels have no depth, that is told."""


def require_calibration(array: CameraArray, nominal: bool) -> None:
    """Raise SettingError where an array has no calibration and nobody accepts the nominal one."""
    if not (array.calibration.given or nominal):
        expected = "one in the input or by `calibration`, or `nominal` to accept nominal values"
        raise SettingError("calibration", "none given", expected)


def depth_m(array: CameraArray, values_px: FloatMap) -> FloatMap:
    """Depth along the optical axis of each pixel of a disparity map.

    ``Z = f * B / (d - d_inf)``, f, B and d_inf being those of a cell (see FORMAT.md).

    Args:
        values_px: float32 (H, W), px for the baseline of one cell.

    Returns:
        float32 (H, W), metres; infinite where the disparity is that of infinity or less.
    """
    calibration, steps = array.calibration, array.baseline_steps
    focal_px = calibration.fx_px if array.cols > 1 else calibration.fy_px
    shift_px = values_px - np.float32(calibration.d_inf_px_per_step * steps)
    near = shift_px > 0
    scale = np.float32(focal_px * calibration.baseline_m * steps)
    depth = np.full_like(values_px, np.inf)
    np.divide(scale, shift_px, out=depth, where=near)
    return depth


def depth_mm(array: CameraArray, values_px: FloatMap) -> NDArray[np.uint16]:
    """`depth_m` in whole millimetres: uint16 (H, W); 0 where it is more than 65.535 m."""
    millimetres = np.rint(depth_m(array, values_px) * 1000)
    return np.where(millimetres <= MAX_MM, millimetres, 0).astype(np.uint16)


def warn_behind_infinity(array: CameraArray, maps_px: Iterable[FloatMap], name: str) -> None:
    """Warn where most of what an array sees has no depth, as when left and right are swapped.

    Args:
        maps_px: disparity maps of one moment, float32 (H, W), px for the baseline of one cell.
        name: what to call the array.
    """
    shares = [float(np.mean(~np.isfinite(depth_m(array, values)))) for values in maps_px]
    share = float(np.mean(shares)) if shares else 0.0
    if share > MOST_BEHIND:
        text = (
            f"{name}: {share:.0%} of the pixels lie behind infinity and have no depth: are the cameras"
            " swapped (rows from top to bottom, columns from left to right), or is `d_inf_px_per_step` wrong?"
        )
        warnings.warn(text, MvCodecWarning, stacklevel=3)


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Points in space.

    Attributes:
        places_m: float32 (N, 3), in the rig's axes: x forward, y left, z up; view (0, 0) at the origin.
        colours: uint8 (N, 3), RGB.
    """

    places_m: NDArray[np.float32]
    colours: NDArray[np.uint8]


def points_of(decoded: DecodedSet, stride: int = 1, max_depth_m: float = np.inf) -> Points:
    """What every real camera sees, as points; cameras that are absent give none.

    Args:
        stride: every how many pixels, each way.
        max_depth_m: farther points are left out, as are those at infinity.
    """
    places, colours = [], []
    for camera, picture in decoded.pictures.items():
        if camera in decoded.absent:
            continue
        array = decoded.array
        depth = depth_m(array, decoded.disparities[camera].values_px)[::stride, ::stride]
        near = np.isfinite(depth) & (depth <= max_depth_m)
        rows, cols = np.nonzero(near)
        y, x = (axis.astype(np.float32) * stride for axis in (rows, cols))
        z = depth[near]
        c = array.calibration
        right, down, forward = array.camera_position_m(camera)
        cx, cy = array.principal_point_px(camera)
        to_right = (x - np.float32(cx)) * z / np.float32(c.fx_px) + np.float32(right)
        downwards = (y - np.float32(cy)) * z / np.float32(c.fy_px) + np.float32(down)
        places.append(np.stack([z + np.float32(forward), -to_right, -downwards], axis=1))
        colours.append(picture[::stride, ::stride][near])
    return Points(np.concatenate(places).astype(np.float32), np.concatenate(colours))

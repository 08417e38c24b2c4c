"""What a stage hands to the next. Pixels travel with their time; units are in the names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint

Picture = NDArray[np.uint8]
"""uint8 (H, W, 3), RGB."""

FloatMap = NDArray[np.float32]
"""float32 (H, W)."""

Mask = NDArray[np.bool_]
"""bool (H, W)."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameSet:
    """The pictures that the cameras took at one time.

    Attributes:
        index: frame number in the input (kept when only a range of it is coded).
        time_ns: capture time, integer nanoseconds.
        pictures: uint8 (H, W, 3) RGB by grid position.
        given: disparity that the input itself has, by grid position, for the baseline of one cell, px of
            the pictures; at their size or smaller in proportion.
    """

    index: int
    time_ns: int
    pictures: Mapping[Position, Picture]
    given: Mapping[Position, DisparityMap] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class DisparityMap:
    """Disparity of one real camera, for the horizontal baseline of one cell (sign: ALGORITHMS 0).

    Attributes:
        values_px: float32 (H, W), px; larger = nearer; may be negative; finite everywhere.
        valid: bool (H, W); False where the value is a guess (occluded or inconsistent).
    """

    values_px: FloatMap
    valid: Mask


@dataclass(frozen=True, slots=True, eq=False)
class LayerStack:
    """A disparity map split into depth layers (DILS).

    Attributes:
        bounds_px: (d_min, d_max) of each layer, inclusive integers, farthest first.
        labels: uint16 (H, W); 0 = occluded, i = bounds_px[i - 1].
    """

    bounds_px: tuple[tuple[int, int], ...]
    labels: NDArray[np.uint16]


@dataclass(frozen=True, slots=True, eq=False)
class FinishedView:
    """A virtual view out of an enhancement layer.

    Attributes:
        pixels: uint8 (H, W, 3) RGB, as decoded.
        disparity_px: float32 (H, W), px of one cell's baseline.
    """

    pixels: Picture
    disparity_px: FloatMap


@dataclass(frozen=True, slots=True, eq=False)
class DecodedSet:
    """One decoded frame set: what a synthesizer needs.

    Attributes:
        array: the geometry.
        index, time_ns: as in FrameSet.
        pictures: uint8 (H, W, 3) RGB by real camera.
        disparities: by real camera.
        disparity_range_px: (lo, hi) that the maps can hold.
        absent: real cameras that sent nothing usable; their pictures and maps are made from the others'.
        enhanced: virtual views out of the stream's enhancement layer; those that were asked for.
        coding_error: mean squared error of luma that coding left in each real camera's picture, grey levels
            squared, independent of the other cameras'; None: not known.
    """

    array: CameraArray
    index: int
    time_ns: int
    pictures: Mapping[Position, Picture]
    disparities: Mapping[Position, DisparityMap]
    disparity_range_px: tuple[float, float]
    absent: tuple[Position, ...] = ()
    enhanced: Mapping[Position, FinishedView] = field(default_factory=dict)
    coding_error: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """A synthesised picture.

    Attributes:
        viewpoint: where it was taken from.
        pixels: uint8 (H, W, 3) RGB.
        disparity_px: float32 (H, W) at the viewpoint, px of one cell's baseline.
        seen_by: uint8 (H, W), how many real cameras contributed; 0 = filled.
    """

    viewpoint: Viewpoint
    pixels: Picture
    disparity_px: FloatMap
    seen_by: NDArray[np.uint8]

"""Maps that the input already has, measured or rendered, made whole: enlarged and filled along edges."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mvcodec.array import CameraArray, Position
from mvcodec.errors import InputError, MvCodecWarning
from mvcodec.frames import DisparityMap, FloatMap, FrameSet, Mask, Picture
from mvcodec.settings import setting
from mvcodec.stream import view_name

_TOLD_SHARE = 0.001


@dataclass(frozen=True, slots=True)
class GivenSettings:
    """How maps are made whole. What each means stands in its field's help."""

    edge_cost: float = setting(
        0.5, "px of distance that a grey level of the picture counts as, where gaps are filled", low=0
    )
    agree_px: float = setting(
        1.0, "samples of a smaller map that differ by less are one surface, px of disparity", low=0
    )


class Given:
    """A matcher that takes the maps of each frame set as they came in (`FrameSet.given`)."""

    def __init__(self, settings: GivenSettings | None = None) -> None:
        self.settings = settings or GivenSettings()
        self._told = False

    def match(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],  # noqa: ARG002
        range_px: tuple[float, float],  # noqa: ARG002
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`; pictures alone have no maps.

        Raises:
            InputError: always.
        """
        raise InputError(array.name or "the array", "pictures alone", "disparity or depth, for matcher given")

    def match_frames(
        self, array: CameraArray, frames: FrameSet, range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `FrameMatcher.match_frames`.

        Raises:
            InputError: a real camera has no map, or one without a valid pixel.
        """
        found = {}
        for camera in array.real:
            where = f"frame {frames.index}, view {view_name(camera)}"
            disparity = frames.given.get(camera)
            if disparity is None:
                raise InputError(where, "no disparity or depth in the input", "a map, for matcher given")
            if not disparity.valid.any():
                raise InputError(where, "a map without a valid pixel", "one at least")
            found[camera] = whole_map(disparity, frames.pictures[camera], self.settings)
        self._tell_cut_off(found, frames, range_px)
        return {c: DisparityMap(np.clip(item.values_px, *range_px), item.valid) for c, item in found.items()}

    def _tell_cut_off(
        self, maps: Mapping[Position, DisparityMap], frames: FrameSet, range_px: tuple[float, float]
    ) -> None:
        low, high = range_px
        outside = [np.mean((item.values_px < low) | (item.values_px > high)) for item in maps.values()]
        if max(outside) > _TOLD_SHARE and not self._told:
            self._told = True
            text = (
                f"frame {frames.index}: {max(outside):.1%} of the given disparity lies outside of"
                f" {low:g}..{high:g} px and is cut off; `disparity_range_px` LO,HI makes room"
            )
            warnings.warn(text, MvCodecWarning, stacklevel=4)


def given_range(frames: Sequence[FrameSet]) -> tuple[float, float]:
    """The range of the values that some frame sets have, px, and a step more for what lies between them.

    Raises:
        InputError: none of them has a map with a valid pixel.
    """
    ends = [
        (float(disparity.values_px[disparity.valid].min()), float(disparity.values_px[disparity.valid].max()))
        for frame_set in frames
        for disparity in frame_set.given.values()
        if disparity.valid.any()
    ]
    if not ends:
        raise InputError("the input", "no disparity or depth", "maps in it, for matcher given")
    return math.floor(min(low for low, _ in ends)) - 1.0, math.ceil(max(high for _, high in ends)) + 1.0


def whole_map(
    disparity: DisparityMap, picture: Picture, settings: GivenSettings | None = None
) -> DisparityMap:
    """A map at the size of its picture with a value everywhere.

    A smaller map is enlarged bilinearly on surfaces; at their edges, and in holes, each pixel takes the
    value of the known one that is nearest by a distance that grows across the picture's edges (see
    `kernels.geodesic.carry`).

    Args:
        disparity: of the picture's size or smaller, px of the picture's size.
        picture: uint8 (H, W, 3) RGB.

    Returns:
        float32 (H, W); valid where a value was measured or lies between such of one surface.
    """
    from mvcodec.kernels.table import kernel

    settings = settings or GivenSettings()
    height, width = picture.shape[:2]
    if disparity.values_px.shape == (height, width):
        values, known = disparity.values_px.copy(), disparity.valid
        valid = known
    else:
        values, known, valid = _enlarged(disparity, (width, height), settings.agree_px)
    if not known.all():
        planes = np.ascontiguousarray(picture.transpose(2, 0, 1), np.float32)
        kernel("geodesic.carry")(planes, np.ascontiguousarray(known), settings.edge_cost, 1.0, values)
    return DisparityMap(values, valid)


def _enlarged(disparity: DisparityMap, size: tuple[int, int], agree_px: float) -> tuple[FloatMap, Mask, Mask]:
    """Values, where they are known for filling, and where they are sure."""
    width, height = size
    small, here = disparity.values_px, disparity.valid
    around = np.ones((3, 3), np.uint8)
    low = cv2.erode(np.where(here, small, np.float32(np.inf)), around)
    high = cv2.dilate(np.where(here, small, np.float32(-np.inf)), around)
    all_there = cv2.erode(here.astype(np.uint8), around).astype(bool)
    surface = all_there & (high - low <= agree_px)
    values = np.asarray(
        cv2.resize(np.where(here, small, 0), size, interpolation=cv2.INTER_LINEAR), np.float32
    )
    # Where a sample stands in the large picture, and which one each pixel belongs to.
    rows, cols = (
        np.minimum((np.arange(count) * there) // count, there - 1)
        for count, there in zip((height, width), small.shape, strict=True)
    )
    sure = surface[rows[:, None], cols]
    centre_rows, centre_cols = (
        ((2 * np.arange(there) + 1) * count) // (2 * there)
        for count, there in zip((height, width), small.shape, strict=True)
    )
    known = sure.copy()
    places = np.ix_(centre_rows, centre_cols)
    known[places] |= here
    values[places] = np.where(here, small, values[places])
    return values, known, sure

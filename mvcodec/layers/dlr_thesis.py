"""Depth Layer Refinement as chapter 5 of the thesis describes it, step by step.

Each DILS layer of the map is fused with the edge map of the picture and cleaned by morphology (figure 5.5),
then the layers are laid over each other, far to near (figure 5.9). The thesis gives no sizes and leaves open
what is connected by a convex hull; here it is each connected object of a layer. For what serves the map
better see `mvcodec.layers.dlr`.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from mvcodec.frames import DisparityMap, Mask, Picture
from mvcodec.layers.dils_split import THRESHOLD, average_px
from mvcodec.layers.picture_segments import edge_map
from mvcodec.layers.splits import LAYER_SPLITS
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.consistency import fill_from_farther


@dataclass(frozen=True, slots=True)
class ThesisDlrSettings:
    """Settings of the thesis's DLR.

    Raises:
        SettingError: a setting is outside its range.
    """

    split: str = setting("runs", "how a map is split into layers; runs: the thesis's", choices=LAYER_SPLITS)
    threshold: int = setting(THRESHOLD, "T of the split (equation 4.9), pixels", low=0)
    erosion: int = setting(
        3,
        "side of the square of an erosion that specks do not survive, px",
        choices=range(1, 102, 2),
        expected="an odd number 1..101",
    )
    smoothing: int = setting(
        5,
        "side of the median that smooths a layer's mask, px",
        choices=range(1, 102, 2),
        expected="an odd number 1..101",
    )

    def __post_init__(self) -> None:
        check_settings(self, "ThesisDlrSettings.")


def refine(
    picture: Picture, disparity: DisparityMap, *, settings: ThesisDlrSettings | None = None
) -> DisparityMap:
    """Refine the map of a picture.

    Args:
        picture: uint8 (H, W, 3) RGB, the camera's.
        disparity: of the camera; the thesis's is a median-filtered map of one direction, unchecked. Invalid
            pixels are in no layer.
        settings: the thesis's by default.

    Returns:
        The refined map, within the values of the given one; valid where the value is the pixel's own, not
        one that was filled in.
    """
    settings = settings or ThesisDlrSettings()
    values = disparity.values_px
    layers = LAYER_SPLITS[settings.split](disparity, settings.threshold)
    edges = edge_map(picture)
    composed, known, own = values.copy(), np.zeros_like(disparity.valid), np.zeros_like(disparity.valid)
    for number, bounds_px in enumerate(layers.bounds_px, start=1):
        mask = layers.labels == number
        refined = refine_layer(mask, edges, settings)
        # Zero pixels inside of a layer's boundary take the value of the layer (5.3.3).
        composed[refined] = np.where(mask, values, np.float32(average_px(bounds_px)))[refined]
        known |= refined
        own = np.where(refined, mask, own)
    if not known.any():
        return disparity
    lowest, highest = values.min(), values.max()
    filled = fill_from_farther(composed, known, float(lowest)).clip(lowest, highest)
    return DisparityMap(filled, own)


def refine_layer(mask: Mask, edges: Mask, settings: ThesisDlrSettings) -> Mask:
    """Part 3 of the thesis's DLR: the new mask of one layer, bool (H, W).

    Args:
        mask: bool (H, W), the layer's pixels.
        edges: bool (H, W), the picture's edge map.
    """
    layer = mask.astype(np.uint8)
    _, objects, boxes, _ = cv2.connectedComponentsWithStats(layer, connectivity=8)
    # Edges themselves are too thin for an erosion: specks are objects of the mask that none of survives it.
    eroded = cv2.erode(layer, np.ones((settings.erosion,) * 2, np.uint8))
    survivors = np.unique(objects[eroded > 0])
    refined = np.zeros_like(layer)
    for number in survivors:
        left, top, width, height = (int(side) for side in boxes[number][:4])
        box = np.s_[top : top + height, left : left + width]
        member = np.asarray(objects[box] == number)
        boundary = _filled_hull(member & edges[box])
        inner = _without_holes(member & boundary)
        refined[box] |= _grown(inner, boundary & ~edges[box]).astype(np.uint8)
    return np.asarray(cv2.medianBlur(refined, settings.smoothing) > 0)


def _filled_hull(points: Mask) -> Mask:
    """The convex hull of the points, filled; nothing of no points."""
    hull = np.zeros(points.shape, np.uint8)
    places = cv2.findNonZero(points.astype(np.uint8))
    if places is not None:
        cv2.fillConvexPoly(hull, cv2.convexHull(places), 1)
    return hull.astype(np.bool_)


def _without_holes(mask: Mask) -> Mask:
    """The mask and all that it encloses."""
    outside = cv2.copyMakeBorder(mask.astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    cv2.floodFill(outside, None, (0, 0), 2)
    return np.asarray(outside[1:-1, 1:-1] != 2)


def _grown(inner: Mask, free: Mask) -> Mask:
    """`inner` dilated until nothing free is left beside it."""
    _, regions = cv2.connectedComponents((free | inner).astype(np.uint8), connectivity=4)
    reached = np.zeros(int(regions.max()) + 1, np.bool_)
    reached[regions[inner]] = True
    return np.asarray(reached[regions])

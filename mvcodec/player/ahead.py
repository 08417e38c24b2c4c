"""A view from ahead of the cameras' plane: what is near grows more, and hides what is behind it."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray
from mvcodec.frames import FloatMap, RenderedView

MOST = 0.1
"""1 - 1 / the most that what is nearest is enlarged by: a ninth, which keeps holes few (below 3 %)."""

OVERLAP_PX = 0.13
"""How far around its place a pixel reaches beyond half a px: enough up to a quarter of enlargement."""

SAME_SURFACE_PX = 2.0
BESIDE_PX = 31
"""How far around a hole its background is looked for."""


def move_ahead(
    view: RenderedView, array: CameraArray, range_px: tuple[float, float], share: float
) -> RenderedView:
    """A view from ahead of where another one was taken.

    Args:
        view: of any size; its disparity is px of the array's pictures.
        range_px: the least and largest disparity that there may be, px of one cell's baseline.
        share: 0..1 of the farthest that is allowed, where what is nearest is enlarged by a ninth.

    Returns:
        The view with pixels, disparity and ``seen_by`` moved; holes have 0 there and show their background.
    """
    infinity = np.float32(array.calibration.d_inf_px_per_step * array.baseline_steps)
    reach = np.float32(share * MOST / max(range_px[1] - float(infinity), 1e-3))
    near = _moved(view.disparity_px, reach, infinity)
    holes = np.isneginf(near)
    near[holes] = np.inf
    background = np.asarray(cv2.erode(near, np.ones((BESIDE_PX, BESIDE_PX))), np.float32)  # the least around
    near[holes] = np.where(np.isfinite(background), background, infinity)[holes]
    columns, rows = _grid(near.shape)
    shrunk = 1 - np.minimum(reach * (near - infinity), np.float32(MOST))
    x, y = (_from_middle(columns) * shrunk, _from_middle(rows) * shrunk)
    x += (near.shape[1] - 1) / 2
    y += (near.shape[0] - 1) / 2
    moved = cv2.remap(view.pixels, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    pixels = np.asarray(moved, np.uint8)
    seen_by = cv2.remap(view.seen_by, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    seen_by[holes] = 0
    if holes.any():
        pixels = _filled(pixels, holes, near, background)
    return replace(view, pixels=pixels, disparity_px=near, seen_by=np.asarray(seen_by, np.uint8))


def _moved(disparity_px: FloatMap, reach: np.float32, infinity: np.float32) -> FloatMap:
    """Where each pixel is seen from ahead, the nearest in front; -inf where none is."""
    height, width = disparity_px.shape
    columns, rows = _grid(disparity_px.shape)
    grown = 1 / (1 - np.minimum(reach * (disparity_px - infinity), np.float32(MOST)))
    x = _from_middle(columns) * grown + (width - 1) / 2
    y = _from_middle(rows) * grown + (height - 1) / 2
    near = np.full(height * width, -np.inf, np.float32)
    for down in (0.5 - OVERLAP_PX, 0.5 + OVERLAP_PX):
        for across in (0.5 - OVERLAP_PX, 0.5 + OVERLAP_PX):
            row, column = np.floor(y + down).astype(np.intp), np.floor(x + across).astype(np.intp)
            inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
            np.maximum.at(near, row[inside] * width + column[inside], disparity_px[inside])
    return near.reshape(height, width)


def _filled(
    pixels: NDArray[np.uint8], holes: NDArray[np.bool_], near: FloatMap, background: FloatMap
) -> NDArray[np.uint8]:
    """Holes, and what lies beside them, take the colour of the nearest pixel of their background."""
    behind = near <= background + SAME_SURFACE_PX
    around = np.ones((3, 3))
    beside = cv2.dilate((~behind | holes).astype(np.uint8), around).astype(np.bool_)  # fetches mix both
    sources = behind & ~beside
    holes = cv2.dilate(holes.astype(np.uint8), around).astype(np.bool_) & behind
    if not sources.any():
        return pixels
    _, labels = cv2.distanceTransformWithLabels(
        (~sources).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    places = np.zeros(int(labels.max()) + 1, np.intp)
    places[labels[sources]] = np.flatnonzero(sources)
    pixels[holes] = pixels.reshape(-1, 3)[places[labels[holes]]]
    return pixels


def _grid(shape: tuple[int, ...]) -> tuple[FloatMap, FloatMap]:
    columns = np.arange(shape[1], dtype=np.float32)[None, :]
    return columns, np.arange(shape[0], dtype=np.float32)[:, None]


def _from_middle(places: FloatMap) -> FloatMap:
    return np.asarray(places - np.float32((places.size - 1) / 2), np.float32)

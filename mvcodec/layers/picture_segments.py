"""Segments and edges of a picture, for chapter 5 of the thesis: depth is taken to change at edges only.

Segments are those of mean-shift filtering (Comaniciu and Meer 2002); edges are the segments' borders where
Canny's detector (1986) finds one too, after sharpening (figure 5.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask, Picture

_SPATIAL_RADIUS = 5
_COLOUR_RADIUS = 7
_STEP = 5
"""Neighbours whose filtered colours differ by more, in any channel of CIE L*a*b* of 8 bits, lie apart."""

_LEAST_SIZE = 3
_SHARPEN, _SHARPEN_SIGMA = 0.5, 1.5
_CANNY = 80, 160


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """A picture in pieces.

    Attributes:
        labels: int32 (H, W), 0 .. count - 1.
        count: of segments.
        row_edges: float32 (H, W), strength of the edge between (y, x - 1) and (y, x), grey levels; 0 = none.
        column_edges: float32 (H, W), that between (y - 1, x) and (y, x).
    """

    labels: NDArray[np.int32]
    count: int
    row_edges: FloatMap
    column_edges: FloatMap


def split_picture(picture: Picture) -> Segments:
    """Split a picture along the borders of its colours.

    Args:
        picture: uint8 (H, W, 3) RGB.
    """
    labels, row_steps, column_steps = _mean_shift(picture)
    edges = _widened(_canny(_sharpened(picture)))
    return Segments(labels, int(labels.max()) + 1, row_steps * edges, column_steps * edges)


def edge_map(picture: Picture) -> Mask:
    """The thesis's edge map (figure 5.3): Canny AND borders of mean-shift segments, both after sharpening.

    The two place an edge up to a pixel apart, so edges within a pixel of a border count.

    Args:
        picture: uint8 (H, W, 3) RGB.

    Returns:
        bool (H, W).
    """
    sharpened = _sharpened(picture)
    labels, _, _ = _mean_shift(sharpened)
    borders = np.zeros(labels.shape, np.bool_)
    borders[:, 1:] |= labels[:, 1:] != labels[:, :-1]
    borders[1:] |= labels[1:] != labels[:-1]
    return _canny(sharpened) & _widened(borders)


def _mean_shift(picture: Picture) -> tuple[NDArray[np.int32], FloatMap, FloatMap]:
    """Labels of the segments, and the steps of the filtered colours along rows and along columns."""
    colours = cv2.cvtColor(picture, cv2.COLOR_RGB2LAB)
    filtered = cv2.pyrMeanShiftFiltering(colours, _SPATIAL_RADIUS, _COLOUR_RADIUS, maxLevel=1)
    row_steps, column_steps = (_steps(filtered.astype(np.float32), axis) for axis in (1, 0))
    labels = _without_small(_connected(row_steps <= _STEP, column_steps <= _STEP))
    return labels, row_steps, column_steps


def _sharpened(picture: Picture) -> Picture:
    blurred = cv2.GaussianBlur(picture, (0, 0), _SHARPEN_SIGMA)
    return np.asarray(cv2.addWeighted(picture, 1 + _SHARPEN, blurred, -_SHARPEN, 0), np.uint8)


def _canny(picture: Picture) -> Mask:
    return np.asarray(cv2.Canny(picture, *_CANNY) > 0)


def _widened(mask: Mask) -> Mask:
    """By a pixel to all sides."""
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)


def _steps(colours: NDArray[np.float32], axis: int) -> FloatMap:
    steps = np.zeros(colours.shape[:2], np.float32)
    steps[1 - axis :, axis:] = np.abs(np.diff(colours, axis=axis)).max(axis=2)
    return steps


def _connected(along_rows: NDArray[np.bool_], along_columns: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Label what is connected, given which pixels are joined to their left and upper neighbours."""
    height, width = along_rows.shape
    # Every second place is a pixel, those between them the joints.
    lattice = np.zeros((2 * height - 1, 2 * width - 1), np.uint8)
    lattice[::2, ::2] = 1
    lattice[::2, 1::2] = along_rows[:, 1:]
    lattice[1::2, ::2] = along_columns[1:]
    _, labels = cv2.connectedComponents(lattice, connectivity=4)
    return np.asarray(labels[::2, ::2], np.int32)


def _without_small(labels: NDArray[np.int32]) -> NDArray[np.int32]:
    """Join segments of a few pixels to their nearest neighbours; count from 0 without gaps."""
    small = np.bincount(labels.ravel())[labels] < _LEAST_SIZE
    if small.any() and not small.all():
        _, places = cv2.distanceTransformWithLabels(
            small.astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
        )
        owners = np.zeros(int(places.max()) + 1, np.int32)
        owners[places[~small]] = labels[~small]
        labels = owners[places]
    _, dense = np.unique(labels, return_inverse=True)
    return dense.reshape(labels.shape).astype(np.int32)

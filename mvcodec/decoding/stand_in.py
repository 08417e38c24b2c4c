"""A picture and a map for a real camera that is missing, from those that are there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture

_HELPERS = 4
"""Cameras that a stand-in is made from, at most; the nearest ones."""


def fill_absent(
    array: CameraArray, pictures: Mapping[Position, Picture], disparities: Mapping[Position, DisparityMap]
) -> tuple[dict[Position, Picture], dict[Position, DisparityMap]]:
    """Complete the pictures and maps of a frame set, so that every cell has all its cameras.

    A missing camera's pixels are those of the nearest cameras, moved by their disparity, the near
    ones in front; what none of them sees continues the background beside it.

    Args:
        pictures: uint8 (H, W, 3) of some real cameras, at least one.
        disparities: of the same cameras.

    Returns:
        Pictures and maps of every real camera. `valid` is False where a stand-in was continued.
    """
    whole, maps = dict(pictures), dict(disparities)
    for camera in array.real:
        if camera not in pictures:
            whole[camera], maps[camera] = _stand_in(array, camera, pictures, disparities)
    return whole, maps


def _stand_in(
    array: CameraArray,
    camera: Position,
    pictures: Mapping[Position, Picture],
    disparities: Mapping[Position, DisparityMap],
) -> tuple[Picture, DisparityMap]:
    helpers = sorted(pictures, key=lambda other: (_distance(camera, other), other))[:_HELPERS]
    pixels = np.zeros((array.height, array.width, 3), np.uint8)
    values_px = np.zeros((array.height, array.width), np.float32)
    known = np.zeros((array.height, array.width), np.bool_)
    for helper in helpers:
        moved, moved_px, seen = _moved(array, helper, camera, pictures[helper], disparities[helper].values_px)
        new = seen & ~known
        pixels[new], values_px[new] = moved[new], moved_px[new]
        known |= seen
    _continue(pixels, values_px, known)
    return pixels, DisparityMap(values_px, known)


def _distance(a: Position, b: Position) -> int:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2


def _moved(
    array: CameraArray, source: Position, target: Position, picture: Picture, values_px: FloatMap
) -> tuple[Picture, FloatMap, Mask]:
    """A camera's pixels where another camera sees them, and which of its pixels that gives."""
    right, down = array.shift_per_disparity(source, Viewpoint(*target))
    order = np.argsort(values_px, axis=None, kind="stable")  # far to near: of several, the last stays
    y, x = np.unravel_index(order, values_px.shape)
    d = values_px.ravel()[order]
    to_x, to_y = np.rint(x - right * d).astype(np.intp), np.rint(y - down * d).astype(np.intp)
    inside = (to_x >= 0) & (to_x < array.width) & (to_y >= 0) & (to_y < array.height)
    place = (to_y[inside], to_x[inside])
    moved, moved_px = np.zeros_like(picture), np.zeros_like(values_px)
    seen = np.zeros(values_px.shape, np.bool_)
    moved[place], moved_px[place], seen[place] = picture[y[inside], x[inside]], d[inside], True
    return moved, moved_px, seen


def _continue(pixels: Picture, values_px: FloatMap, known: Mask) -> None:
    """Fill what is not known, in place: along its row, from the farther of both sides."""
    height, width = known.shape
    columns = np.arange(width)
    left = np.maximum.accumulate(np.where(known, columns, -1), axis=1)
    right = np.minimum.accumulate(np.where(known, columns, width)[:, ::-1], axis=1)[:, ::-1]
    rows = np.arange(height)[:, None]
    far = np.float32(np.inf)
    of_left = np.where(left >= 0, values_px[rows, np.maximum(left, 0)], far)
    of_right = np.where(right < width, values_px[rows, np.minimum(right, width - 1)], far)
    source = np.where(of_left <= of_right, np.maximum(left, 0), np.minimum(right, width - 1))
    filled = (rows + np.zeros_like(source), source)
    hole: NDArray[np.bool_] = ~known
    pixels[hole], values_px[hole] = pixels[filled][hole], values_px[filled][hole]
    empty = ~known.any(axis=1)
    if empty.any() and not empty.all():
        full_rows = np.flatnonzero(~empty)
        nearest = full_rows[np.abs(full_rows[None] - np.flatnonzero(empty)[:, None]).argmin(axis=1)]
        pixels[empty], values_px[empty] = pixels[nearest], values_px[nearest]

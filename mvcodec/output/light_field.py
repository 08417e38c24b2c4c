"""Pictures made of many views of one moment: refocused ones, epipolar slices, quilts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Picture, RenderedView
from mvcodec.output.mosaic import mosaic

QUILT_SIZE = (4096, 4096)
"""(width, height) px that a quilt doesn't exceed, as those for most of the displays."""

Pixels = TypeVar("Pixels", Picture, FloatMap)

_QUILT_NAME = re.compile(r"_qs\d+x\d+a[\d.]+$")


def refocus(array: CameraArray, views: Iterable[RenderedView], viewpoint: Viewpoint, px: float) -> Picture:
    """Shift and add: what a lens as large as the views' spread would see, focused at one disparity.

    Each view is moved so that points of that disparity lie where they are seen from `viewpoint`, then all
    are averaged, each where it reaches (Isaksen et al., "Dynamically reparameterized light fields",
    SIGGRAPH 2000).

    Args:
        px: the disparity in focus, px for one step of the array's grid (sign: ALGORITHMS 0).

    Returns:
        uint8 (H, W, 3) RGB; black where no view reaches.
    """
    shape = array.height, array.width
    total: FloatMap = np.zeros((*shape, 3), np.float32)
    weight: FloatMap = np.zeros(shape, np.float32)
    inside: FloatMap = np.ones(shape, np.float32)
    for view in views:
        matrix = _displacement(array, view.viewpoint, viewpoint, px)
        total += _moved(view.pixels.astype(np.float32), matrix, cv2.INTER_LINEAR, cv2.BORDER_CONSTANT)
        weight += _moved(inside, matrix, cv2.INTER_LINEAR, cv2.BORDER_CONSTANT)
    mean = total / np.maximum(weight, np.finfo(np.float32).tiny)[..., None]
    return np.clip(np.rint(mean), 0, 255).astype(np.uint8)


def converge(array: CameraArray, view: RenderedView, centre: Viewpoint, px: float) -> Picture:
    """The view, moved so that points of one disparity lie where they are seen from `centre`.

    Seen with two eyes they lie in the plane of the screen. The border is repeated where nothing comes in.

    Args:
        px: that disparity, px for one step of the array's grid.
    """
    matrix = _displacement(array, view.viewpoint, centre, px)
    return _moved(view.pixels, matrix, cv2.INTER_CUBIC, cv2.BORDER_REPLICATE)


def _displacement(array: CameraArray, view: Viewpoint, centre: Viewpoint, px: float) -> FloatMap:
    """(2, 3): from pixels at `centre` to those of `view` that show the same points of a disparity."""
    across, down = (centre.col - view.col) * px, array.rho * (centre.row - view.row) * px
    return np.array([[1, 0, across], [0, 1, down]], np.float32)


def _moved(picture: Pixels, matrix: FloatMap, filtering: int, border: int) -> Pixels:
    size = picture.shape[1], picture.shape[0]
    return np.asarray(
        cv2.warpAffine(picture, matrix, size, flags=filtering | cv2.WARP_INVERSE_MAP, borderMode=border),
        picture.dtype,
    )


def epipolar_slice(pictures: Iterable[Picture], *, along_column: bool = False) -> Picture:
    """The middle line of each picture, one below the other: points become lines, the steeper the farther.

    Args:
        pictures: N views along a row of the array, uint8 (H, W, 3); with `along_column` down a column, and
            the middle columns come side by side.

    Returns:
        uint8 (N, W, 3) RGB; with `along_column` (H, N, 3).
    """
    if along_column:
        return np.stack([picture[:, picture.shape[1] // 2] for picture in pictures], axis=1)
    return np.stack([picture[picture.shape[0] // 2] for picture in pictures])


def quilt(pictures: Sequence[Picture], rows: int, cols: int) -> Picture:
    """Views in the order of Looking Glass displays: the leftmost one at the bottom left, row by row upwards.

    See https://docs.lookingglassfactory.com/keyconcepts/quilts.

    Args:
        pictures: rows * cols views along a row of the array, leftmost first.
    """
    tiles = [pictures[row * cols : (row + 1) * cols] for row in range(rows)]
    return mosaic(tiles[::-1], QUILT_SIZE)


def quilt_path(path: Path, rows: int, cols: int, aspect: float) -> Path:
    """The name that tells viewers a quilt's layout: ``*_qsCxRaA``, A the aspect ratio of one view.

    Raises:
        SettingError: the name states another layout already.
    """
    suffix = f"_qs{cols}x{rows}a" + f"{aspect:.3f}".rstrip("0").rstrip(".")
    stated = _QUILT_NAME.search(path.stem)
    if stated is None:
        return path.with_name(f"{path.stem}{suffix}{path.suffix}")
    if stated[0] != suffix:
        raise SettingError("OUT", path, f"{suffix} where its name states the quilt's layout")
    return path

"""Which parts of pictures must be looked at again at full size, after copies of half the size were matched.

What is thinner than two pixels of a small copy is lost in it, and contours of its map are off by as much.
Both are in few places: where partners show something else than the map says, and where it has a step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import FloatMap
from mvcodec.stereo.partners import partners, steps

WINDOW, BORDER = 64, 4
"""Pixels of a window that is searched, and how many of those on each side are not taken from it. A window is
as wide as a vector of the kernels is long, and as high as a band that is turned at once."""
BLOCK = WINDOW - 2 * BORDER

STEP_PX = 3.0
"""Where a map of half size changes by more from a pixel to the next, there is a contour."""
MISFIT_LEVELS = 12
"""Where all partners that see a pixel differ by more grey levels, its disparity may be wrong."""
MISFIT_WEIGHT = 6
"""Such a pixel counts as many at contours: a thing that was lost is worse than a contour that is off."""
LEAST_DOUBT = 0.02
"""Blocks with less of it, a pixel at a contour counting 1, are left as they are."""
LEAST_MISFITS = 30
"""So many pixels of a block that misfit are of something that was lost."""
MORE_LEVELS = 2
"""Disparities that are looked at beyond those around a block, px."""

Places = NDArray[np.int64]
"""int64 (N, 2): row and column of the first pixels of N blocks or windows."""


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks of BLOCK x BLOCK pixels that are looked at again.

    Attributes:
        places: where they are.
        ranges_px: int64 (N, 2), the least and the greatest disparity that may be there.
    """

    places: Places
    ranges_px: NDArray[np.int64]


def doubtful(
    array: CameraArray,
    camera: Position,
    maps: Mapping[Position, FloatMap],
    greys: Mapping[Position, NDArray[np.uint8]],
) -> FloatMap:
    """How much a small map is in doubt, float32 (h, w): 1 at a contour, MISFIT_WEIGHT more at a misfit.

    Args:
        array: of the small copies.
        camera: whose map is looked at.
        maps: float32 (h, w), px of small copies.
        greys: uint8 (h, w), of equal brightness.
    """
    values, grey = np.ascontiguousarray(maps[camera], np.float32), greys[camera]
    around = np.ones((3, 3), np.uint8)
    contour = np.asarray(cv2.subtract(cv2.dilate(values, around), cv2.erode(values, around)))
    height, width = values.shape
    x = np.arange(width, dtype=np.float32)[None]
    y = np.arange(height, dtype=np.float32)[:, None]
    least = np.full(values.shape, 255, np.uint8)
    unseen = np.ones(values.shape, np.bool_)
    beside = partners(array, camera)
    for partner, (by_x, by_y) in zip(beside, steps(array, camera, beside), strict=True):
        columns, rows = x - by_x * values, y - by_y * values
        there = cv2.remap(greys[partner], columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        beyond = (columns < 0) | (columns > width - 1) | (rows < 0) | (rows > height - 1)
        least = np.minimum(least, np.where(beyond, np.uint8(255), cv2.absdiff(there, grey)))
        unseen &= beyond
    misfit = (least > MISFIT_LEVELS) & ~unseen
    found = (contour > STEP_PX).astype(np.float32)
    found[misfit] += MISFIT_WEIGHT
    return found


def most_doubtful(
    doubts: FloatMap, small: FloatMap, size: tuple[int, int], most: float, nearest_px: float
) -> Blocks:
    """The blocks of a picture that its small copy's map is most in doubt of, those of like ranges together.

    What is lost in a small copy is nearer than what is around it, but by how much? So where there are misfits
    everything may be there that is not farther.

    Args:
        doubts: float32 (h, w), see `doubtful`.
        small: float32 (h, w), px of the small copy, its map.
        size: (height, width) of the picture, px.
        most: the largest share of all blocks that are looked at.
        nearest_px: the greatest disparity there is, px of the picture.
    """
    height, width = size
    half = BLOCK // 2
    rows, columns = math.ceil(height / BLOCK), math.ceil(width / BLOCK)
    down, right = max(rows * half - len(small), 0), max(columns * half - small.shape[1], 0)

    def by_blocks(values: FloatMap, border: int, together: np.ufunc) -> FloatMap:
        """What all values of a block come to, float32 (rows, columns)."""
        framed = np.asarray(cv2.copyMakeBorder(values, 0, down, 0, right, border))[
            : rows * half, : columns * half
        ]
        bands = together.reduce(framed.reshape(rows, half, columns * half), axis=1)
        return np.asarray(together.reduce(bands.reshape(rows, columns, half), axis=2))

    shares = by_blocks(doubts, cv2.BORDER_CONSTANT, np.add).ravel() / half**2
    order = np.argsort(-shares, kind="stable")[: int(most * shares.size) if height >= WINDOW else 0]
    chosen = np.sort(order[shares[order] >= LEAST_DOUBT])
    around = np.ones((3, 3), np.uint8)
    least = cv2.erode(by_blocks(small, cv2.BORDER_REPLICATE, np.minimum), around)
    greatest = cv2.dilate(by_blocks(small, cv2.BORDER_REPLICATE, np.maximum), around)
    least, greatest = (2 * np.asarray(values).ravel()[chosen] for values in (least, greatest))
    misfits = by_blocks((doubts >= MISFIT_WEIGHT).astype(np.float32), cv2.BORDER_CONSTANT, np.add).ravel()[
        chosen
    ]
    greatest = np.where(misfits >= LEAST_MISFITS, nearest_px, greatest)
    ranges = np.stack([np.floor(least) - MORE_LEVELS, np.ceil(greatest) + MORE_LEVELS], axis=1)
    places = np.stack([chosen // columns, chosen % columns], axis=1) * BLOCK
    together = np.argsort(greatest, kind="stable")
    return Blocks(places[together], ranges.astype(np.int64)[together])

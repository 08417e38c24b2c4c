"""Maps of cameras that send none, derived from those of the cameras around them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import cv2
import numpy as np

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DisparityMap, FloatMap, Mask

AGREEMENT_PX = 2.0
"""Maps that differ by less are of one surface, and are averaged."""

MEDIAN = 5
"""Window of the median that drops the stray pixels of forward mapping."""

REACH = 0.999
"""How far a moved pixel covers its surroundings, px: both places beside a fractional one, so that slanted
surfaces get no cracks.
"""

STEPS = 65535
"""The range of disparities is told apart in at most so many whole steps while the median is taken."""


def derive_map(
    array: CameraArray,
    maps: Mapping[Position, DisparityMap],
    range_px: tuple[float, float],
    camera: Position,
) -> DisparityMap:
    """The map of a real camera from those of others: of what they see there, the nearest surface.

    Args:
        maps: of at least one other real camera; the nearest ones count.
        range_px: (lo, hi) of the maps; lo stands where a whole row is seen by none of them.

    Returns:
        A map whose `valid` is False where none of the others sees the pixel: there the farther one of
        both sides on the row goes on.
    """
    from mvcodec.kernels.map_projection import merge
    from mvcodec.kernels.view_depth import MARGIN, fill_background, splat

    distances = {other: _distance(array, camera, other) for other in maps}
    helpers = [other for other in sorted(maps) if distances[other] == min(distances.values())]
    seen = np.empty((len(helpers), array.height + 2, array.width + 2 * MARGIN), np.float32)
    for other, out in zip(helpers, seen, strict=True):
        right, down = array.shift_per_disparity(other, Viewpoint(*camera))
        splat(maps[other].values_px, right, down, REACH, out)
    shape = array.height, array.width
    values, known = np.empty(shape, np.float32), np.empty(shape, np.bool_)
    merge(seen, AGREEMENT_PX, values, known)
    fill_background(values, range_px[0], 0, array.height)
    _repeat_rows(values, known)
    _median(values, range_px)
    return DisparityMap(values, known)


def _repeat_rows(values: FloatMap, known: Mask) -> None:
    """Rows of which nothing is known take the values of the nearest one that has some, in place."""
    rows = known.any(axis=1)
    if rows.any() and not rows.all():
        there, empty = np.flatnonzero(rows), np.flatnonzero(~rows)
        values[empty] = values[there[np.abs(empty[:, None] - there).argmin(axis=1)]]


def _median(values: FloatMap, range_px: tuple[float, float]) -> None:
    """Replace values by the median around them, in 16 bits, which takes a third of the time of floats."""
    from mvcodec.kernels.map_projection import from_steps, to_steps

    low, high = range_px
    step = 2.0 ** math.ceil(math.log2(max(high - low, 1e-6) / STEPS))
    steps = np.empty(values.shape, np.uint16)
    to_steps(values, low, step, steps)
    from_steps(np.asarray(cv2.medianBlur(steps, MEDIAN), np.uint16), low, step, values)


def _distance(array: CameraArray, a: Position, b: Position) -> int:
    """In cells, squared."""
    down = array.real_rows.index(a[0]) - array.real_rows.index(b[0])
    across = array.real_cols.index(a[1]) - array.real_cols.index(b[1])
    return down**2 + across**2

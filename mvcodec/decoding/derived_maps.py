"""Maps of cameras that send none, derived from those of the cameras around them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DisparityMap
from mvcodec.stereo.consistency import fill_from_farther, median

AGREEMENT_PX = 2.0
"""Maps that differ by less are of one surface, and are averaged."""

MEDIAN = 5
"""Window of the median that drops the stray pixels of forward mapping."""


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
    from mvcodec.kernels.map_projection import merge, project

    distances = {other: _distance(array, camera, other) for other in maps}
    helpers = [other for other in sorted(maps) if distances[other] == min(distances.values())]
    seen = np.empty((len(helpers), array.height + 2, array.width + 2), np.float32)
    for other, out in zip(helpers, seen, strict=True):
        right, down = array.shift_per_disparity(other, Viewpoint(*camera))
        project(maps[other].values_px, right, down, out)
    shape = array.height, array.width
    values, known = np.empty(shape, np.float32), np.empty(shape, np.bool_)
    merge(seen, AGREEMENT_PX, values, known)
    filled = fill_from_farther(values, known, range_px[0])
    return DisparityMap(median(filled, MEDIAN, range_px), known)


def _distance(array: CameraArray, a: Position, b: Position) -> int:
    """In cells, squared."""
    down = array.real_rows.index(a[0]) - array.real_rows.index(b[0])
    across = array.real_cols.index(a[1]) - array.real_cols.index(b[1])
    return down**2 + across**2

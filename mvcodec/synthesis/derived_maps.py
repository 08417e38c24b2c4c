"""Maps of cameras that send none, derived from those of the cameras around them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DisparityMap, FloatMap
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
    distances = {other: _distance(array, camera, other) for other in maps}
    helpers = [other for other in sorted(maps) if distances[other] == min(distances.values())]
    seen = np.stack([_seen_from(array, camera, other, maps[other].values_px) for other in helpers])
    top = seen.max(axis=0)
    known = np.isfinite(top)
    agreeing = seen > np.where(known, top, 0) - np.float32(AGREEMENT_PX)
    total = np.where(agreeing, seen, 0).sum(axis=0, dtype=np.float32)
    values = np.where(known, total / np.maximum(agreeing.sum(axis=0), 1), range_px[0]).astype(np.float32)
    filled = fill_from_farther(values, known, range_px[0])
    return DisparityMap(median(filled, MEDIAN, range_px), known)


def _distance(array: CameraArray, a: Position, b: Position) -> int:
    """In cells, squared."""
    down = array.real_rows.index(a[0]) - array.real_rows.index(b[0])
    across = array.real_cols.index(a[1]) - array.real_cols.index(b[1])
    return down**2 + across**2


def _seen_from(array: CameraArray, camera: Position, other: Position, values_px: FloatMap) -> FloatMap:
    """Another camera's map as this one sees it; -inf where that one sees nothing."""
    from mvcodec.kernels.map_projection import project

    right, down = array.shift_per_disparity(other, Viewpoint(*camera))
    seen = np.full(values_px.shape, -np.inf, np.float32)
    project(values_px, right, down, seen)
    return seen

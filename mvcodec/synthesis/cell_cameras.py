"""The real cameras that a view is made from: those of its cell, and how much each counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Cell, Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet, RenderedView

FADE = 0.25
"""Cells over which a camera fades out before a border that it does not stand on."""


@dataclass(frozen=True, slots=True, eq=False)
class CellCameras:
    """The N cameras of a view.

    Attributes:
        cameras: their positions.
        places: int64 (N,), their places in `array.real`.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: float32 (N,), above 0.
    """

    cameras: tuple[Position, ...]
    places: NDArray[np.int64]
    shifts: NDArray[np.float32]
    weights: NDArray[np.float32]


def real_view(decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView | None:
    """A real camera's own picture and map, where the viewpoint is its place; or an enhanced view's.

    Raises:
        SettingError: the viewpoint lies outside the array.
    """
    decoded.array.cell_at(viewpoint)
    camera = viewpoint.position
    enhanced = None if camera is None else decoded.enhanced.get(camera)
    if enhanced is not None:
        seen_by = np.ones(enhanced.disparity_px.shape, np.uint8)
        return RenderedView(viewpoint, enhanced.pixels.copy(), enhanced.disparity_px.copy(), seen_by)
    if camera is None or camera not in decoded.pictures:
        return None
    values = decoded.disparities[camera].values_px
    seen_by = np.ones(values.shape, np.uint8)
    return RenderedView(viewpoint, decoded.pictures[camera].copy(), values.copy(), seen_by)


def find_cameras(decoded: DecodedSet, viewpoint: Viewpoint, spread: float) -> CellCameras:
    """The cameras of a view.

    Args:
        spread: squared cells; a camera at distance b counts 1 / (spread + b^2).

    Raises:
        SettingError: the viewpoint lies outside the array; no camera of its cell has a picture.
    """
    array = decoded.array
    cell = array.cell_at(viewpoint)
    found = {camera: _weight(array, cell, camera, viewpoint, spread) for camera in cell.cameras}
    cameras = tuple(camera for camera in cell.cameras if found[camera] > 0 and camera in decoded.pictures)
    if not cameras:
        raise SettingError("decoded.pictures", "no camera of the view's cell", "at least one")
    return CellCameras(
        cameras,
        np.array([array.real.index(camera) for camera in cameras]),
        np.array([array.shift_per_disparity(camera, viewpoint) for camera in cameras], np.float32),
        np.array([found[camera] for camera in cameras], np.float32),
    )


def _weight(array: CameraArray, cell: Cell, camera: Position, viewpoint: Viewpoint, spread: float) -> float:
    """How much a camera of the cell counts, by its distance.

    Towards a border to another cell the cameras across this cell fade out, so that the picture
    does not jump where other cameras take over.
    """
    across = abs(viewpoint.col - camera[1]) / array.col_step if array.col_step else 0.0
    down = abs(viewpoint.row - camera[0]) / array.row_step if array.row_step else 0.0
    weight = 1 / (spread + across**2 + down**2)
    if camera[1] == cell.left and cell.right < array.cols - 1:
        weight *= min(1.0, (1 - across) / FADE)
    if camera[1] == cell.right and cell.left > 0:
        weight *= min(1.0, (1 - across) / FADE)
    if camera[0] == cell.top and cell.bottom < array.rows - 1:
        weight *= min(1.0, (1 - down) / FADE)
    if camera[0] == cell.bottom and cell.top > 0:
        weight *= min(1.0, (1 - down) / FADE)
    return weight

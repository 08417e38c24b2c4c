"""A rig from cameras whose lenses, directions and places are known: from files, or from a board."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.errors import InputError
from mvcodec.rigs.calibration_files import KnownCamera
from mvcodec.rigs.framing import Crop, framed
from mvcodec.rigs.rig import Rectified, Rig, RigCamera

Vectors = NDArray[np.float64]

IRREGULAR_STEPS = 0.25
"""Farther than that from its place on the grid, a camera is said to be another one."""


def rig_from_cameras(
    array: CameraArray,
    known: Sequence[KnownCamera],
    name: str,
    found_by: str,
    crop: Crop = "common",
    size: tuple[int, int] | None = None,
    typical_w: float = 0.0,
) -> Rig:
    """The rig of known cameras: the axes of its array are those of the grid that they stand on.

    A single row or column says nothing of turns around itself: there the cameras' mean direction counts.

    Args:
        array: the grid.
        known: its cameras, row order.
        name: where they are from, for messages.
        found_by: see `Rig`.
        crop, size: as in `framed`.
        typical_w: see `Rectified`.

    Raises:
        InputError: another number of cameras than the grid has, pictures of another size, or places that
            are no grid in the order given.
    """
    positions = array.positions
    if len(known) != len(positions):
        found = f"{len(known)} cameras"
        raise InputError(
            name, found, f"{len(positions)}, those of the {array.rows}x{array.cols} grid in row order"
        )
    for camera in known:
        if camera.size != (array.width, array.height):
            found = "a camera of {}x{} px".format(*camera.size)
            raise InputError(name, found, f"{array.width}x{array.height} px, the size of the pictures")
    if len(known) == 1:
        raise InputError(name, "one camera", "two or more")
    axes, origin, step_m, rho = _axes(positions, known, name)
    cameras = {}
    for position, camera in zip(positions, known, strict=True):
        place = axes @ (camera.centre_m - origin) / step_m
        expected = np.array([position[1], position[0] * rho, 0.0])
        beside = float(np.abs(place - expected).max())
        if beside > IRREGULAR_STEPS:
            found = f"camera {position[0]},{position[1]} {beside:.2f} steps beside its place"
            raise InputError(name, found, "cameras on a regular grid, in row order")
        cameras[position] = RigCamera(camera.lens, camera.turn @ axes.T, place, np.ones(3), np.zeros(3))
    focal = float(np.exp(np.mean([np.log(camera.lens.focal_px).mean() for camera in known])))
    view = Rectified(
        array.width, array.height, focal, (0.0, 0.0), baseline_m=step_m, rho=rho, typical_w=typical_w
    )
    source_size = array.width, array.height
    view = framed(cameras, source_size, view, crop, size)
    return Rig(array.rows, array.cols, source_size, cameras, view, found_by, {})


def _axes(
    positions: Sequence[Position], known: Sequence[KnownCamera], name: str
) -> tuple[Vectors, Vectors, float, float]:
    """Rows of the array's axes, place (0, 0), metres of a step, and rho."""
    centres = np.array([camera.centre_m for camera in known])
    grid = np.array([(col, row, 1.0) for row, col in positions], np.float64)
    # Of a single row (column) the shortest solution has no step down (right).
    right, down, origin = np.linalg.lstsq(grid, centres, rcond=None)[0]
    mean = np.linalg.svd(np.sum([camera.turn for camera in known], axis=0))
    facing = mean[0] @ mean[2]
    wide, high = np.ptp(grid[:, 0]) > 0, np.ptp(grid[:, 1]) > 0
    for there, step, axis, words in (
        (wide, right, facing[0], "columns in reverse, or cameras in another order"),
        (high, down, facing[1], "rows in reverse, or cameras in another order"),
    ):
        if there and step @ axis <= 0.5 * np.linalg.norm(step):
            raise InputError(name, words, "cameras in row order, as seen from behind them")
    if wide:
        x = right / np.linalg.norm(right)
        y = (down if high else facing[1]) - ((down if high else facing[1]) @ x) * x
        y /= np.linalg.norm(y)
    else:
        y = down / np.linalg.norm(down)
        x = facing[0] - (facing[0] @ y) * y
        x /= np.linalg.norm(x)
    step_m = float(np.linalg.norm(right) if wide else np.linalg.norm(down))
    rho = float(down @ y / step_m) if wide and high else 1.0
    return np.stack([x, y, np.cross(x, y)]), origin, step_m, rho

"""A rig from what its cameras see of any scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from mvcodec.array import CameraArray, Position
from mvcodec.errors import InputError
from mvcodec.rigs.adjustment import Adjusted, Cameras
from mvcodec.rigs.features import Tracks
from mvcodec.rigs.framing import Crop, framed
from mvcodec.rigs.rig import Lens, Rectified, Rig, RigCamera

FEWEST_POINTS = 40


def check_shared(tracks: Tracks, name: str) -> None:
    """Raise InputError where a camera shares too few points with the others."""
    shown = tracks.seen.sum(axis=0)
    if shown.min() < FEWEST_POINTS:
        row, col = tracks.cameras[int(np.argmin(shown))]
        found = f"{int(shown.min())} points of camera {row},{col} that another one sees"
        expected = f"{FEWEST_POINTS}: more light, more texture, or more overlap between the cameras"
        raise InputError(name, found, expected)


def rig_from_adjusted(
    array: CameraArray, adjusted: Adjusted, crop: Crop = "common", size: tuple[int, int] | None = None
) -> Rig:
    """The rig of adjusted cameras.

    Args:
        array: the grid.
        adjusted: its cameras, row order.
        crop, size: as in `framed`.
    """
    found = adjusted.cameras
    source_size = array.width, array.height
    cameras = _rig_cameras(array.positions, found)
    focal = float(np.exp(np.log(found.focal_px).mean()))
    both = array.rows > 1 and array.cols > 1
    view = Rectified(
        *source_size,
        focal,
        (0.0, 0.0),
        baseline_m=array.calibration.baseline_m if array.calibration.given else None,
        rho=array.rho * found.stretch if both else 1.0,
        typical_w=float(np.median(adjusted.inverse_depth)),
    )
    view = framed(cameras, source_size, view, crop, size)
    return Rig(array.rows, array.cols, source_size, cameras, view, "scene", {})


def _rig_cameras(positions: Sequence[Position], found: Cameras) -> dict[Position, RigCamera]:
    turns = Rotation.from_rotvec(found.turns).as_matrix()
    cameras = {}
    for number, position in enumerate(positions):
        focal = float(found.focal_px[number])
        coefficients = (float(found.k1[number]), float(found.k2[number]), 0.0, 0.0)
        cx, cy = found.centres_px[number].tolist()
        lens = Lens("pinhole", (focal, focal), (cx, cy), coefficients)
        cameras[position] = RigCamera(
            lens, turns[number], found.places[number].copy(), np.ones(3), np.zeros(3)
        )
    return cameras

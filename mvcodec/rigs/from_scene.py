"""A rig from what its cameras see of any scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from mvcodec.array import CameraArray, Position
from mvcodec.errors import InputError
from mvcodec.frames import FrameSet
from mvcodec.rigs.adjustment import Adjusted, Cameras, Priors, adjust
from mvcodec.rigs.features import PairCount, Tracks, find_tracks
from mvcodec.rigs.framing import Crop, framed
from mvcodec.rigs.rig import Lens, Rectified, Rig, RigCamera

MOST_FRAME_SETS = 4
FEWEST_POINTS = 40


@dataclass(frozen=True, slots=True, eq=False)
class SceneFit:
    """A rig found from the scene, and what it was found from.

    Attributes:
        rig: without colours.
        adjusted: points and residuals.
        every: the points before those that don't agree were left out.
        pairs: how well the pictures were matched.
    """

    rig: Rig
    adjusted: Adjusted
    every: Tracks
    pairs: list[PairCount]


def spread_frames(count: int, most: int = MOST_FRAME_SETS) -> list[int]:
    """Up to `most` of `count` frame numbers, far apart."""
    return sorted({round(at) for at in np.linspace(0, count - 1, min(count, most))})


def rig_from_scene(
    array: CameraArray,
    frame_sets: Sequence[FrameSet],
    name: str,
    priors: Priors | None = None,
    crop: Crop = "common",
    size: tuple[int, int] | None = None,
) -> SceneFit:
    """The rig that explains best where points of the scene are in the cameras' pictures.

    Args:
        array: the grid; its focal length (nominal where none is given) and rho are where the search starts.
        frame_sets: with the picture of every camera of the grid.
        name: of the input, for messages.
        priors: how much the cameras may differ from ideal ones.
        crop, size: as in `framed`.

    Raises:
        InputError: too few points are seen by several cameras.
    """
    cameras = array.positions
    tracks, pairs = find_tracks(frame_sets, cameras)
    shown = tracks.seen.sum(axis=0)
    if shown.min() < FEWEST_POINTS:
        worst = cameras[int(np.argmin(shown))]
        found = f"{int(shown.min())} points of camera {worst[0]},{worst[1]} that another one sees"
        expected = f"{FEWEST_POINTS}: more light, more texture, or more overlap between the cameras"
        raise InputError(name, found, expected)
    grid = np.array([(col, row * array.rho) for row, col in cameras], np.float64)
    if priors is None:
        priors = Priors(focal=0.02) if array.calibration.given else Priors()
    adjusted = adjust(tracks, grid, (array.width, array.height), array.calibration.fx_px, priors)
    rig = _rig(array, adjusted, crop, size)
    return SceneFit(rig, adjusted, tracks, pairs)


def _rig(array: CameraArray, adjusted: Adjusted, crop: Crop, size: tuple[int, int] | None) -> Rig:
    found = adjusted.cameras
    source_size = array.width, array.height
    cameras = _rig_cameras(array.positions, found, source_size)
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


def _rig_cameras(
    positions: Sequence[Position], found: Cameras, size: tuple[int, int]
) -> dict[Position, RigCamera]:
    centre = (size[0] - 1) / 2, (size[1] - 1) / 2
    turns = Rotation.from_rotvec(found.turns).as_matrix()
    cameras = {}
    for number, position in enumerate(positions):
        focal = float(found.focal_px[number])
        coefficients = (float(found.k1[number]), float(found.k2[number]), 0.0, 0.0)
        lens = Lens("pinhole", (focal, focal), centre, coefficients)
        cameras[position] = RigCamera(
            lens, turns[number], found.places[number].copy(), np.ones(3), np.zeros(3)
        )
    return cameras

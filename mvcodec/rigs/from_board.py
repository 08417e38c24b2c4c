"""Cameras from a board that was held before them: lenses, directions and metric places.

Each camera is calibrated by itself (Zhang 2000, by OpenCV), cameras that saw the board at the same time are
chained to each other, and SciPy's least squares then adjust everything at once to all corners, robustly.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial.transform import Rotation

from mvcodec.array import Position
from mvcodec.errors import InputError, MvCodecWarning
from mvcodec.rigs.board import Sightings
from mvcodec.rigs.board_bundle import Guess, adjusted
from mvcodec.rigs.calibration_files import KnownCamera
from mvcodec.rigs.remap import project
from mvcodec.rigs.rig import Lens
from mvcodec.workers import run_all

Vectors = NDArray[np.float64]

LensChoice = Literal["auto", "pinhole", "fisheye"]
LENS_CHOICES: tuple[LensChoice, ...] = ("auto", "pinhole", "fisheye")

FEWEST_SIGHTINGS = 5
"""Of the board by one camera."""
MOST_FRAME_SETS = 40
FISHEYE_SHARE = 0.7
"""A fisheye lens is told from the usual one by so much less that it leaves over."""
FEWEST_LEFT = 6
"""Corners of a sighting, once those that don't fit are left out."""
_TRIMS = 4
_BEYOND, _LEAST_PX = 6.0, 0.05
"""Corners farther off than so many times the typical distance don't fit."""
ROUGH_PX = 1.0
"""What is left over of corners that have been found well is less, in pictures of up to 1000 px."""
MUCH_TOO_ROUGH, MANY_LEFT_OUT = 3.0, 0.4


@dataclass(frozen=True, slots=True, eq=False)
class FromBoard:
    """What a board told.

    Attributes:
        cameras: in the axes of the first one, metres.
        rms_px: what is left over, root of the mean square over all corners that agree.
        sightings: of the board by each camera.
        left_out: share of the corners that don't agree.
    """

    cameras: list[KnownCamera]
    rms_px: float
    sightings: list[int]
    left_out: float


@dataclass(frozen=True, slots=True, eq=False)
class _Alone:
    """One camera by itself: its lens, the board's pose in each frame set that shows it, and the rest."""

    lens: Lens
    poses: dict[int, Vectors]
    rms_px: float


def cameras_from_board(sightings: Sightings, name: str, lens: LensChoice = "auto") -> FromBoard:
    """Calibrate cameras.

    Args:
        sightings: of a board, by all cameras or by overlapping groups of them.
        name: of the pictures, for messages.
        lens: model of the lenses; `auto`: the one that fits better.

    Raises:
        InputError: the board was seen too rarely, or nothing joins some of the cameras.
    """
    _check_seen(sightings, name)
    frames = len(sightings.seen)
    sightings = sightings.of_frames(
        np.unique(np.linspace(0, frames - 1, min(frames, MOST_FRAME_SETS)).round().astype(np.int64))
    )
    _check_seen(sightings, name)
    numbers = range(len(sightings.cameras))
    fits: dict[str, list[_Alone]] = {}
    for model in ("pinhole", "fisheye") if lens == "auto" else (lens,):
        found = run_all(lambda number, model=model: _alone(sightings, number, model), numbers)
        if all(camera is not None for camera in found):
            fits[model] = [camera for camera in found if camera is not None]
    if not fits:
        expected = "sightings that differ: the board near and far, tilted, and in all corners of the pictures"
        raise InputError(name, f"a board by which no {lens} lens can be calibrated", expected)
    rest = {model: max(camera.rms_px for camera in found) for model, found in fits.items()}
    model = "pinhole" if "pinhole" in rest else "fisheye"
    if len(rest) == 2 and rest["fisheye"] < FISHEYE_SHARE * rest["pinhole"]:
        model = "fisheye"
    return adjusted_cameras(sightings, name, model, fits[model])


def adjusted_cameras(sightings: Sightings, name: str, model: str, alone: Sequence[_Alone]) -> FromBoard:
    """All cameras at once, from each by itself."""
    relative = _chained(sightings.cameras, [camera.poses for camera in alone], name)
    boards = np.zeros((len(sightings.seen), 4, 4))
    for frame in range(len(boards)):
        number = max(
            (n for n, camera in enumerate(alone) if frame in camera.poses),
            key=lambda n: int(sightings.seen[frame, n].sum()),
        )
        boards[frame] = np.linalg.inv(relative[number]) @ alone[number].poses[frame]
    guess = Guess(
        model,
        np.array([camera.lens.matrix for camera in alone]),
        np.array([camera.lens.coefficients for camera in alone]),
        relative,
        boards,
    )
    found = adjusted(guess, sightings)
    _check_fit(sightings, found.rms_px, found.left_out, name)
    cameras = [
        KnownCamera(sightings.size, lens, turn, centre)
        for lens, turn, centre in zip(found.lenses, found.turns, found.centres_m, strict=True)
    ]
    seen = [int(count) for count in sightings.seen.any(axis=2).sum(axis=0)]
    return FromBoard(cameras, found.rms_px, seen, found.left_out)


def _check_seen(sightings: Sightings, name: str) -> None:
    text, total = sightings.board.text, sightings.looked_at
    if not len(sightings.seen):
        raise InputError(
            name,
            f"no {text} in any picture of {total} frame sets",
            "another `board`, or pictures that show it whole",
        )
    counts = sightings.seen.any(axis=2).sum(axis=0)
    if counts.min() < FEWEST_SIGHTINGS:
        row, col = sightings.cameras[int(np.argmin(counts))]
        found = f"the board in {int(counts.min())} pictures of camera {row},{col} ({total} were searched)"
        raise InputError(name, found, f"{FEWEST_SIGHTINGS} or more, tilted and in all parts of the picture")


def _check_fit(sightings: Sightings, rms_px: float, left_out: float, name: str) -> None:
    """Say where corners are not where the board has them: another board, or one that moved."""
    bound = ROUGH_PX * max(1.0, sightings.size[0] / 1000)
    text = sightings.board.text
    if rms_px > MUCH_TOO_ROUGH * bound or left_out > MANY_LEFT_OUT:
        found = f"corners {rms_px:.1f} px from where {text} has them ({left_out:.0%} farther off)"
        raise InputError(name, found, "the board that was filmed, flat, by cameras that run in step")
    if rms_px > bound:
        warnings.warn(
            f"{name}: corners are {rms_px:.1f} px from where {text} has them; is the board flat, and was it"
            " held still?",
            MvCodecWarning,
            stacklevel=2,
        )


def _alone(sightings: Sightings, number: int, model: str) -> _Alone | None:
    """One camera, without the corners that don't fit; None where OpenCV can't."""
    seen, found = sightings.seen[:, number].copy(), None
    for _ in range(_TRIMS):
        seen &= (seen.sum(axis=1) >= FEWEST_LEFT)[:, None]
        try:
            found, apart_px = _calibrated(sightings, number, seen, model)
        except cv2.error:
            return None
        good = apart_px <= _BEYOND * max(float(np.median(apart_px)), _LEAST_PX)
        if good.all():
            break
        seen[seen] = good
    return found


def _calibrated(
    sightings: Sightings, number: int, seen: NDArray[np.bool_], model: str
) -> tuple[_Alone, Vectors]:
    """One camera by the corners of `seen`, (F, C); and how far each of these is off, px."""
    frames = np.nonzero(seen.any(axis=1))[0]
    corners = sightings.board.corners_m.astype(np.float32)
    # In one row: OpenCV's fisheye takes no column.
    objects = [corners[seen[frame]][None] for frame in frames]
    pictures = [sightings.xy_px[frame, number, seen[frame]].astype(np.float32)[None] for frame in frames]
    size, empty = sightings.size, np.eye(3)
    if model == "fisheye":
        names = ("CALIB_RECOMPUTE_EXTRINSIC", "CALIB_FIX_SKEW", "CALIB_USE_INTRINSIC_GUESS")
        flags = sum(map(_fisheye_flag, names))
        # A lens that sees 180 degrees: from OpenCV's own guess, a longer one, wide lenses often fail.
        guess = np.diag([max(size) / np.pi, max(size) / np.pi, 1.0])
        guess[:2, 2] = (np.array(size) - 1) / 2
        told = cv2.fisheye.calibrate(objects, pictures, size, guess, np.zeros(4), flags=flags)
    else:
        told = cv2.calibrateCamera(objects, pictures, size, empty, np.zeros(5), flags=cv2.CALIB_FIX_K3)
    rms, matrix, bent, turns, shifts = told
    fx, fy, cx, cy = (float(value) for value in np.asarray(matrix)[[0, 1, 0, 1], [0, 1, 2, 2]])
    lens = Lens(model, (fx, fy), (cx, cy), tuple(np.ravel(bent)[:4].tolist()))
    poses, apart = {}, []
    for frame, turn, shift, points, shown in zip(frames, turns, shifts, objects, pictures, strict=True):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(np.ravel(turn)).as_matrix()
        pose[:3, 3] = np.ravel(shift)
        poses[int(frame)] = pose
        there = project(lens, points[0] @ pose[:3, :3].T + pose[:3, 3])
        apart.append(np.linalg.norm(there - shown[0], axis=1))
    return _Alone(lens, poses, float(rms)), np.concatenate(apart)


def _fisheye_flag(name: str) -> int:
    """OpenCV 4 has flags of its own for fisheyes, 5 the same as for other lenses."""
    return int(getattr(cv2.fisheye if hasattr(cv2.fisheye, name) else cv2, name))


def _chained(cameras: Sequence[Position], poses: Sequence[dict[int, Vectors]], name: str) -> Vectors:
    """(N, 4, 4): from the first camera's axes to each one's, along pairs that share the most sightings."""
    count = len(cameras)
    shared = np.array([[len(one.keys() & other.keys()) for other in poses] for one in poses])
    np.fill_diagonal(shared, 0)
    groups, label = connected_components(coo_array(shared), directed=False)
    if groups > 1:
        words = "; ".join(
            " ".join(f"{row},{col}" for (row, col), group in zip(cameras, label, strict=True) if group == one)
            for one in range(groups)
        )
        found = f"no moment at which cameras of different groups see the board ({words})"
        raise InputError(name, found, "some frame sets that show the board to cameras of both")
    weights = np.where(shared > 0, 1.0 / np.maximum(shared, 1), 0.0)
    tree = minimum_spanning_tree(coo_array(weights))
    order, parents = breadth_first_order(tree, 0, directed=False)
    found_poses = np.tile(np.eye(4), (count, 1, 1))
    for number in order[1:]:
        parent = int(parents[number])
        both = sorted(poses[number].keys() & poses[parent].keys())
        steps = np.array([poses[number][frame] @ np.linalg.inv(poses[parent][frame]) for frame in both])
        found_poses[number] = _typical(steps) @ found_poses[parent]
    return found_poses


def _typical(steps: Vectors) -> Vectors:
    """(4, 4): of several poses the one that the others are nearest to, by angle; and the median shift."""
    turns = Rotation.from_matrix(steps[:, :3, :3])
    apart = [float(np.median((turn.inv() * turns).magnitude())) for turn in turns]
    pose = np.eye(4)
    pose[:3, :3] = turns[int(np.argmin(apart))].as_matrix()
    pose[:3, 3] = np.median(steps[:, :3, 3], axis=0)
    return pose

"""The calibration of an array from what a recording says about its cameras, if they are a rectified array."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Calibration, Position
from mvcodec.container.recorded_rig import RecordedRig

FOCAL_SHARE = 0.005
"""How much the cameras' focal lengths may differ."""

CENTRE_PX = 0.5
"""How far a principal point may be from where those of the other cameras have it."""

ANGLE_DEG = 0.2
"""How much a camera may be turned against the first one."""

STEP_SHARE = 0.02
"""How far a camera may be from its place, in steps of the grid."""

Matrix = NDArray[np.float64]


class NotRectified(Exception):
    """The cameras are not those of a rectified array; says why."""


@dataclass(frozen=True, slots=True, eq=False)
class _Camera:
    """A rectified camera.

    Attributes:
        focal_px, centre_px: (x, y).
        place_m: (3,), optical centre in a frame that all cameras share.
        turn: (3, 3), from rectified optical axes to those of that frame.
    """

    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    place_m: Matrix
    turn: Matrix


def array_calibration(
    rig: RecordedRig, frames: Mapping[Position, str], size: tuple[int, int]
) -> tuple[Calibration, float] | None:
    """Calibration and rho (see `CameraArray`) of cameras on a grid.

    The cameras are taken as rectified: P and R of their calibrations count, not K and D. Their places
    are those of the transforms, or where there is none for a camera, of P's fourth column.

    Args:
        frames: place on the grid -> frame_id of the camera's pictures.
        size: (width, height) of the pictures, px.

    Returns:
        None where the recording has no calibration of these cameras, or there is one camera only.

    Raises:
        NotRectified: they differ in focal length or direction, or are not at equal steps.
    """
    known = [position for position, frame in frames.items() if frame in rig.calibrations]
    if not known or rig.nominal or len(frames) == 1:
        return None
    missing = [frame for frame in frames.values() if frame not in rig.calibrations]
    if missing:
        raise NotRectified(f"there is one of frame {frames[known[0]]!r}, but none of {missing[0]!r}")
    cameras = _cameras(rig, frames, size)
    first = cameras[min(cameras)]
    _check_alike(cameras, frames)
    across, down = _steps_m(cameras, frames)
    fx, fy = first.focal_px
    one_column = across is None
    rho = 1.0 if across is None or down is None else down * fy / (across * fx)
    d_inf = _infinity(cameras, frames, rho, one_column=one_column)
    baseline = down if across is None else across
    assert baseline is not None
    return Calibration(fx, fy, *first.centre_px, baseline, d_inf), rho


@dataclass(frozen=True, slots=True, eq=False)
class RecordedCamera:
    """A camera as its pictures come, with its lens: what K and D of a recording say.

    Attributes:
        frame: frame_id of its pictures.
        size: (width, height) that its calibration is for; zeros where it doesn't say.
        model: of the distortion, as the message has it.
        k: float64 (3, 3).
        d: float64 (N,), coefficients of the distortion.
        turn: float64 (3, 3), takes a direction in axes that all cameras share to one in the camera's.
        centre_m: float64 (3,), where it stands in these axes.
        is_straight: it has no distortion, and rectification doesn't turn it.
    """

    frame: str
    size: tuple[int, int]
    model: str
    k: Matrix
    d: Matrix
    turn: Matrix
    centre_m: Matrix
    is_straight: bool


def recorded_cameras(rig: RecordedRig, frames: Mapping[Position, str]) -> dict[Position, RecordedCamera]:
    """The cameras before rectification; none where a calibration is missing.

    A transform leads from the axes of the pictures' frame. Without transforms, R leads to the rectified
    axes that all cameras share, and P's fourth column to the place in them.
    """
    if rig.nominal or not all(frame in rig.calibrations for frame in frames.values()):
        return {}
    poses = {frame: _pose(rig.transforms, frame) for frame in frames.values()}
    placed = len({root for root, _, _ in poses.values()}) == 1 and all(
        frame in rig.transforms for frame in frames.values()
    )
    found = {}
    for position, frame in frames.items():
        message = rig.calibrations[frame]
        if len(message.K) != 9 or min(message.K[0], message.K[4]) <= 0:
            return {}
        _, turn, place = poses[frame]
        if not placed:
            projection = np.array(message.P or _extended(message.K), np.float64)
            if projection.size != 12 or min(projection[[0, 5]]) <= 0:
                return {}
            turn = np.array(message.R if len(message.R) == 9 else np.eye(3).ravel()).reshape(3, 3)
            place = np.array([-projection[3] / projection[0], -projection[7] / projection[5], 0.0])
        found[position] = RecordedCamera(
            frame,
            (message.width, message.height),
            message.distortion_model,
            np.array(message.K, np.float64).reshape(3, 3),
            np.array(message.D, np.float64),
            turn.T,
            place,
            _is_straight(message),
        )
    return found


def _is_straight(message: Any) -> bool:
    turn = np.array(message.R if len(message.R) == 9 else np.eye(3).ravel()).reshape(3, 3)
    turned = np.abs(turn - np.eye(3)).max() > np.radians(ANGLE_DEG)
    return bool(np.abs(message.D).max(initial=0.0) < 1e-9 and not turned)


def _cameras(
    rig: RecordedRig, frames: Mapping[Position, str], size: tuple[int, int]
) -> dict[Position, _Camera]:
    poses = {frame: _pose(rig.transforms, frame) for frame in frames.values()}
    roots = {root for root, _, _ in poses.values()}
    placed = len(roots) == 1 and all(frame in rig.transforms for frame in frames.values())
    found = {}
    for position, frame in frames.items():
        message = rig.calibrations[frame]
        if message.width and (message.width, message.height) != size:
            raise NotRectified(
                f"that of frame {frame!r} is for {message.width}x{message.height} px,"
                f" the pictures have {size[0]}x{size[1]}"
            )
        projection = np.array(message.P or _extended(message.K), np.float64)
        if projection.size != 12 or not np.isfinite(projection).all() or min(projection[[0, 5]]) <= 0:
            raise NotRectified(f"that of frame {frame!r} has no focal length")
        rectification = np.array(message.R if len(message.R) == 9 else np.eye(3).ravel(), np.float64).reshape(
            3, 3
        )
        _, turn, place = poses[frame]
        fx, _, cx, tx, _, fy, cy, ty = projection[:8]
        if not placed:
            turn, place = np.eye(3), np.array([-tx / fx, -ty / fy, 0.0])
        else:
            turn = turn @ rectification.T
        found[position] = _Camera((fx, fy), (cx, cy), place, turn)
    return found


def _extended(k: Any) -> list[float]:
    """K as a P without a fourth column."""
    return [*k[0:3], 0.0, *k[3:6], 0.0, *k[6:9], 0.0] if len(k) == 9 else []


def _pose(transforms: Mapping[str, Any], frame: str) -> tuple[str, Matrix, Matrix]:
    """Root frame, and rotation and translation from a frame to it."""
    turn, place = np.eye(3), np.zeros(3)
    for _ in range(len(transforms)):
        if frame not in transforms:
            break
        message = transforms[frame]
        step = _rotation(message.rotation)
        shift = message.translation
        turn, place = step @ turn, step @ place + (shift.x, shift.y, shift.z)
        frame = message.parent_frame_id
    return frame, turn, place


def _rotation(q: Any) -> Matrix:
    """A unit quaternion as a matrix; one of length 0, which nobody set, turns nothing."""
    x, y, z, w = (float(value) for value in (q.x, q.y, q.z, q.w))
    length = np.sqrt(x * x + y * y + z * z + w * w)
    if not length > 0:
        return np.eye(3)
    x, y, z, w = x / length, y / length, z / length, w / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _check_alike(cameras: Mapping[Position, _Camera], frames: Mapping[Position, str]) -> None:
    first = cameras[min(cameras)]
    for position, camera in cameras.items():
        for ours, theirs in zip(camera.focal_px, first.focal_px, strict=True):
            if abs(ours - theirs) > FOCAL_SHARE * theirs:
                text = f"frame {frames[position]!r} has a focal length of {ours:g} px, another {theirs:g}"
                raise NotRectified(text)
        cosine = (np.trace(first.turn.T @ camera.turn) - 1) / 2
        angle = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        if not angle <= ANGLE_DEG:
            raise NotRectified(f"frame {frames[position]!r} is turned by {angle:.2f} degrees against another")


def _steps_m(
    cameras: Mapping[Position, _Camera], frames: Mapping[Position, str]
) -> tuple[float | None, float | None]:
    """Metres of a step to the right and of one down; None in an array of one column or row."""
    origin = min(cameras)
    first = cameras[origin]
    offsets = {p: first.turn.T @ (camera.place_m - first.place_m) for p, camera in cameras.items()}
    (row, col), (last_row, last_col) = origin, max(cameras)
    across = offsets[row, last_col][0] / (last_col - col) if last_col > col else None
    down = offsets[last_row, col][1] / (last_row - row) if last_row > row else None
    steps = [step for step in (across, down) if step is not None]
    if not all(np.isfinite(step) and step > 0 for step in steps):
        raise NotRectified(f"steps of {', '.join(f'{step:g}' for step in steps)} m between its cameras")
    for position, offset in offsets.items():
        expected = ((position[1] - col) * (across or 0), (position[0] - row) * (down or 0), 0.0)
        away = float(np.abs(offset - expected).max())
        if not away <= STEP_SHARE * min(steps):
            raise NotRectified(f"frame {frames[position]!r} is {away:g} m away from its place on the grid")
    return across, down


def _infinity(
    cameras: Mapping[Position, _Camera], frames: Mapping[Position, str], rho: float, *, one_column: bool
) -> float:
    """Disparity of infinity, px for a step: how far the principal point moves (see FORMAT.md, signs)."""
    origin = min(cameras)
    axis = 1 if one_column else 0
    cx, cy = cameras[origin].centre_px
    far = max(cameras) if one_column else (origin[0], max(cameras)[1])
    steps = far[0] - origin[0] if one_column else far[1] - origin[1]
    d_inf = (cameras[origin].centre_px[axis] - cameras[far].centre_px[axis]) / steps
    for (row, col), camera in cameras.items():
        expected = (cx - d_inf * (col - origin[1]), cy - rho * d_inf * (row - origin[0]))
        away = max(abs(a - b) for a, b in zip(camera.centre_px, expected, strict=True))
        if not away <= CENTRE_PX:
            text = f"frame {frames[row, col]!r} has its principal point {away:.2f} px away from the others'"
            raise NotRectified(text)
    return float(d_inf)

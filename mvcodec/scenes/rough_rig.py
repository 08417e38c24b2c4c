"""Rigs as people build them: the sample room seen by cameras that are turned, distorted, unequal, late."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mvcodec.array import Calibration, CameraArray, Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import Picture
from mvcodec.scenes.renderer import Matrix, Optics
from mvcodec.scenes.scene import RoomScene, SceneSettings
from mvcodec.scenes.solids import Vector
from mvcodec.settings import check_settings, setting

FLAWS = ("angles", "positions", "focal", "distortion", "gain", "delay")
"""What may be wrong with a camera; each can be asked for alone."""

ANGLE_DEG = 1.5
POSITION_STEPS = 0.01
FOCAL_SHARE = 0.01
K1, K1_SPREAD = -0.1, 0.03
GAIN_SHARE = 0.2

_SPEC = re.compile(r"rough(?::(\d{1,9}))?(?:,only=([a-z,]+))?")
_EXPECTED = f"rough[:SEED][,only=FLAW,...] with FLAW one of {', '.join(FLAWS)}"


@dataclass(frozen=True, slots=True)
class RoughCamera:
    """One camera's flaws; the defaults are an ideal camera.

    Attributes:
        angles_deg: rotation vector (axis times angle, degrees; x right, y down, z forward). It takes
            a direction in the array's axes to one in the camera's.
        offset_steps: (x, y, z) from the camera's place on the grid, in steps of the grid.
        focal_factor: on the focal length.
        k1: radial distortion.
        gain: factor on the light.
        late_frames: how many frames the camera lags behind.
    """

    angles_deg: Vector = (0.0, 0.0, 0.0)
    offset_steps: Vector = (0.0, 0.0, 0.0)
    focal_factor: float = 1.0
    k1: float = 0.0
    gain: float = 1.0
    late_frames: int = 0

    @property
    def turn(self) -> Matrix:
        """float64 (3, 3): `angles_deg` as a matrix."""
        return np.asarray(Rotation.from_rotvec(self.angles_deg, degrees=True).as_matrix())


@dataclass(frozen=True, slots=True)
class RoughRigSettings:
    """What is asked of a rough rig.

    Each is explained by its field.

    Raises:
        SettingError: a flaw that there is not, or a negative seed.
    """

    seed: int = setting(
        0, "of the flaws; the same flaw of the same seed is the same whatever others there are", low=0
    )
    flaws: tuple[str, ...] = setting(FLAWS, "what is wrong with the cameras", choices=FLAWS)

    def __post_init__(self) -> None:
        check_settings(self)

    @classmethod
    def from_text(cls, text: str) -> RoughRigSettings:
        """``rough[:SEED][,only=FLAW,...]``.

        Raises:
            SettingError: another text.
        """
        match = _SPEC.fullmatch(text)
        if match is None:
            raise SettingError("rig", repr(text), _EXPECTED)
        flaws = FLAWS if match[2] is None else tuple(match[2].split(","))
        try:
            return cls(int(match[1] or 0), flaws)
        except SettingError:
            raise SettingError("rig", repr(text), _EXPECTED) from None

    def cameras(self, rows: int, cols: int) -> dict[Position, RoughCamera]:
        """The flaws of every camera of a grid."""
        positions = [(row, col) for row in range(rows) for col in range(cols)]
        draws = {
            flaw: np.random.default_rng([self.seed, number, rows, cols]) for number, flaw in enumerate(FLAWS)
        }
        late = positions[int(draws["delay"].integers(len(positions)))]
        found = {}
        for position in positions:
            drawn: dict[str, dict[str, Any]] = {
                "angles": {"angles_deg": _three(draws["angles"], ANGLE_DEG)},
                "positions": {"offset_steps": _three(draws["positions"], POSITION_STEPS)},
                "focal": {"focal_factor": 1 + _one(draws["focal"], FOCAL_SHARE)},
                "distortion": {"k1": K1 + _one(draws["distortion"], K1_SPREAD)},
                "gain": {"gain": 1 + _one(draws["gain"], GAIN_SHARE)},
                "delay": {"late_frames": int(position == late)},
            }
            chosen: dict[str, Any] = {}
            for flaw in self.flaws:
                chosen |= drawn[flaw]
            found[position] = RoughCamera(**chosen)
        return found


def _one(draw: np.random.Generator, most: float) -> float:
    return float(draw.uniform(-most, most))


def _three(draw: np.random.Generator, most: float) -> Vector:
    x, y, z = (float(value) for value in draw.uniform(-most, most, 3))
    return x, y, z


class RoughScene:
    """A Scene: the room as a rough rig sees it. `array` states no calibration, as its owner has none.

    Args:
        room: the ideal rig.
        cameras: the flaws of every camera of its grid.
        settings: what they were made from.
    """

    licence = RoomScene.licence

    def __init__(
        self, room: RoomScene, cameras: Mapping[Position, RoughCamera], settings: RoughRigSettings
    ) -> None:
        self.room, self.cameras, self.settings = room, dict(cameras), settings
        self.frame_count = room.frame_count
        size = room.array.width, room.array.height
        self.array: CameraArray = replace(
            room.array,
            calibration=Calibration.nominal(*size),
            disparity_per_step_px=None,
            name="rough",
        )

    @classmethod
    def of(cls, settings: SceneSettings, rig: RoughRigSettings) -> RoughScene:
        """The rough rig of these settings."""
        room = RoomScene(settings)
        return cls(room, rig.cameras(room.array.rows, room.array.cols), rig)

    def render(self, viewpoint: Viewpoint, frame: int) -> tuple[Picture, None]:
        """See Scene; at the places of cameras only. Its disparity is none of a rectified array."""
        position = viewpoint.position
        if position not in self.cameras:
            raise SettingError("viewpoint", f"{viewpoint.row:g},{viewpoint.col:g}", "the place of a camera")
        camera, (row, col) = self.cameras[position], position
        x, y, z = camera.offset_steps
        ideal = self.room.array
        optics = Optics(ideal.width, ideal.height, ideal.calibration.fx_px * camera.focal_factor, camera.k1)
        place = (col + x, row + y, z)
        picture, _ = self.room.look(place, frame - camera.late_frames, optics, camera.turn, camera.gain)
        return picture, None

    def truth(self) -> dict[str, Any]:
        """What `rig_truth.json` states: every camera's flaws and optics, exactly."""
        array, step_m = self.array, self.room.array.calibration.baseline_m
        ideal = self.room.array.calibration
        cameras = {}
        for (row, col), camera in self.cameras.items():
            x, y, z = camera.offset_steps
            cameras[f"r{row:02d}_c{col:02d}"] = {
                "angles_deg": list(camera.angles_deg),
                "rotation": camera.turn.tolist(),
                "position_m": [(col + x) * step_m, (row + y) * step_m, z * step_m],
                "offset_steps": list(camera.offset_steps),
                "focal_px": ideal.fx_px * camera.focal_factor,
                "cx_px": ideal.cx_px,
                "cy_px": ideal.cy_px,
                "k1": camera.k1,
                "gain": camera.gain,
                "late_frames": camera.late_frames,
            }
        return {
            "seed": self.settings.seed,
            "flaws": list(self.settings.flaws),
            "rows": array.rows,
            "cols": array.cols,
            "ideal": {"focal_px": ideal.fx_px, "baseline_m": step_m},
            "cameras": cameras,
        }

"""A rig: its cameras' lenses, directions and places, and the rectified array that it becomes.

Axes are those of the array: x right, y down, z forward. RIG.json holds one; docs/rigs.md lists its fields.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import MAX_GRID_SIDE, MAX_PICTURE_SIDE, Calibration, CameraArray, Position
from mvcodec.errors import InputError, SettingError
from mvcodec.fields import Fields
from mvcodec.stream import view_name

Vectors = NDArray[np.float64]

RIG_KIND = "mvcodec rig"
MODELS = {"pinhole": (4, 5, 8), "fisheye": (4,)}
"""Lens models of OpenCV, and how many coefficients each may have."""


@dataclass(frozen=True, slots=True)
class Lens:
    """From a direction to a pixel.

    Attributes:
        model: `pinhole` (Brown's k1 k2 p1 p2 [k3 [k4 k5 k6]], as OpenCV has them) or `fisheye`
            (Kannala and Brandt's k1 .. k4).
        focal_px: (fx, fy).
        centre_px: (cx, cy), where (0, 0) is the centre of the first pixel.
        coefficients: of the distortion.
    """

    model: str
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.model not in MODELS:
            raise SettingError("lens model", self.model, " | ".join(MODELS))
        if len(self.coefficients) not in MODELS[self.model]:
            counts = " or ".join(map(str, MODELS[self.model]))
            raise SettingError("lens coefficients", f"{len(self.coefficients)} of them", counts)
        if not min(self.focal_px) > 0:
            raise SettingError("lens focal length", min(self.focal_px), "a positive number, px")

    @property
    def matrix(self) -> Vectors:
        """float64 (3, 3): K."""
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


@dataclass(frozen=True, slots=True, eq=False)
class RigCamera:
    """One camera of a rig.

    Attributes:
        lens: of the camera.
        turn: float64 (3, 3), takes a direction in the array's axes to one in the camera's.
        place: float64 (3,), (x, y, z) in steps of the grid from place (0, 0) of the grid.
        gain, offset: float64 (3,), a channel's value v is replaced by ``gain * v + offset``.
    """

    lens: Lens
    turn: Vectors
    place: Vectors
    gain: Vectors
    offset: Vectors


@dataclass(frozen=True, slots=True)
class Rectified:
    """The pictures of the rectified array: one pinhole camera for all, without distortion.

    Attributes:
        width, height: px.
        focal_px: for both axes.
        centre_px: (cx, cy).
        baseline_m: metres of a step to the right (down in a single column); None: not known.
        rho: steps down in steps to the right (pixels are square); 1 in a single row or column.
        typical_w: inverse depth, 1 / steps, at which cameras that stand beside their places are right.
    """

    width: int
    height: int
    focal_px: float
    centre_px: tuple[float, float]
    baseline_m: float | None = None
    rho: float = 1.0
    typical_w: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A calibrated rig.

    Attributes:
        rows, cols: of its grid.
        source_size: (width, height) of the cameras' pictures, px.
        cameras: by place on the grid.
        rectified: what its pictures are turned into.
        found_by: `scene`, `board` or `file`.
        figures: what was measured on the way, for people to read.
    """

    rows: int
    cols: int
    source_size: tuple[int, int]
    cameras: Mapping[Position, RigCamera]
    rectified: Rectified
    found_by: str
    figures: Mapping[str, Any]

    def array(self, before: CameraArray) -> CameraArray:
        """The rectified array that an input of this rig becomes.

        Raises:
            SettingError: the input has another grid, or pictures of another size.
        """
        if (before.rows, before.cols) != (self.rows, self.cols):
            found = f"a rig of {self.rows}x{self.cols} cameras"
            raise SettingError("rig", found, f"{before.rows}x{before.cols}, the grid of the input")
        if (before.width, before.height) != self.source_size:
            found = "a rig of {}x{} px".format(*self.source_size)
            raise SettingError("rig", found, f"{before.width}x{before.height} px, the size of the input")
        after = self.rectified
        nominal = Calibration.nominal(after.width, after.height)
        calibration = Calibration(
            after.focal_px,
            after.focal_px,
            *after.centre_px,
            after.baseline_m or nominal.baseline_m,
            given=after.baseline_m is not None,
        )
        return replace(
            before,
            width=after.width,
            height=after.height,
            calibration=calibration,
            rho=after.rho,
            disparity_per_step_px=None,
        )

    def document(self) -> dict[str, Any]:
        """The object of RIG.json."""
        after = self.rectified
        return {
            "kind": RIG_KIND,
            "rows": self.rows,
            "cols": self.cols,
            "width": self.source_size[0],
            "height": self.source_size[1],
            "found_by": self.found_by,
            "rectified": {
                "width": after.width,
                "height": after.height,
                "focal_px": after.focal_px,
                "centre_px": list(after.centre_px),
                "baseline_m": after.baseline_m,
                "rho": after.rho,
                "typical_w": after.typical_w,
            },
            "cameras": {view_name(place): _camera_document(camera) for place, camera in self.cameras.items()},
            "figures": dict(self.figures),
        }


def _camera_document(camera: RigCamera) -> dict[str, Any]:
    lens = camera.lens
    return {
        "model": lens.model,
        "focal_px": list(lens.focal_px),
        "centre_px": list(lens.centre_px),
        "coefficients": list(lens.coefficients),
        "rotation": camera.turn.tolist(),
        "place_steps": camera.place.tolist(),
        "gain": camera.gain.tolist(),
        "offset": camera.offset.tolist(),
    }


def rig_text(rig: Rig) -> str:
    """RIG.json as a text."""
    return json.dumps(rig.document(), indent=2) + "\n"


def read_rig(path: Path) -> Rig:
    """Read RIG.json.

    Raises:
        InputError: unreadable, malformed, no rig, or a field that is missing or wrong (named).
    """
    fields = Fields.load(path)
    if fields.values.get("kind") != RIG_KIND:
        raise InputError(
            path, f"kind = {fields.values.get('kind')!r}", f"{RIG_KIND!r}, as `mvcodec rectify` writes"
        )
    rows, cols = (fields.integer(key, 1, MAX_GRID_SIDE) for key in ("rows", "cols"))
    size = fields.integer("width", 1, MAX_PICTURE_SIDE), fields.integer("height", 1, MAX_PICTURE_SIDE)
    inner = fields.inner("cameras")
    cameras = {}
    for row in range(rows):
        for col in range(cols):
            cameras[row, col] = _camera_of(inner.inner(view_name((row, col))))
    after = fields.inner("rectified")
    return Rig(
        rows,
        cols,
        size,
        cameras,
        _rectified_of(after),
        fields.text("found_by", "file"),
        fields.values.get("figures") or {},
    )


def _rectified_of(fields: Fields) -> Rectified:
    baseline = fields.values.get("baseline_m")
    x, y = _numbers(fields, "centre_px", (2,))
    return Rectified(
        fields.integer("width", 1, MAX_PICTURE_SIDE),
        fields.integer("height", 1, MAX_PICTURE_SIDE),
        fields.number("focal_px", positive=True),
        (float(x), float(y)),
        None if baseline is None else fields.number("baseline_m", positive=True),
        fields.number("rho", 1.0, positive=True),
        fields.number("typical_w", 0.0),
    )


def _camera_of(fields: Fields) -> RigCamera:
    fx, fy = _numbers(fields, "focal_px", (2,)).tolist()
    cx, cy = _numbers(fields, "centre_px", (2,)).tolist()
    values = fields.get("coefficients", "a list of numbers")
    count = len(values) if isinstance(values, list) else 0
    try:
        coefficients = tuple(_numbers(fields, "coefficients", (count,)).tolist())
        lens = Lens(fields.text("model"), (fx, fy), (cx, cy), coefficients)
    except SettingError as error:
        raise fields.wrong(error.setting, error.found, error.expected) from None
    turn = _numbers(fields, "rotation", (3, 3))
    if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-3 or np.linalg.det(turn) < 0:
        raise fields.wrong("rotation", "a matrix that is none", "a rotation, 3 rows of 3 numbers")
    return RigCamera(
        lens,
        turn,
        _numbers(fields, "place_steps", (3,)),
        _numbers(fields, "gain", (3,), [1.0] * 3),
        _numbers(fields, "offset", (3,), [0.0] * 3),
    )


def _numbers(fields: Fields, key: str, shape: Sequence[int], default: object = None) -> Vectors:
    """A list of finite numbers, or a list of such."""
    expected = f"{' x '.join(map(str, shape))} finite numbers"
    value = fields.get(key, expected, *([] if default is None else [default]))
    try:
        numbers = np.array(value, np.float64)
    except (ValueError, TypeError):
        raise fields.wrong(key, "something else", expected) from None
    if numbers.shape != tuple(shape) or not np.isfinite(numbers).all():
        raise fields.wrong(key, f"{numbers.shape} of them", expected)
    return numbers

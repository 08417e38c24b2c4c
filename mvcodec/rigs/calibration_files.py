"""Files that say how cameras are: Kalibr's camera chain, EuRoC's sensor.yaml, ROS's camera_info YAML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import InputError, MissingExtra, SettingError
from mvcodec.rigs.rig import Lens

Vectors = NDArray[np.float64]

EXPECTED = "a Kalibr camera chain, an EuRoC sensor.yaml, a ROS camera_info YAML, or a RIG.json"
_LENSES = {
    "radtan": "pinhole",
    "radial-tangential": "pinhole",
    "plumb_bob": "pinhole",
    "rational_polynomial": "pinhole",
    "none": "pinhole",
    "": "pinhole",
    "equidistant": "fisheye",
    "equidist": "fisheye",
    "fisheye": "fisheye",
}


@dataclass(frozen=True, slots=True, eq=False)
class KnownCamera:
    """A calibrated camera somewhere.

    Attributes:
        size: (width, height) of its pictures, px.
        lens: of the camera.
        turn: float64 (3, 3), takes a direction in the axes that all cameras share to one in the camera's.
        centre_m: float64 (3,), where it stands in these axes, m.
    """

    size: tuple[int, int]
    lens: Lens
    turn: Vectors
    centre_m: Vectors


def read_cameras(paths: Sequence[Path]) -> list[KnownCamera]:
    """The cameras of one camera chain, or one of each file, in the order of the files.

    Raises:
        InputError: unreadable, or nothing that is known here; names the file and the key.
        MissingExtra: PyYAML is not there.
    """
    documents = [(path, _load(path)) for path in paths]
    if len(documents) == 1 and "cam0" in documents[0][1]:
        return _chain(*documents[0])
    return [_single(path, document) for path, document in documents]


def _load(path: Path) -> dict[str, Any]:
    try:
        import yaml
    except ImportError:
        raise MissingExtra("PyYAML", "rigs") from None
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(path, error.strerror or "an unreadable file", EXPECTED) from None
    except UnicodeDecodeError:
        raise InputError(path, "no text", EXPECTED) from None
    # OpenCV's header, which YAML has another form of.
    lines = [line for line in text.splitlines() if not line.startswith("%YAML")]
    try:
        document = yaml.safe_load("\n".join(lines).replace("!!opencv-matrix", ""))
    except yaml.YAMLError as error:
        found = f"malformed YAML ({' '.join(str(error).split())[:100]})"
        raise InputError(path, found, EXPECTED) from None
    if not isinstance(document, dict):
        raise InputError(path, "no keys and values", EXPECTED)
    return document


def _single(path: Path, document: dict[str, Any]) -> KnownCamera:
    if "T_BS" in document:
        return _euroc(path, document)
    if "camera_matrix" in document:
        return _ros(path, document)
    raise InputError(path, f"the keys {', '.join(map(str, list(document)[:6]))}", EXPECTED)


def _chain(path: Path, document: dict[str, Any]) -> list[KnownCamera]:
    """Kalibr: T_cn_cnm1 takes points from the axes of the camera before to those of this one."""
    cameras: list[KnownCamera] = []
    pose = np.eye(4)
    while f"cam{len(cameras)}" in document:
        key = f"cam{len(cameras)}"
        camera = document[key]
        if not isinstance(camera, dict):
            raise InputError(path, f"{key} = {type(camera).__name__}", "the camera's keys and values")
        if cameras:
            pose = _matrix(path, camera, "T_cn_cnm1", (4, 4)) @ pose
        turn = pose[:3, :3]
        lens = _lens(path, camera, "distortion_coeffs")
        cameras.append(KnownCamera(_resolution(path, camera), lens, turn, -turn.T @ pose[:3, 3]))
    return cameras


def _euroc(path: Path, document: dict[str, Any]) -> KnownCamera:
    """EuRoC: T_BS takes points from the camera's axes to the body's."""
    pose = _matrix(path, document, "T_BS", (4, 4))
    lens = _lens(path, document, "distortion_coefficients")
    return KnownCamera(_resolution(path, document), lens, pose[:3, :3].T, pose[:3, 3])


def _ros(path: Path, document: dict[str, Any]) -> KnownCamera:
    """ROS: R takes directions in the camera's axes to those of the rectified pair; P has -f B."""
    size = tuple(_whole(path, document, key) for key in ("image_width", "image_height"))
    k = _matrix(path, document, "camera_matrix", (3, 3))
    coefficients = _matrix(path, document, "distortion_coefficients", None).ravel()
    lens = make_lens(
        path, str(document.get("distortion_model", "plumb_bob")), k[[0, 1, 0, 1], [0, 1, 2, 2]], coefficients
    )
    r = _matrix(path, document, "rectification_matrix", (3, 3))
    p = _matrix(path, document, "projection_matrix", (3, 4))
    centre = np.array([-p[0, 3] / p[0, 0], -p[1, 3] / p[1, 1], 0.0])
    return KnownCamera((size[0], size[1]), lens, r.T, centre)


def make_lens(source: Path | str, model: str, intrinsics: Vectors, coefficients: Vectors) -> Lens:
    """A lens by the names that calibration files have for it.

    Args:
        source: of the values, for messages.
        model: such as `radtan`, `plumb_bob` or `equidistant`.
        intrinsics: (4,), fx, fy, cx, cy.
        coefficients: of the distortion; none at all are zeros.

    Raises:
        InputError: a model or number of coefficients that is not known here.
    """
    name = model.strip().lower()
    if name not in _LENSES:
        expected = f"one of {', '.join(sorted(key for key in _LENSES if key))}"
        raise InputError(source, f"distortion model {model!r}", expected)
    values = tuple(float(value) for value in coefficients) or (0.0,) * 4
    fx, fy, cx, cy = (float(value) for value in intrinsics)
    try:
        return Lens(_LENSES[name], (fx, fy), (cx, cy), values)
    except SettingError as error:
        raise InputError(source, f"{error.setting} = {error.found}", error.expected) from None


def _lens(path: Path, document: dict[str, Any], key: str) -> Lens:
    kind = str(document.get("camera_model", "pinhole"))
    if kind != "pinhole":
        raise InputError(path, f"camera_model = {kind}", "pinhole, with radtan or equidistant distortion")
    intrinsics = _matrix(path, document, "intrinsics", (4,))
    model = str(document.get("distortion_model", "none"))
    coefficients = np.empty(0) if model == "none" else _matrix(path, document, key, None).ravel()
    return make_lens(path, model, intrinsics, coefficients)


def _resolution(path: Path, document: dict[str, Any]) -> tuple[int, int]:
    width, height = _matrix(path, document, "resolution", (2,))
    return int(width), int(height)


def _whole(path: Path, document: dict[str, Any], key: str) -> int:
    value = document.get(key)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(path, f"{key} = {value!r}", "a whole number")
    return value


def _matrix(path: Path, document: dict[str, Any], key: str, shape: tuple[int, ...] | None) -> Vectors:
    """A list of numbers, a list of lists of them, or rows, cols and data."""
    if key not in document:
        raise InputError(path, f"no {key}", EXPECTED)
    value = document[key]
    if isinstance(value, dict):
        value = value.get("data")
    expected = "finite numbers" if shape is None else f"{' x '.join(map(str, shape))} finite numbers"
    try:
        numbers = np.array(value, np.float64)
    except (TypeError, ValueError):
        raise InputError(path, f"{key} = {value!r:.60}", expected) from None
    if shape is not None:
        if numbers.size != np.prod(shape):
            raise InputError(path, f"{key} with {numbers.size} numbers", expected)
        numbers = numbers.reshape(shape)
    if not np.isfinite(numbers).all():
        raise InputError(path, f"{key} = {value!r:.60}", expected)
    return numbers

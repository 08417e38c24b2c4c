"""The rig of a recording that says how its cameras' lenses are."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mvcodec.array import CameraArray, Position
from mvcodec.capture.recorded_calibration import RecordedCamera
from mvcodec.errors import InputError
from mvcodec.rigs.calibration_files import KnownCamera, make_lens
from mvcodec.rigs.known import rig_from_cameras
from mvcodec.rigs.rig import Rig


def recorded_rig(array: CameraArray, recorded: Mapping[Position, RecordedCamera], name: str) -> Rig:
    """The rig of recorded cameras; its colours are left as they are.

    Args:
        array: the grid; all of its cameras must be recorded.
        recorded: by place on the grid.
        name: of the recording.

    Raises:
        InputError: a camera is missing, of another size or lens, or beside its place.
    """
    cameras = []
    for position in array.positions:
        if position not in recorded:
            found = f"no calibration with K of camera {position[0]},{position[1]}"
            raise InputError(name, found, "one of every camera of the grid")
        camera = recorded[position]
        intrinsics = camera.k[[0, 1, 0, 1], [0, 1, 2, 2]]
        lens = make_lens(
            f"{name}: frame {camera.frame!r}", camera.model, intrinsics, np.trim_zeros(camera.d, "b")
        )
        size = camera.size if camera.size[0] else (array.width, array.height)
        cameras.append(KnownCamera(size, lens, camera.turn, camera.centre_m))
    return rig_from_cameras(array, cameras, name, "file")

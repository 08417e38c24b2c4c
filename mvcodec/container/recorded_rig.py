"""What a recording says about its cameras: Foxglove's calibrations and transforms, by frame."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError

from mvcodec.errors import StreamError
from mvcodec.stream import StreamHeader

MAX_FRAMES = 10_000
"""Frames beyond that are left out: no rig has so many."""

_HEADER_SCHEMA = "mvcodec.Header"

RIG_SCHEMAS = frozenset(
    {
        ("foxglove.CameraCalibration", "protobuf"),
        ("foxglove.FrameTransform", "protobuf"),
        ("foxglove.FrameTransforms", "protobuf"),
        (_HEADER_SCHEMA, "json"),
    }
)
"""(schema, message encoding) of messages about cameras."""


class RecordedRig:
    """Takes messages in; keeps the latest of each frame.

    Attributes:
        calibrations: frame -> its foxglove.CameraCalibration.
        transforms: child frame -> its foxglove.FrameTransform.
        nominal: the recording is a file of ours, which says that its calibration is made up.
    """

    def __init__(self) -> None:
        self.calibrations: dict[str, Any] = {}
        self.transforms: dict[str, Any] = {}
        self.nominal = False

    def push(self, schema: str, encoding: str, data: bytes) -> None:
        """Take a message of any schema; what is damaged or says nothing of the rig is passed over."""
        if (schema, encoding) not in RIG_SCHEMAS:
            return
        with suppress(DecodeError, StreamError):
            if schema == "foxglove.CameraCalibration":
                calibration = CameraCalibration.FromString(data)
                _keep(self.calibrations, calibration.frame_id, calibration)
            elif schema == "foxglove.FrameTransform":
                self._add(FrameTransform.FromString(data))
            elif schema == "foxglove.FrameTransforms":
                for transform in FrameTransforms.FromString(data).transforms:
                    self._add(transform)
            elif schema == _HEADER_SCHEMA:
                self.nominal = not StreamHeader.from_json(data).array.calibration.given

    def _add(self, transform: Any) -> None:
        _keep(self.transforms, transform.child_frame_id, transform)


def _keep(kept: dict[str, Any], frame: str, message: Any) -> None:
    if frame in kept or len(kept) < MAX_FRAMES:
        kept[frame] = message

"""The messages of a file without our header, topic by topic: videos, points, calibration and places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from google.protobuf.message import DecodeError
from mcap.well_known import MessageEncoding

from mvcodec.conformance.file_check import CheckedMessage
from mvcodec.conformance.finding import Finding, error, warning
from mvcodec.video.codecs import CODECS

VIDEO, POINTS = "foxglove.CompressedVideo", "foxglove.PointCloud"

_CALIBRATION, _TRANSFORM, _TRANSFORMS = (
    "foxglove.CameraCalibration",
    "foxglove.FrameTransform",
    "foxglove.FrameTransforms",
)
_MESSAGES: dict[str, Any] = {
    VIDEO: CompressedVideo,
    POINTS: PointCloud,
    _CALIBRATION: CameraCalibration,
    _TRANSFORM: FrameTransform,
    _TRANSFORMS: FrameTransforms,
}
_NAMES = {codec.foxglove: name for name, codec in CODECS.items()}

_Type = PackedElementField.NumericType
_BYTES = {
    _Type.UINT8: 1,
    _Type.INT8: 1,
    _Type.UINT16: 2,
    _Type.INT16: 2,
    _Type.UINT32: 4,
    _Type.INT32: 4,
    _Type.FLOAT32: 4,
    _Type.FLOAT64: 8,
}


class TopicCheck:
    """Checks messages one by one. Those of other schemas than Foxglove's for videos, points and rigs pass.

    Args:
        add: takes what is wrong.
    """

    def __init__(self, add: Callable[[Finding], None]) -> None:
        self._add = add
        self._latest_ns: int | None = None
        self._times_ns: dict[str, int] = {}
        self._frames: dict[str, str] = {}
        self._calibrated: dict[str, str] = {}
        self._placed: set[str] = set()

    def push(self, message: CheckedMessage) -> tuple[str, bytes] | None:
        """Check a message; returns codec and access unit of a video message."""
        time_ns = message.record.log_time
        where = (message.topic, time_ns)
        if self._latest_ns is not None and time_ns < self._latest_ns:
            came = f"a time before {self._latest_ns / 1e9:.3f} s, which came first"
            self._add(error("order", came, *where))
        self._latest_ns = time_ns
        if message.schema not in _MESSAGES:
            return None
        if message.encoding != MessageEncoding.Protobuf:
            text = f"{message.schema} as {message.encoding!r}, expected protobuf"
            self._add(error("schema", text, *where))
            return None
        try:
            parsed = _MESSAGES[message.schema].FromString(message.record.data)
        except DecodeError as failure:
            self._add(error("schema", f"a damaged message ({failure})", *where))
            return None
        if message.schema == _CALIBRATION:
            self._calibrated.setdefault(parsed.frame_id, message.topic)
        elif message.schema == _TRANSFORM:
            self._placed.add(parsed.child_frame_id)
        elif message.schema == _TRANSFORMS:
            self._placed |= {transform.child_frame_id for transform in parsed.transforms}
        else:
            self._check_stamps(message, parsed)
            if message.schema == VIDEO:
                return self._video(parsed, where)
            self._points(parsed, where)
        return None

    def end(self) -> list[Finding]:
        """What of the rig does not fit the videos; a file need not have one."""
        videos = {frame: topic for topic, frame in self._frames.items()}
        findings = [
            error("frame-id", f"calibration of {frame!r}, which is no video's frame_id", topic)
            for frame, topic in self._calibrated.items()
            if videos and frame not in videos
        ]
        for frame, topic in videos.items():
            if self._calibrated and frame not in self._calibrated:
                findings.append(error("frame-id", f"no calibration of its frame_id {frame!r}", topic))
            if self._placed and frame not in self._placed:
                findings.append(error("frame-id", f"no transform of its frame_id {frame!r}", topic))
        return findings

    def _check_stamps(self, message: CheckedMessage, parsed: Any) -> None:
        """Times and frame of a picture or of points."""
        topic, time_ns = message.topic, message.record.log_time
        last_ns = self._times_ns.get(topic)
        if last_ns is not None and time_ns == last_ns:
            self._add(error("order", "two messages of one time", topic, time_ns))
        self._times_ns[topic] = time_ns
        if parsed.timestamp.seconds * 1_000_000_000 + parsed.timestamp.nanos != time_ns:
            self._add(warning("time", "its timestamp is not its log_time", topic, time_ns))
        if not parsed.frame_id:
            self._add(error("frame-id", "no frame_id", topic, time_ns))
        elif message.schema == VIDEO and self._frames.setdefault(topic, parsed.frame_id) != parsed.frame_id:
            text = f"frame_id {parsed.frame_id!r}, {self._frames[topic]!r} before"
            self._add(error("frame-id", text, topic, time_ns))

    def _video(self, parsed: Any, where: tuple[str, int]) -> tuple[str, bytes] | None:
        if parsed.format not in _NAMES:
            text = f"format {parsed.format!r}, expected one of {', '.join(_NAMES)}"
            self._add(error("format", text, *where))
            return None
        return _NAMES[parsed.format], parsed.data

    def _points(self, parsed: Any, where: tuple[str, int]) -> None:
        stride = parsed.point_stride
        if not stride or len(parsed.data) % stride:
            text = f"{len(parsed.data)} bytes of points, expected a multiple of point_stride {stride}"
            self._add(error("points", text, *where))
        names = {field.name for field in parsed.fields}
        if not {"x", "y", "z"} <= names:
            found = ", ".join(sorted(names)) or "none"
            self._add(error("points", f"fields {found}, expected x, y and z", *where))
        for field in parsed.fields:
            size = _BYTES.get(field.type)
            if size is None or field.offset + size > stride:
                text = (
                    f"field {field.name!r} at {field.offset} of unknown type or beyond point_stride {stride}"
                )
                self._add(error("points", text, *where))

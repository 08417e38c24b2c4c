"""What is inside the file's messages: Foxglove's schemas for video and rig, JSON for our header."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from google.protobuf.message import DecodeError
from mcap_protobuf.schema import build_file_descriptor_set

from mvcodec.array import CameraArray, Position
from mvcodec.errors import StreamError
from mvcodec.stream import Packet, view_name

RIG_FRAME = "rig"
"""Root frame: x forward, y left, z up (REP 103), at camera (0, 0)."""

TRANSFORM_TOPIC = "/tf"

OPTICAL_TO_RIG = (-0.5, 0.5, -0.5, 0.5)
"""Quaternion (x, y, z, w) that turns optical axes (x right, y down, z forward) into the rig's."""

HEADER_SCHEMA_NAME = "mvcodec.Header"

# Short, since a file holds it twice; FORMAT.md has the whole.
HEADER_SCHEMA = json.dumps(
    {
        "type": "object",
        "properties": {
            "format": {"const": "mvcodec"},
            "version": {"type": "integer"},
            "codec": {"type": "string"},
            "array": {"type": "object"},
            "disparity_range_px": {"type": "array"},
            "first_frame": {"type": "integer"},
            "settings": {"type": "object"},
        },
    },
    separators=(",", ":"),
).encode()

PROTOBUF_SCHEMAS: dict[str, tuple[str, bytes]] = {
    kind: (message.DESCRIPTOR.full_name, build_file_descriptor_set(message).SerializeToString())
    for kind, message in (
        ("video", CompressedVideo),
        ("calibration", CameraCalibration),
        ("transform", FrameTransform),
    )
}
"""Kind of message -> (schema name, serialised FileDescriptorSet)."""


VIDEO_FORMATS = {"h264": "h264", "hevc": "h265", "av1": "av1"}
"""The header's name of a codec -> foxglove.CompressedVideo's; a name not listed is itself."""


@dataclass(frozen=True, slots=True, eq=False)
class RigMessage:
    """A message about the rig; it says the same at all times.

    Attributes:
        kind: key of PROTOBUF_SCHEMAS.
        at: time_ns -> the serialised message stamped with that time.
    """

    topic: str
    kind: str
    at: Callable[[int], bytes]


def frame_id(camera: Position) -> str:
    """The optical frame of a camera, e.g. ``camera_r00_c04``."""
    return f"camera_{view_name(camera)}"


def rig_messages(array: CameraArray) -> tuple[RigMessage, ...]:
    """Calibration and place of every real camera."""
    messages = []
    for camera in array.real:
        calibration = _calibration(array, camera)
        messages.append(RigMessage(f"/camera/{view_name(camera)}/calibration", "calibration", calibration))
        messages.append(RigMessage(TRANSFORM_TOPIC, "transform", _transform(array, camera)))
    return tuple(messages)


def video_message(packet: Packet, codec: str) -> bytes:
    """A serialised foxglove.CompressedVideo of a packet."""
    assert packet.track.camera is not None
    name = VIDEO_FORMATS.get(codec, codec)
    message = CompressedVideo(frame_id=frame_id(packet.track.camera), data=packet.data, format=name)
    message.timestamp.FromNanoseconds(packet.time_ns)
    data: bytes = message.SerializeToString()
    return data


def video_data(message: bytes, source: str, codec: str) -> bytes:
    """The access unit inside a serialised foxglove.CompressedVideo.

    Raises:
        StreamError: it is not one, or of another codec than the header says.
    """
    try:
        parsed = CompressedVideo.FromString(message)
    except DecodeError as error:
        raise StreamError(source, f"a damaged message ({error})", "foxglove.CompressedVideo") from None
    expected = VIDEO_FORMATS.get(codec, codec)
    if parsed.format != expected:
        raise StreamError(source, f"video of format {parsed.format!r}", f"{expected!r}, as the header says")
    data: bytes = parsed.data
    return data


def _calibration(array: CameraArray, camera: Position) -> Callable[[int], bytes]:
    c = array.calibration
    message = CameraCalibration(
        frame_id=frame_id(camera),
        width=array.width,
        height=array.height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1],
        R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=[c.fx_px, 0, c.cx_px, 0, 0, c.fy_px, c.cy_px, 0, 0, 0, 1, 0],
    )
    return _stamped(message)


def _transform(array: CameraArray, camera: Position) -> Callable[[int], bytes]:
    right, down, forward = array.camera_position_m(camera)
    message = FrameTransform(parent_frame_id=RIG_FRAME, child_frame_id=frame_id(camera))
    message.translation.x, message.translation.y, message.translation.z = forward, -right, -down
    rotation = message.rotation
    rotation.x, rotation.y, rotation.z, rotation.w = OPTICAL_TO_RIG
    return _stamped(message)


def _stamped(message: Any) -> Callable[[int], bytes]:
    def at(time_ns: int) -> bytes:
        message.timestamp.FromNanoseconds(time_ns)
        data: bytes = message.SerializeToString()
        return data

    return at

"""What is inside the file's messages: Foxglove's schemas for video and rig, JSON for our header."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError, Message
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap_protobuf.schema import build_file_descriptor_set

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.errors import StreamError
from mvcodec.stream import Packet, Track, TrackKind, view_name
from mvcodec.video.codecs import foxglove_name

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
            "disparity_scale": {"enum": [1, 2]},
            "disparity_cameras": {"enum": ["all", "alternate", "none"]},
            "first_frame": {"type": "integer"},
            "settings": {"type": "object"},
        },
    },
    separators=(",", ":"),
).encode()

LAYER_SCHEMA_NAME = "mvcodec.Enhancement"

LAYER_SCHEMA = json.dumps(
    {
        "type": "object",
        "properties": {"format": {"const": "mvcodec-enhancement"}, "views": {"type": "array"}},
    },
    separators=(",", ":"),
).encode()

PREDICTED_FORMAT = "vp9-predicted"
"""What messages of predicted pictures call their codec: no viewer knows it, and none tries to play them."""


def _descriptors(message: type[Message]) -> FileDescriptorSet:
    """What a message's schema has to say, without what steers generators of code: a file holds it twice."""
    files: FileDescriptorSet = build_file_descriptor_set(message)
    for file in files.file:
        file.ClearField("options")
    return files


def _predicted_schema() -> tuple[str, bytes]:
    """`mvcodec.PredictedVideo`: the fields of foxglove.CompressedVideo under a name of its own."""
    files = _descriptors(CompressedVideo)
    for file in files.file:
        if file.name == CompressedVideo.DESCRIPTOR.file.name:
            file.name, file.package = "mvcodec/PredictedVideo.proto", "mvcodec"
            file.message_type[0].name = "PredictedVideo"
    return "mvcodec.PredictedVideo", files.SerializeToString()


PROTOBUF_SCHEMAS: dict[str, tuple[str, bytes]] = {
    kind: (message.DESCRIPTOR.full_name, _descriptors(message).SerializeToString())
    for kind, message in (
        ("video", CompressedVideo),
        ("calibration", CameraCalibration),
        ("transform", FrameTransform),
    )
} | {"predicted": _predicted_schema()}
"""Kind of message -> (schema name, serialised FileDescriptorSet)."""


DEPTH_SCHEMA = (
    RawImage.DESCRIPTOR.full_name,
    _descriptors(RawImage).SerializeToString(),
)
"""The same of depth, which few files have."""

DEPTH_ENCODING = "16UC1"


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


def track_frame(track: Track) -> str:
    """The `frame_id` of a video track's messages, e.g. ``view_r01_c01`` for an enhanced view."""
    assert track.camera is not None
    enhanced = track.kind is TrackKind.ENHANCED
    return f"view_{view_name(track.camera)}" if enhanced else frame_id(track.camera)


def rig_messages(array: CameraArray) -> tuple[RigMessage, ...]:
    """Calibration and place of every real camera."""
    places = {camera: Viewpoint(*camera) for camera in array.real}
    return tuple(
        message
        for camera, place in places.items()
        for message in place_messages(
            array, place, f"/camera/{view_name(camera)}/calibration", frame_id(camera)
        )
    )


def place_messages(
    array: CameraArray, place: Viewpoint, topic: str, frame: str
) -> tuple[RigMessage, RigMessage]:
    """Calibration (on a topic) and place of whatever sees from a viewpoint of the array."""
    return (
        RigMessage(topic, "calibration", _calibration(array, place, frame)),
        RigMessage(TRANSFORM_TOPIC, "transform", _transform(array, place, frame)),
    )


def channels(rig: Sequence[RigMessage], videos: Mapping[str, str]) -> list[tuple[str, str, str, str, bytes]]:
    """What `ChunkedFile.add_channel` takes, for each topic of a rig and its videos (topic -> kind), once."""
    kinds = {message.topic: message.kind for message in rig} | dict(videos)
    return [
        (topic, MessageEncoding.Protobuf, name, SchemaEncoding.Protobuf, schema)
        for topic, kind in kinds.items()
        for name, schema in [PROTOBUF_SCHEMAS[kind]]
    ]


_PREDICTED_KINDS = (TrackKind.PREDICTED, TrackKind.ENHANCED)


def video_kind(track: Track) -> str:
    """The kind of a video track's messages, a key of PROTOBUF_SCHEMAS."""
    return "predicted" if track.kind in _PREDICTED_KINDS else "video"


def video_format(track: Track, codec: str) -> str:
    """What the messages of a video track call their codec; `codec` is the header's."""
    return PREDICTED_FORMAT if track.kind in _PREDICTED_KINDS else foxglove_name(codec)


def video_message(packet: Packet, codec: str) -> bytes:
    """A serialised foxglove.CompressedVideo (or mvcodec.PredictedVideo) of a packet."""
    form = video_format(packet.track, codec)
    return compressed_video(track_frame(packet.track), packet.time_ns, packet.data, form)


def compressed_video(frame: str, time_ns: int, data: bytes, form: str) -> bytes:
    """A serialised foxglove.CompressedVideo."""
    message = CompressedVideo(frame_id=frame, data=data, format=form)
    message.timestamp.FromNanoseconds(time_ns)
    serialised: bytes = message.SerializeToString()
    return serialised


def depth_image(packet: Packet, width: int, height: int) -> bytes:
    """A serialised foxglove.RawImage of depth: 16UC1, millimetres; 0 where it is unknown."""
    assert packet.track.camera is not None
    message = RawImage(
        frame_id=frame_id(packet.track.camera),
        width=width,
        height=height,
        encoding=DEPTH_ENCODING,
        step=2 * width,
        data=packet.data,
    )
    message.timestamp.FromNanoseconds(packet.time_ns)
    serialised: bytes = message.SerializeToString()
    return serialised


def depth_data(message: bytes, source: str, width: int, height: int) -> bytes:
    """The pixels inside a serialised foxglove.RawImage, as `depth_image` takes them.

    Raises:
        StreamError: it is not one, or not of the form that FORMAT.md gives to depth.
    """
    try:
        parsed = RawImage.FromString(message)
    except DecodeError as error:
        raise StreamError(source, f"a damaged message ({error})", "foxglove.RawImage") from None
    found = (parsed.encoding, parsed.width, parsed.height, parsed.step, len(parsed.data))
    expected = (DEPTH_ENCODING, width, height, 2 * width, 2 * width * height)
    if found != expected:
        raise StreamError(source, _layout(found), _layout(expected))
    data: bytes = parsed.data
    return data


def _layout(found: tuple[str, int, int, int, int]) -> str:
    encoding, width, height, step, size = found
    return f"{width}x{height} px of {encoding or 'no encoding'}, {step} bytes a row, {size} bytes"


def video_data(message: bytes, source: str, expected: str) -> bytes:
    """The access unit inside a serialised foxglove.CompressedVideo (or mvcodec.PredictedVideo).

    Args:
        expected: its format, as `video_format` has it.

    Raises:
        StreamError: it is not one, or of another codec than the header says.
    """
    try:
        parsed = CompressedVideo.FromString(message)
    except DecodeError as error:
        raise StreamError(source, f"a damaged message ({error})", "foxglove.CompressedVideo") from None
    if parsed.format != expected:
        raise StreamError(source, f"video of format {parsed.format!r}", f"{expected!r}, as the header says")
    data: bytes = parsed.data
    return data


def _calibration(array: CameraArray, place: Viewpoint, frame: str) -> Callable[[int], bytes]:
    c = array.calibration
    cx, cy = array.principal_point_px((place.row, place.col))
    message = CameraCalibration(
        frame_id=frame,
        width=array.width,
        height=array.height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[c.fx_px, 0, cx, 0, c.fy_px, cy, 0, 0, 1],
        R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=[c.fx_px, 0, cx, 0, 0, c.fy_px, cy, 0, 0, 0, 1, 0],
    )
    return _stamped(message)


def _transform(array: CameraArray, place: Viewpoint, frame: str) -> Callable[[int], bytes]:
    right, down, forward = array.camera_position_m((place.row, place.col))
    message = FrameTransform(parent_frame_id=RIG_FRAME, child_frame_id=frame)
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

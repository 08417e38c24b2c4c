"""What a recording says about its cameras, in Foxglove's words or in those of ROS 2: by frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError

from mvcodec.array import Position
from mvcodec.container.foxglove_json import from_json
from mvcodec.container.message_schema import ROS2, DamagedMessage, MessageSchema
from mvcodec.container.ros2 import ros2_decoder
from mvcodec.errors import StreamError
from mvcodec.stream import StreamHeader

MAX_FRAMES = 10_000
"""Frames beyond that are left out: no rig has so many."""

_HEADER_SCHEMA = "mvcodec.Header"

_FOXGLOVE: dict[str, Any] = {
    "foxglove.CameraCalibration": CameraCalibration,
    "foxglove.FrameTransform": FrameTransform,
    "foxglove.FrameTransforms": FrameTransforms,
}

_ROS2 = frozenset({"sensor_msgs/CameraInfo", "tf2_msgs/TFMessage"})


def is_about_rig(schema: MessageSchema) -> bool:
    """Whether messages of a schema say something about cameras that is read."""
    if schema.encoding == ROS2:
        return schema.kind in _ROS2
    if schema.name == _HEADER_SCHEMA:
        return schema.encoding == "json"
    return schema.name in _FOXGLOVE and schema.encoding in ("protobuf", "json")


class RecordedRig:
    """Takes messages in; keeps the latest of each frame.

    Attributes:
        calibrations: frame -> its foxglove.CameraCalibration.
        transforms: child frame -> its foxglove.FrameTransform.
        beside: start of topics' names, up to the last slash -> the calibration that stands there.
        nominal: the recording is a file of ours, which says that its calibration is made up.
    """

    def __init__(self) -> None:
        self.calibrations: dict[str, Any] = {}
        self.beside: dict[str, Any] = {}
        self.transforms: dict[str, Any] = {}
        self.nominal = False

    def push(self, topic: str, schema: MessageSchema, data: bytes) -> None:
        """Take a message of any topic; what is damaged or says nothing of the rig is passed over.

        Raises:
            MissingExtra: a message of ROS 2, whose package is not installed.
        """
        if not is_about_rig(schema):
            return
        with suppress(DecodeError, DamagedMessage, StreamError):
            if schema.name == _HEADER_SCHEMA:
                self.nominal = not StreamHeader.from_json(data).array.calibration.given
                return
            for message in _messages(schema, data):
                if isinstance(message, CameraCalibration):
                    _keep(self.calibrations, message.frame_id, message)
                    _keep(self.beside, topic.rpartition("/")[0], message)
                else:
                    _keep(self.transforms, message.child_frame_id, message)

    def tell_apart(
        self, frames: Mapping[Position, str], topics: Mapping[Position, str]
    ) -> dict[Position, str]:
        """A frame of its own for each camera, also where several cameras' pictures name the same one.

        The pictures of a stereo pair of ROS are often both in the left camera's frame. Then the calibration
        that stands beside a camera's topic is its own (`/left/image_raw`, `/left/camera_info`).
        """
        if len(set(frames.values())) == len(frames):
            return dict(frames)
        found = dict(frames)
        for camera, topic in topics.items():
            spaces = [space for space in self.beside if space and topic.startswith(f"{space}/")]
            if camera in found and spaces:
                found[camera] = space = max(spaces, key=len)
                self.calibrations[space] = self.beside[space]
        return found


def _messages(schema: MessageSchema, data: bytes) -> Iterator[Any]:
    """The calibrations and transforms in a message, as foxglove.CameraCalibration and .FrameTransform."""
    if schema.encoding == ROS2:
        message = _ros2_decoder(schema)(data)
        if schema.kind == "sensor_msgs/CameraInfo":
            yield CameraCalibration(
                frame_id=message.header.frame_id,
                width=message.width,
                height=message.height,
                distortion_model=message.distortion_model,
                D=message.d,
                K=message.k,
                R=message.r,
                P=message.p,
            )
        else:
            yield from map(_transform, message.transforms)
        return
    made = _FOXGLOVE[schema.name]
    message = from_json(data, made()) if schema.encoding == "json" else made.FromString(data)
    yield from message.transforms if isinstance(message, FrameTransforms) else (message,)


_ros2_decoder = lru_cache(maxsize=64)(ros2_decoder)


def _transform(stamped: Any) -> Any:
    """A geometry_msgs/TransformStamped as a foxglove.FrameTransform."""
    found = FrameTransform(parent_frame_id=stamped.header.frame_id, child_frame_id=stamped.child_frame_id)
    shift, turn = stamped.transform.translation, stamped.transform.rotation
    found.translation.x, found.translation.y, found.translation.z = shift.x, shift.y, shift.z
    rotation = found.rotation
    rotation.x, rotation.y, rotation.z, rotation.w = turn.x, turn.y, turn.z, turn.w
    return found


def _keep(kept: dict[str, Any], frame: str, message: Any) -> None:
    if frame in kept or len(kept) < MAX_FRAMES:
        kept[frame] = message

"""The messages of a file against its header: schemas, frame ids, stamps, calibration and places."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError
from mcap.records import Message
from mcap.well_known import MessageEncoding

from mvcodec.conformance.file_check import CheckedMessage
from mvcodec.conformance.finding import Finding, error, warning
from mvcodec.container import schemas
from mvcodec.errors import StreamError
from mvcodec.stream import HEADER_TRACK, StreamHeader, Track, TrackKind

_KINDS: dict[str, Any] = {
    "video": CompressedVideo,
    "predicted": CompressedVideo,
    "calibration": CameraCalibration,
    "transform": FrameTransform,
}
_SCHEMA_NAMES = {kind: name for kind, (name, _) in schemas.PROTOBUF_SCHEMAS.items()} | {
    "depth": schemas.DEPTH_SCHEMA[0]
}


def unknown_fields(header: bytes, known: StreamHeader) -> tuple[str, ...]:
    """Names of what a header says beside the fields of FORMAT.md; its settings are free.

    Args:
        header: as `from_json` took it.
        known: what came of it.
    """
    said, expected = json.loads(header), json.loads(known.to_json())
    names = [name for name in said if name not in expected]
    for prefix, inside, there in (
        ("array.", said["array"], expected["array"]),
        ("array.calibration.", said["array"]["calibration"], expected["array"]["calibration"]),
    ):
        names += [prefix + name for name in inside if name not in there]
    return tuple(names)


class MessageCheck:
    """Checks messages one by one.

    Args:
        header: the first one; it says what there must be.
        add: takes what is wrong.

    Attributes:
        topics: those that the header explains.
    """

    def __init__(self, header: StreamHeader, add: Callable[[Finding], None]) -> None:
        self._add = add
        self._formats: dict[str, str] = {}
        self._rig = schemas.rig_messages(header.array)
        # Early files have the same principal point in all calibrations, whatever the disparity of infinity.
        same = replace(header.array.calibration, d_inf_px_per_step=0.0)
        self._early_rig = schemas.rig_messages(replace(header.array, calibration=same))
        self._kinds = {message.topic: message.kind for message in self._rig}
        self._frames: dict[str, str] = {}
        self.topics: set[str] = set()
        self._codec = header.codec
        for track in header.tracks:
            self.expect(track)
        self._unseen = {HEADER_TRACK.topic, *self._kinds}
        self._size = header.array.width, header.array.height
        for camera in header.array.real:
            topic = Track(TrackKind.DEPTH, camera).topic
            self._kinds[topic], self._frames[topic] = "depth", schemas.frame_id(camera)
        self.topics |= {HEADER_TRACK.topic, *self._kinds}
        self._depths: set[str] | None = None  # topics with depth, which each frame set must have
        self._depths_now: set[str] = set()
        self._due: dict[tuple[str, bytes], int] | None = None
        self._key: Message | None = None

    def expect(self, track: Track) -> None:
        """Check the messages of a video track from now on."""
        self.topics.add(track.topic)
        self._kinds[track.topic] = schemas.video_kind(track)
        self._formats[track.topic] = schemas.video_format(track, self._codec)
        self._frames[track.topic] = schemas.track_frame(track)

    def begin_keyframe(self, record: Message) -> None:
        """Expect calibration and place of every camera at this time."""
        self._end_keyframe()
        self._key = record
        self._due = {
            (message.topic, message.at(record.log_time)): number
            for rig in (self._rig, self._early_rig)
            for number, message in enumerate(rig)
        }

    def end_set(self, time_ns: int) -> None:
        """The frame set at hand is over: it must have depth on the topics of the first one."""
        if self._depths is None:
            self._depths = self._depths_now
        for topic in sorted(self._depths - self._depths_now):
            self._add(error("incomplete", "no depth in this frame set", topic, time_ns))
        for topic in sorted(self._depths_now - self._depths):
            self._add(error("incomplete", "depth begins here, expected in each frame set", topic, time_ns))
        self._depths = self._depths | self._depths_now
        self._depths_now = set()

    def push(self, message: CheckedMessage) -> bytes | None:
        """Check a message on one of the topics; returns the access unit of a video message."""
        self._unseen.discard(message.topic)
        where = (message.topic, message.record.log_time)
        if message.topic == HEADER_TRACK.topic:
            if message.encoding != MessageEncoding.JSON:
                self._add(error("schema", f"message encoding {message.encoding!r}, expected json", *where))
            return None
        kind = self._kinds[message.topic]
        name = _SCHEMA_NAMES[kind]
        if (message.schema, message.encoding) != (name, MessageEncoding.Protobuf):
            found = f"{message.schema!r} as {message.encoding!r}"
            self._add(error("schema", f"{found}, expected {name} as protobuf", *where))
            return None
        if message.topic in self._formats:
            return self._video(message)
        if kind == "depth":
            self._depth(message)
            return None
        try:
            key = (message.topic, _KINDS[kind].FromString(message.record.data).SerializeToString())
        except DecodeError as failure:
            self._add(error("schema", f"a damaged message ({failure})", *where))
            return None
        if self._due is not None and key in self._due:
            came = self._due[key]
            self._due = {due: number for due, number in self._due.items() if number != came}
        else:
            text = "not as the header has it, or not at a keyframe, or twice"
            self._add(error("rig", f"{name}: {text}", *where))
        return None

    def end(self) -> list[Finding]:
        """What never came."""
        self._end_keyframe()
        return [error("topic", "no message at all", topic) for topic in sorted(self._unseen)]

    def _end_keyframe(self) -> None:
        if self._due and self._key is not None:
            for topic in sorted({topic for topic, _ in self._due}):
                self._add(error("rig", "missing at a keyframe", topic, self._key.log_time))
        self._due = None

    def _video(self, message: CheckedMessage) -> bytes | None:
        record, where = message.record, (message.topic, message.record.log_time)
        try:
            parsed = CompressedVideo.FromString(record.data)
        except DecodeError as failure:
            self._add(error("schema", f"a damaged message ({failure})", *where))
            return None
        expected = self._formats[message.topic]
        if parsed.format != expected:
            self._add(error("format", f"format {parsed.format!r}, expected {expected!r}", *where))
        self._check_stamps(parsed, *where)
        data: bytes = parsed.data
        return data

    def _depth(self, message: CheckedMessage) -> None:
        topic, time_ns = message.topic, message.record.log_time
        self._depths_now.add(topic)
        try:
            schemas.depth_data(message.record.data, topic, *self._size)
        except StreamError as failure:
            text = f"{failure.found}, expected {failure.expected}"
            self._add(error("depth", text, topic, time_ns))
        else:
            self._check_stamps(RawImage.FromString(message.record.data), topic, time_ns)

    def _check_stamps(self, parsed: Any, topic: str, time_ns: int) -> None:
        """Frame and time of a picture, as the message itself has them."""
        frame = self._frames[topic]
        if parsed.frame_id != frame:
            self._add(error("frame-id", f"frame_id {parsed.frame_id!r}, expected {frame!r}", topic, time_ns))
        if parsed.timestamp.seconds * 1_000_000_000 + parsed.timestamp.nanos != time_ns:
            self._add(warning("time", "its timestamp is not its log_time", topic, time_ns))

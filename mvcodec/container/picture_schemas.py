"""Messages of pictures by their schema and encoding, read into one form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError

from mvcodec.container.foxglove_json import from_json
from mvcodec.container.message_schema import ROS1, ROS2, DamagedMessage, MessageSchema
from mvcodec.container.ros2 import has_definition, ros2_decoder

PictureKind = Literal["video", "image", "raw"]
"""Access units of a video, coded still pictures, or pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class PictureMessage:
    """What a message says.

    Attributes:
        kind: of the data.
        stamp_ns: when the picture was taken; 0 where the message does not say.
        data: the coded picture, or the pixels.
        format: of the data (for pixels their encoding).
        frame_id: of the camera.
        layout: (width, height, bytes a row) of pixels, else None.
        big_endian: of pixels of more than a byte.
    """

    kind: PictureKind
    stamp_ns: int
    data: bytes
    format: str
    frame_id: str
    layout: tuple[int, int, int] | None = None
    big_endian: bool = False


Parser = Callable[[bytes], PictureMessage]

_FOXGLOVE: dict[str, tuple[PictureKind, Any]] = {
    "foxglove.CompressedVideo": ("video", CompressedVideo),
    "foxglove.CompressedImage": ("image", CompressedImage),
    "foxglove.RawImage": ("raw", RawImage),
}

_ROS2: dict[str, PictureKind] = {
    "sensor_msgs/CompressedImage": "image",
    "sensor_msgs/Image": "raw",
    "ffmpeg_image_transport_msgs/FFMPEGPacket": "video",
    "foxglove_msgs/CompressedVideo": "video",
    "foxglove_msgs/CompressedImage": "image",
    "foxglove_msgs/RawImage": "raw",
}

SUPPORTED = f"{', '.join(_FOXGLOVE)} as protobuf or JSON, or {', '.join(list(_ROS2)[:3])} as ROS 2 (CDR)"

_NO_ROS1 = "ROS 2: convert the .bag with rosbags-convert (package rosbags), see docs/recordings.md"


def is_picture(schema: MessageSchema) -> bool:
    """Whether messages of a schema are pictures that can be read."""
    if schema.encoding == ROS2:
        return schema.kind in _ROS2 and has_definition(schema)
    return schema.name in _FOXGLOVE and schema.encoding in ("protobuf", "json")


def looks_like_picture(schema: MessageSchema) -> bool:
    """Whether messages are pictures, if by their name alone."""
    return schema.kind in _ROS2 or schema.name in _FOXGLOVE


def expected_instead(schema: MessageSchema) -> str:
    """What to have in place of a schema that cannot be read."""
    return _NO_ROS1 if schema.encoding == ROS1 else SUPPORTED


@lru_cache(maxsize=64)
def picture_parser(schema: MessageSchema) -> Parser:
    """What reads the messages of a schema of pictures, which raises DamagedMessage.

    Raises:
        MissingExtra: a package for ROS 2 is not installed.
        DamagedMessage: the definition of the schema cannot be read.
    """
    if schema.encoding == ROS2:
        return _ros2(_ROS2[schema.kind], ros2_decoder(schema))
    return _foxglove(schema)


def _foxglove(schema: MessageSchema) -> Parser:
    kind, message = _FOXGLOVE[schema.name]
    raw = kind == "raw"

    def parse(data: bytes) -> PictureMessage:
        try:
            found = from_json(data, message()) if schema.encoding == "json" else message.FromString(data)
        except DecodeError as error:
            raise DamagedMessage(str(error)) from None
        return PictureMessage(
            kind,
            found.timestamp.seconds * 1_000_000_000 + found.timestamp.nanos,
            found.data,
            found.encoding if raw else found.format,
            found.frame_id,
            (found.width, found.height, found.step) if raw else None,
        )

    return parse


def _ros2(kind: PictureKind, decode: Callable[[bytes], Any]) -> Parser:
    def parse(data: bytes) -> PictureMessage:
        found = decode(data)
        try:
            ours = not hasattr(found, "header")  # Foxglove's own have their time and frame outside of one
            stamp = found.timestamp if ours else found.header.stamp
            form = found.format if hasattr(found, "format") else found.encoding
            raw = kind == "raw"
            return PictureMessage(
                kind,
                stamp.sec * 1_000_000_000 + stamp.nanosec,
                bytes(found.data),
                _codec(form) if kind == "video" else form,
                found.frame_id if ours else found.header.frame_id,
                (found.width, found.height, found.step) if raw else None,
                raw and bool(getattr(found, "is_bigendian", False)),
            )
        except AttributeError as error:
            raise DamagedMessage(f"its definition lacks a field: {error}") from None

    return parse


def _codec(encoding: str) -> str:
    """The codec in a word of FFMPEGPacket's: `hevc;yuv420p;bgr8`, `libx264`, `h264_nvenc`; else the word."""
    word = encoding.split(";", maxsplit=1)[0].strip().lower()
    for codec, names in {"h264": ("264",), "h265": ("265", "hevc"), "av1": ("av1",), "vp9": ("vp9",)}.items():
        if any(name in word for name in names):
            return codec
    return word or encoding

"""Messages of ROS 2 (CDR) by their definitions, read with `mcap-ros2-support`."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from typing import Any

from mcap.exceptions import McapError
from mcap.records import Schema

from mvcodec.container.message_schema import ROS2, DamagedMessage, MessageSchema
from mvcodec.errors import MissingExtra

_LANGUAGE = "ros2msg"

_PLAIN_CDR = (b"\0\0", b"\0\1")
"""How a message begins: its encapsulation, big- or little-endian (RTPS 2.2, 10.2.1.2)."""

_ZSTD = b"\x28\xb5\x2f\xfd"

_DEFINITIONS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "sensor_msgs/Image": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
        "uint32 step\nuint8[] data"
    ),
    "sensor_msgs/RegionOfInterest": (
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify"
    ),
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
        "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
        "sensor_msgs/RegionOfInterest roi"
    ),
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "ffmpeg_image_transport_msgs/FFMPEGPacket": (
        "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\nuint8 flags\n"
        "bool is_bigendian\nuint8[] data"
    ),
}
"""For files that leave definitions out, or have them in IDL. A file's own definition comes first."""


def has_definition(schema: MessageSchema) -> bool:
    """Whether the fields of a schema are known."""
    return schema.kind in _DEFINITIONS or (schema.language == _LANGUAGE and bool(schema.definition.strip()))


def ros2_decoder(schema: MessageSchema) -> Callable[[bytes], Any]:
    """What reads the messages of a schema, which raises DamagedMessage.

    Raises:
        MissingExtra: mcap-ros2-support is not installed.
        DamagedMessage: the definition cannot be read.
    """
    try:
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        raise MissingExtra("mcap-ros2-support", "ros2") from None
    record = Schema(id=1, name=schema.name, encoding=_LANGUAGE, data=_whole_definition(schema).encode())
    try:
        decode = DecoderFactory().decoder_for(ROS2, record)
    except (McapError, ValueError, TypeError, AssertionError, LookupError) as error:
        raise DamagedMessage(f"its definition cannot be read: {error}") from None
    assert decode is not None

    def checked(data: bytes) -> Any:
        if data[:2] not in _PLAIN_CDR:
            packed = data.startswith(_ZSTD)
            raise DamagedMessage(
                "compressed message by message, which is not supported" if packed else "no plain CDR"
            )
        try:
            return decode(data)
        except (struct.error, ValueError, LookupError, NotImplementedError) as error:
            raise DamagedMessage(str(error)) from None

    return checked


def _whole_definition(schema: MessageSchema) -> str:
    """A definition with those of all that it builds on."""
    own = schema.definition.decode("utf-8", "replace") if schema.language == _LANGUAGE else ""
    text = own if own.strip() else _DEFINITIONS[schema.kind]
    there = {MessageSchema(name, ROS2).kind for name in re.findall(r"^MSG:\s+(\S+)\s*$", text, re.MULTILINE)}
    for name, definition in _DEFINITIONS.items():
        if name not in there and name != schema.kind:
            text += f"\n{'=' * 80}\nMSG: {name}\n{definition}"
    return text

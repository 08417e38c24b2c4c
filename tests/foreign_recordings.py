"""Recordings in JSON and of ROS 2, made byte by byte: nothing of the reader under test is used."""

from __future__ import annotations

import base64
import io
import json
import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from mcap.writer import Writer
from odd_recordings import TOPICS, at
from PIL import Image

from mvcodec.frames import Picture

FRAMES = ("left", "right")


class Cdr:
    """Values in ROS 2's wire form: each at a multiple of its size."""

    def __init__(self, order: str = "<") -> None:
        self._order, self._data = order, bytearray()

    def put(self, form: str, *values: Any) -> Cdr:
        """Values of one form of `struct` each."""
        for value in values:
            size = struct.calcsize(form)
            self._data += b"\0" * (-len(self._data) % size) + struct.pack(self._order + form, value)
        return self

    def blob(self, data: bytes) -> Cdr:
        """A sequence of bytes."""
        self.put("I", len(data))
        self._data += data
        return self

    def text(self, text: str) -> Cdr:
        """A string."""
        return self.blob(text.encode() + b"\0")

    def header(self, time_ns: int, frame: str) -> Cdr:
        """A std_msgs/Header."""
        return self.put("i", time_ns // 10**9).put("I", time_ns % 10**9).text(frame)

    def message(self) -> bytes:
        """The whole message."""
        return (b"\0\1\0\0" if self._order == "<" else b"\0\0\0\0") + bytes(self._data)


def coded(picture: Picture, form: str) -> bytes:
    """A picture as a JPEG or PNG file."""
    target = io.BytesIO()
    Image.fromarray(picture).save(target, form, **({"quality": 95} if form == "jpeg" else {}))
    return target.getvalue()


def ros_compressed(data: bytes, form: str, time_ns: int, frame: str, order: str = "<") -> bytes:
    """sensor_msgs/CompressedImage."""
    return Cdr(order).header(time_ns, frame).text(form).blob(data).message()


def ros_image(
    data: bytes,
    layout: tuple[int, int, int],
    encoding: str,
    big: bool,
    time_ns: int,
    frame: str,
    order: str = "<",
) -> bytes:
    """sensor_msgs/Image; layout is (width, height, step)."""
    width, height, step = layout
    start = Cdr(order).header(time_ns, frame).put("I", height, width).text(encoding)
    return start.put("B", big).put("I", step).blob(data).message()


def ros_packet(data: bytes, encoding: str, time_ns: int, frame: str) -> bytes:
    """ffmpeg_image_transport_msgs/FFMPEGPacket."""
    start = Cdr().header(time_ns, frame).put("i", 64, 48).text(encoding)
    return start.put("Q", 7).put("B", 0, 0).blob(data).message()


def ros_info(size: tuple[int, int], p: Sequence[float], frame: str) -> bytes:
    """sensor_msgs/CameraInfo of a rectified camera."""
    info = Cdr().header(at(0), frame).put("I", size[1], size[0]).text("plumb_bob")
    info.put("I", 5).put("d", *[0.0] * 5)
    info.put("d", *p[0:3], *p[4:7], *p[8:11]).put("d", 1, 0, 0, 0, 1, 0, 0, 0, 1).put("d", *p)
    return info.put("I", 0, 0).put("I", 0, 0, 0, 0).put("B", 0).message()


def ros_transforms(places: Iterable[tuple[str, tuple[float, float, float]]]) -> bytes:
    """tf2_msgs/TFMessage of frames that are shifted, not turned."""
    listed = list(places)
    message = Cdr().put("I", len(listed))
    for frame, place in listed:
        message.header(at(0), "stand").text(frame).put("d", *place).put("d", 0, 0, 0, 1)
    return message.message()


def json_message(time_ns: int, frame: str, data: bytes, **fields: Any) -> bytes:
    """One of Foxglove's messages with data."""
    stamp = {"sec": time_ns // 10**9, "nsec": time_ns % 10**9}
    text = base64.b64encode(data).decode()
    return json.dumps({"timestamp": stamp, "frame_id": frame, "data": text, **fields}).encode()


Item = tuple[str, tuple[str, str], int, bytes]
"""Topic, (schema, message encoding), log time in ns, message."""

_LANGUAGES = {"cdr": "ros2msg", "json": "jsonschema", "ros1": "ros1msg", "flatbuffer": "flatbuffer"}


def file_of(items: Iterable[Item], definition: bytes = b"", language: str | None = None) -> bytes:
    """An MCAP file of messages.

    Args:
        definition, language: of all schemas.
    """
    target = io.BytesIO()
    writer = Writer(target)
    writer.start()
    channels: dict[str, int] = {}
    for topic, (schema, encoding), time_ns, data in items:
        if topic not in channels:
            number = writer.register_schema(schema, language or _LANGUAGES[encoding], definition)
            channels[topic] = writer.register_channel(topic, encoding, number)
        writer.add_message(channels[topic], time_ns, data, time_ns)
    writer.finish()  # type: ignore[no-untyped-call]
    return target.getvalue()


def both(schema: tuple[str, str], make: Callable[[int, int], bytes], count: int = 4) -> list[Item]:
    """Messages of two cameras by turns; `make` is given the number and the camera."""
    return [(TOPICS[c], schema, at(n), make(n, c)) for n in range(count) for c in (0, 1)]

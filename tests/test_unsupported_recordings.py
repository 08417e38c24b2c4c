"""Recordings of other kinds that cannot be read: called so by name, in one line."""

from __future__ import annotations

import io
import sys

import pytest
from foreign_reading import COMPRESSED, IMAGE, Read, colourful
from foreign_recordings import both, coded, file_of, ros_compressed, ros_image, ros_packet
from odd_recordings import at

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.errors import InputError, MissingExtra, StreamError

PACKET = ("ffmpeg_image_transport_msgs/msg/FFMPEGPacket", "cdr")
PNG = coded(colourful(0, 0), "png")
UNSUPPORTED = {
    "ROS 1": (
        ("sensor_msgs/CompressedImage", "ros1"),
        b"any",
        r"sensor_msgs/CompressedImage as ROS 1, which is not supported, expected ROS 2: convert the .bag",
    ),
    "flatbuffer": (
        ("foxglove.CompressedImage", "flatbuffer"),
        b"any",
        "foxglove.CompressedImage as flatbuffer, which is not supported",
    ),
    "other messages": (
        ("sensor_msgs/msg/PointCloud2", "cdr"),
        b"any",
        "sensor_msgs/msg/PointCloud2 as ROS 2, which is not supported",
    ),
    "floating point": (
        IMAGE,
        ros_image(b"\0" * 48, (4, 3, 16), "32FC1", False, at(0), "cam"),
        "raw pixels of encoding '32FC1', which is not supported",
    ),
    "depth maps": (
        COMPRESSED,
        ros_compressed(b"\0" * 12 + PNG, "16UC1; compressedDepth png", at(0), "cam"),
        "a depth map in format '16UC1; compressedDepth png', which is not supported",
    ),
    "codecs": (
        PACKET,
        ros_packet(b"any", "mpeg4", at(0), "cam"),
        "video of format 'mpeg4', which is not supported",
    ),
    "packed messages": (
        COMPRESSED,
        b"\x28\xb5\x2f\xfd packed",
        "compressed message by message, which is not supported",
    ),
}


@pytest.mark.parametrize("kind", UNSUPPORTED)
def test_what_is_not_supported_is_called_so_by_name(kind: str) -> None:
    schema, message, told = UNSUPPORTED[kind]
    with pytest.raises(InputError, match=told) as caught:
        Read(file_of(both(schema, lambda _number, _camera: message)))
    assert "damage" not in str(caught.value)
    assert "written by mvcodec" not in str(caught.value)


def test_topics_that_cannot_be_read_are_listed_as_such() -> None:
    content = file_of(both(("sensor_msgs/Image", "ros1"), lambda _number, _camera: b"any"))
    with pytest.raises(StreamError, match=r"/cam0 \(sensor_msgs/Image as ROS 1, which is not supported\)"):
        Recording(io.BytesIO(content), "rec", RecordingSettings((("/left", "/right"),)))


@pytest.mark.parametrize("message", [b"{", b"[1]", b'{"data": 5}', b'{"timestamp": {"sec": "x"}}', b"\xff"])
def test_json_that_is_none_is_named(message: bytes) -> None:
    content = file_of(both(("foxglove.CompressedImage", "json"), lambda _number, _camera: message))
    with pytest.raises(InputError, match=r"rec: /cam0 at .* a message that cannot be read"):
        Read(content)


@pytest.mark.parametrize("size", [0, 3, 4, 9, 25])
def test_messages_that_break_off_are_named(size: int) -> None:
    whole = ros_compressed(PNG, "png", at(0), "cam")
    content = file_of(both(COMPRESSED, lambda _number, _camera: whole[:size]))
    with pytest.raises(InputError, match=r"rec: /cam0 at .* a message that cannot be read"):
        Read(content)


def test_without_the_package_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap_ros2.decoder", None)
    content = file_of(both(COMPRESSED, lambda _number, _camera: b"other"), b"string other")
    with pytest.raises(MissingExtra, match=r"install it with: pip install 'mcap-ros2-support"):
        Read(content)

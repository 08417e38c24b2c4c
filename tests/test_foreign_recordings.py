"""Recordings in JSON and of ROS 2: pictures, calibration, and what is not supported by its name."""

from __future__ import annotations

import io
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import fails, succeeds
from foreign_recordings import (
    FRAMES,
    Cdr,
    Item,
    both,
    coded,
    file_of,
    json_message,
    ros_compressed,
    ros_image,
    ros_info,
    ros_packet,
    ros_transforms,
)
from numpy.typing import NDArray
from odd_recordings import TOPICS, at, units
from timed_videos import SIZE, numbered

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.errors import InputError, MissingExtra, StreamError
from mvcodec.frames import FrameSet

WIDTH, HEIGHT = SIZE
COMPRESSED = ("sensor_msgs/msg/CompressedImage", "cdr")
IMAGE = ("sensor_msgs/msg/Image", "cdr")
PACKET = ("ffmpeg_image_transport_msgs/msg/FFMPEGPacket", "cdr")


class Read:
    """What comes of a recording."""

    def __init__(self, content: bytes, **settings: Any) -> None:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            asked = RecordingSettings((TOPICS,), **settings)
            self.recording = Recording(io.BytesIO(content), "rec", asked)
            self.sets: list[FrameSet] = list(self.recording.frame_sets())
        self.told = "\n".join(str(warning.message) for warning in caught)

    def check(self, count: int = 4, worst: float = 0.0) -> None:
        """The pictures are those that were taken, at their times."""
        assert [item.time_ns for item in self.sets] == [at(n) for n in range(count)]
        for number, item in enumerate(self.sets):
            for (_, camera), picture in item.pictures.items():
                away = np.abs(picture.astype(int) - colourful(number, camera)).mean()
                assert away <= worst, (number, camera, away)


def colourful(number: int, camera: int) -> NDArray[np.uint8]:
    """A numbered picture whose channels differ."""
    picture = numbered(number, camera).copy()
    picture[8:, :, 1] //= 2
    picture[8:, :, 2] //= 4
    return picture


def padded(pixels: NDArray[Any], padding: int) -> tuple[bytes, tuple[int, int, int]]:
    """Bytes of pixels whose rows have padding, and (width, height, step)."""
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    return rows.tobytes(), (width, height, rows.shape[1])


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    ("form", "file"),
    [
        ("jpeg", "jpeg"),
        ("png", "png"),
        ("rgb8; jpeg compressed bgr8", "jpeg"),
        ("bgr8; png compressed bgr8", "png"),
    ],
)
def test_compressed_images_of_ros_2(form: str, file: str, order: str) -> None:
    def make(number: int, camera: int) -> bytes:
        data = coded(colourful(number, camera), file)
        return ros_compressed(data, form, at(number), FRAMES[camera], order)

    read = Read(file_of(both(COMPRESSED, make)))
    read.check(worst=0 if file == "png" else 9)
    assert read.told == ""


def test_formats_that_say_something_else_than_the_file_are_told() -> None:
    def make(number: int, camera: int) -> bytes:
        data = coded(colourful(number, camera), "png")
        return ros_compressed(data, "rgb8; png compressed rgb8", at(number), FRAMES[camera])

    read = Read(file_of(both(COMPRESSED, make)))
    read.check()
    assert read.told.count("may say that red and blue are swapped") == 2, "once for each topic"


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("padding", [0, 6])
@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "rgba8", "bgra8", "8UC3", "rgb16", "bgr16", "16UC3"])
def test_raw_images_of_ros_2(encoding: str, padding: int, big: bool) -> None:
    def make(number: int, camera: int) -> bytes:
        pixels: NDArray[Any] = colourful(number, camera)
        if "bgr" in encoding or "UC3" in encoding:
            pixels = pixels[..., ::-1]
        if "a" in encoding:
            pixels = np.dstack([pixels, np.full((HEIGHT, WIDTH), 255, np.uint8)])
        if "16" in encoding:
            pixels = (pixels.astype(np.uint16) * 257).astype(">u2" if big else "<u2")
        data, layout = padded(pixels, padding)
        return ros_image(data, layout, encoding, big, at(number), FRAMES[camera], "<>"[big])

    read = Read(file_of(both(IMAGE, make)), bits=16)
    read.check()
    assert read.told == ""


@pytest.mark.parametrize(("encoding", "big"), [("mono8", False), ("mono16", False), ("mono16", True)])
def test_grey_images_of_ros_2(encoding: str, big: bool) -> None:
    def make(number: int, camera: int) -> bytes:
        grey: NDArray[Any] = numbered(number, camera)[..., 0]
        if encoding == "mono16":
            grey = (grey.astype(np.uint16) << 4).astype(">u2" if big else "<u2")  # of a 12-bit camera
        data, layout = padded(grey, 4)
        return ros_image(data, layout, encoding, big, at(number), FRAMES[camera])

    for number, item in enumerate(Read(file_of(both(IMAGE, make))).sets):
        for (_, camera), picture in item.pictures.items():
            away = np.abs(picture.astype(int) - numbered(number, camera)).max()
            assert away <= 1, "scaled by 12 bits, neither black nor white"


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("first", ["rggb", "bggr", "gbrg", "grbg"])
def test_bayer_images_of_ros_2_have_their_colours(first: str, bits: int) -> None:
    colour = {"r": 200, "g": 120, "b": 40}

    def make(number: int, camera: int) -> bytes:
        cell = np.array([colour[name] for name in first], np.uint16).reshape(2, 2)
        mosaic: NDArray[Any] = np.tile(cell, (HEIGHT // 2, WIDTH // 2))
        mosaic = mosaic.astype(np.uint8) if bits == 8 else mosaic * 257
        data, layout = padded(mosaic, 2)
        return ros_image(data, layout, f"bayer_{first}{bits}", False, at(number), FRAMES[camera])

    for item in Read(file_of(both(IMAGE, make)), bits=16).sets:
        for picture in item.pictures.values():
            assert np.abs(picture[2:-2, 2:-2].astype(int) - (200, 120, 40)).max() <= 1


@pytest.mark.parametrize(
    ("encoding", "order"),
    [
        ("yuv422", "UYVY"),
        ("uyvy", "UYVY"),
        ("yuv422_yuy2", "YUYV"),
        ("yuyv", "YUYV"),
    ],
)
def test_yuv_images_of_ros_2_have_their_colours(encoding: str, order: str) -> None:
    # BT.601, limited range, of a light red: by hand, Y = 16 + 219 (0.299 R + 0.587 G + 0.114 B).
    red, green, blue = 0.9, 0.3, 0.2
    luma = 0.299 * red + 0.587 * green + 0.114 * blue
    value = {
        "Y": 16 + 219 * luma,
        "U": 128 + 224 * (blue - luma) / 1.772,
        "V": 128 + 224 * (red - luma) / 1.402,
    }

    def make(number: int, camera: int) -> bytes:
        pair = np.array([round(value[name]) for name in order], np.uint8)
        pixels = np.tile(pair, (HEIGHT, WIDTH // 2)).reshape(HEIGHT, WIDTH, 2)
        data, layout = padded(pixels, 8)
        return ros_image(data, layout, encoding, False, at(number), FRAMES[camera])

    for item in Read(file_of(both(IMAGE, make))).sets:
        for picture in item.pictures.values():
            assert np.abs(picture.astype(int) - np.array([230, 76, 51])).max() <= 3


@pytest.mark.parametrize("encoding", ["h264", "libx264", "h264_nvenc", "h264;yuv420p;bgr8"])
def test_ffmpeg_packets_of_ros_2(encoding: str) -> None:
    streams = [[bytes(message.data) for message, _ in units(6, camera, {})] for camera in (0, 1)]

    def make(number: int, camera: int) -> bytes:
        return ros_packet(streams[camera][number], encoding, at(number), FRAMES[camera])

    read = Read(file_of(both(PACKET, make, 6)))
    assert [item.time_ns for item in read.sets] == [at(n) for n in range(6)]
    for number, item in enumerate(read.sets):
        for (_, camera), picture in item.pictures.items():
            assert np.abs(picture.astype(int) - numbered(number, camera)).mean() < 6


@pytest.mark.parametrize("kind", ["CompressedImage", "RawImage", "CompressedVideo"])
def test_messages_in_json(kind: str) -> None:
    streams = [[bytes(message.data) for message, _ in units(4, camera, {})] for camera in (0, 1)]

    def make(number: int, camera: int) -> bytes:
        time_ns, frame = at(number), FRAMES[camera]
        if kind == "CompressedImage":
            return json_message(time_ns, frame, coded(numbered(number, camera), "png"), format="png")
        if kind == "CompressedVideo":
            return json_message(time_ns, frame, streams[camera][number], format="h264")
        data, (width, height, step) = padded(numbered(number, camera), 5)
        return json_message(time_ns, frame, data, encoding="rgb8", width=width, height=height, step=step)

    read = Read(file_of(both((f"foxglove.{kind}", "json"), make)))
    assert [item.time_ns for item in read.sets] == [at(n) for n in range(4)]
    for number, item in enumerate(read.sets):
        for (_, camera), picture in item.pictures.items():
            away = np.abs(picture.astype(int) - numbered(number, camera)).mean()
            assert away < (6 if kind == "CompressedVideo" else 1e-9)


def test_topics_of_several_kinds_are_one_recording() -> None:
    items: list[Item] = []
    for number in range(4):
        data, layout = padded(colourful(number, 1)[..., ::-1], 3)
        left = json_message(at(number), "left", coded(colourful(number, 0), "png"), format="png")
        right = ros_image(data, layout, "bgr8", False, at(number), "right")
        items.append((TOPICS[0], ("foxglove.CompressedImage", "json"), at(number), left))
        items.append((TOPICS[1], IMAGE, at(number), right))
    Read(file_of(items)).check()


P = [80.0, 0, 31, 0, 0, 80, 23, 0, 0, 0, 1, 0]


def pair_of_ros(*, places: bool, frames: tuple[str, str] = FRAMES) -> list[Item]:
    """Two cameras 0.2 m apart: by transforms, or by the fourth column of P."""
    info = ("sensor_msgs/msg/CameraInfo", "cdr")
    moved = [*P[:3], 0 if places else -16.0, *P[4:]]

    def make(number: int, camera: int) -> bytes:
        return ros_compressed(coded(colourful(number, camera), "png"), "png", at(number), frames[camera])

    items = both(COMPRESSED, make)
    items.append(("/cam0/camera_info", info, at(0), ros_info(SIZE, P, frames[0])))
    items.append(("/cam1/camera_info", info, at(0), ros_info(SIZE, moved, frames[1])))
    if places:
        transforms = ros_transforms([("left", (1.0, 0, 0)), ("right", (1.2, 0, 0))])
        items.append(("/tf_static", ("tf2_msgs/msg/TFMessage", "cdr"), at(0), transforms))
    return items


@pytest.mark.parametrize("places", [True, False])
def test_cameras_of_ros_2_give_the_calibration(places: bool) -> None:
    calibration = Read(file_of(pair_of_ros(places=places))).recording.array.calibration
    assert calibration.given
    assert (calibration.fx_px, calibration.cx_px, calibration.cy_px) == (80, 31, 23)
    assert calibration.baseline_m == pytest.approx(0.2)


def test_a_stereo_pair_whose_pictures_name_one_frame_has_two_calibrations() -> None:
    items = [
        (f"{topic}/image" if topic in TOPICS else topic, *rest)
        for topic, *rest in pair_of_ros(places=False, frames=("left", "left"))
    ]
    settings = RecordingSettings((tuple(f"{topic}/image" for topic in TOPICS),))
    recording = Recording(io.BytesIO(file_of(items)), "rec", settings)  # type: ignore[arg-type]
    assert recording.array.calibration.baseline_m == pytest.approx(0.2)


def test_calibration_and_places_in_json() -> None:
    def make(number: int, camera: int) -> bytes:
        data = coded(colourful(number, camera), "png")
        return json_message(at(number), FRAMES[camera], data, format="png")

    items = both(("foxglove.CompressedImage", "json"), make)
    for number, frame in enumerate(FRAMES):
        told = json_message(at(0), frame, b"", width=WIDTH, height=HEIGHT, P=P)
        items.append((f"/info{number}", ("foxglove.CameraCalibration", "json"), at(0), told))
    transforms = [
        {
            "timestamp": {"sec": 1, "nsec": 2},
            "parent_frame_id": "stand",
            "child_frame_id": frame,
            "translation": {"x": 0.3 * number, "y": 0, "z": 0},
            "rotation": {"x": 0, "y": 0, "z": 0, "w": 1},
        }
        for number, frame in enumerate(FRAMES)
    ]
    message = json_message(at(0), "", b"", transforms=transforms)
    items.append(("/tf", ("foxglove.FrameTransforms", "json"), at(0), message))
    calibration = Read(file_of(items)).recording.array.calibration
    assert calibration.given
    assert calibration.baseline_m == pytest.approx(0.3)


OWN = b"""uint8 version
std_msgs/Header header
uint8[] data
string format
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""


def test_a_files_own_definition_comes_before_the_usual_one() -> None:
    def make(number: int, camera: int) -> bytes:
        data = coded(colourful(number, camera), "png")
        message = Cdr().put("B", 3).header(at(number), FRAMES[camera]).blob(data).text("png")
        return message.message()

    Read(file_of(both(COMPRESSED, make), OWN)).check()


def test_definitions_in_another_language_are_replaced_by_the_usual_ones() -> None:
    def make(number: int, camera: int) -> bytes:
        return ros_compressed(coded(colourful(number, camera), "png"), "png", at(number), "cam")

    Read(file_of(both(COMPRESSED, make), b"module sensor_msgs { };", "ros2idl")).check()


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


def test_the_command_reads_a_recording_of_ros_2(tmp_path: Path) -> None:
    source, out = tmp_path / "bag.mcap", tmp_path / "out.mcap"
    source.write_bytes(file_of(pair_of_ros(places=False, frames=FRAMES)))
    options = ("--preset", "ultrafast", "--disparity-range", "0,8", "--matcher", "sgbm")
    succeeds("encode", source, out, "--topics", "/cam0,/cam1", *options)
    assert "4 frame" in succeeds("info", out)
    source.write_bytes(file_of(both(("sensor_msgs/Image", "ros1"), lambda _number, _camera: b"any")))
    other = tmp_path / "other.mcap"
    assert "rosbags-convert" in fails(1, "encode", source, other, "--topics", "/cam0,/cam1")

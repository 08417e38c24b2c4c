"""Recordings in JSON and of ROS 2: pictures, videos and calibration."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from command_line import fails, succeeds
from foreign_reading import COMPRESSED, IMAGE, Read, colourful, padded
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
from odd_recordings import TOPICS, at, units
from timed_videos import SIZE, numbered

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings

WIDTH, HEIGHT = SIZE
PACKET = ("ffmpeg_image_transport_msgs/msg/FFMPEGPacket", "cdr")


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


def test_the_command_reads_a_recording_of_ros_2(tmp_path: Path) -> None:
    source, out = tmp_path / "bag.mcap", tmp_path / "out.mcap"
    source.write_bytes(file_of(pair_of_ros(places=False, frames=FRAMES)))
    options = ("--preset", "ultrafast", "--disparity-range", "0,8", "--matcher", "sgbm")
    succeeds("encode", source, out, "--topics", "/cam0,/cam1", *options)
    assert "4 frame" in succeeds("info", out)
    source.write_bytes(file_of(both(("sensor_msgs/Image", "ros1"), lambda _number, _camera: b"any")))
    other = tmp_path / "other.mcap"
    assert "rosbags-convert" in fails(1, "encode", source, other, "--topics", "/cam0,/cam1")

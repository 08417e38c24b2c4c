"""Depth topics of a recording as given maps; rosbag2 folders; offsets of topics by what moves."""

from __future__ import annotations

import io
import json
import struct
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import fails, succeeds
from foreign_recordings import file_of, ros_compressed, ros_image
from numpy.typing import NDArray
from odd_recordings import STEP_NS, TOPICS, at, raw, raws, written
from timed_videos import SIZE, number_of, numbered

from mvcodec.array import Calibration
from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.capture.sync_topics import with_offsets
from mvcodec.container import read_info
from mvcodec.errors import InputError, SettingError

DEPTHS = ("/depth0", "/depth1")
WIDTH, HEIGHT = SIZE
CALIBRATION = Calibration(100, 100, 31.5, 23.5, 0.05)
IMAGE, COMPRESSED = ("sensor_msgs/msg/Image", "cdr"), ("sensor_msgs/msg/CompressedImage", "cdr")
DEPTH_M = np.linspace(0.6, 2.5, WIDTH * HEIGHT, dtype=np.float32).reshape(HEIGHT, WIDTH)

Form = Callable[[NDArray[np.float32], int], tuple[tuple[str, str], bytes]]


def millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    return (depth * 1000).round().astype(np.uint16)


def raw_depth(encoding: str, big: bool = False) -> Form:
    def form(depth: NDArray[np.float32], time_ns: int) -> tuple[tuple[str, str], bytes]:
        values = depth if encoding == "32FC1" else millimetres(depth)
        data = values.astype(values.dtype.newbyteorder(">" if big else "<")).tobytes()
        step = WIDTH * values.itemsize
        return IMAGE, ros_image(data, (WIDTH, HEIGHT, step), encoding, big, time_ns, "d")

    return form


def coded_depth(form: str, head: bytes = b"") -> Form:
    def made(depth: NDArray[np.float32], time_ns: int) -> tuple[tuple[str, str], bytes]:
        values = millimetres(depth)
        if form.startswith("32FC1"):
            values = np.where(depth > 0, 1e4 / np.maximum(depth, 1e-3) + 7, 0).round().astype(np.uint16)
        data = head + cv2.imencode(".png", values)[1].tobytes()
        return COMPRESSED, ros_compressed(data, form, time_ns, "d")

    return made


FORMS = {
    "16UC1": raw_depth("16UC1"),
    "16UC1 big": raw_depth("16UC1", big=True),
    "32FC1": raw_depth("32FC1"),
    "png": coded_depth("png"),
    "compressedDepth": coded_depth("16UC1; compressedDepth png", bytes(12)),
    "quantised": coded_depth("32FC1; compressedDepth png", struct.pack("<iff", 0, 1e4, 7.0)),
}


def recorded(form: Form, depth: NDArray[np.float32], late_ns: int = 0, count: int = 3) -> bytes:
    items = []
    for number in range(count):
        for camera in (0, 1):
            data = numbered(number, camera).tobytes()
            picture = ros_image(data, (WIDTH, HEIGHT, 3 * WIDTH), "rgb8", False, at(number), f"f{camera}")
            items.append((TOPICS[camera], IMAGE, at(number), picture))
            schema, message = form(depth, at(number) + late_ns)
            items.append((DEPTHS[camera], schema, at(number), message))
    return file_of(items)


def opened(data: bytes, **settings: Any) -> Recording:
    asked = RecordingSettings((TOPICS,), depth_topics=(DEPTHS,), calibration=CALIBRATION)
    return Recording(io.BytesIO(data), "rec", replace(asked, **settings))


@pytest.mark.parametrize("form", FORMS)
def test_depth_comes_in_as_disparity(form: str) -> None:
    depth = DEPTH_M.copy()
    depth[:4] = 0
    sets = list(opened(recorded(FORMS[form], depth, late_ns=STEP_NS // 5)).frame_sets())
    assert [[number_of(p) for p in item.pictures.values()] for item in sets] == [[n, n] for n in range(3)]
    for item in sets:
        assert set(item.given) == set(item.pictures) == {(0, 0), (0, 1)}
        for disparity in item.given.values():
            assert not disparity.valid[:4].any()
            assert disparity.valid[4:].all()
            assert disparity.values_px[4:] == pytest.approx(100 * 0.05 / depth[4:], abs=0.02)


def test_pictures_without_depth_are_left_out() -> None:
    data = recorded(FORMS["16UC1"], DEPTH_M, late_ns=STEP_NS * 100)
    with pytest.raises(InputError, match="no frame set of all cameras"):
        opened(data)


def test_depth_that_does_not_fit_is_named() -> None:
    good = recorded(FORMS["16UC1"], DEPTH_M)
    with pytest.raises(InputError, match=r"depth without calibration, expected `calibration`"):
        opened(good, calibration=None)
    bad = ros_image(bytes(3 * WIDTH * HEIGHT), (WIDTH, HEIGHT, 3 * WIDTH), "rgb8", False, at(0), "d")
    wrong = recorded(lambda _, __: (IMAGE, bad), DEPTH_M, count=1)
    with pytest.raises(InputError, match=r"/depth0 at .*: found depth of encoding 'rgb8', expected 16UC1"):
        opened(wrong)
    with pytest.raises(SettingError, match="depth_topics: found 1 topics"):
        RecordingSettings((TOPICS,), depth_topics=(("/d",),))
    with pytest.raises(SettingError, match="a topic twice"):
        RecordingSettings((TOPICS,), depth_topics=(TOPICS,))


def test_the_command_codes_depth_topics(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    (tmp_path / "rec.mcap").write_bytes(recorded(FORMS["16UC1"], DEPTH_M))
    fields = {"fx_px": 100, "fy_px": 100, "cx_px": 31.5, "cy_px": 23.5, "baseline_m": 0.05}
    (tmp_path / "c.json").write_text(json.dumps(fields))
    options = ("--topics", ",".join(TOPICS), "--depth-topics", ",".join(DEPTHS))
    command = ("encode", tmp_path / "rec.mcap", tmp_path / "out.mcap", *options)
    succeeds(*command, "--matcher", "given", "--calibration", tmp_path / "c.json")
    header = read_info(tmp_path / "out.mcap").header
    assert header.disparity_range_px == (1.0, 10.0)
    assert "--matcher given, which codes them" in fails(2, *command, "-y")


def moving(late: int) -> list[Any]:
    """Two cameras that see the same, the second one with a clock that is some frames ahead."""
    order = [int(n) for n in np.random.default_rng(5).permutation(64)[:30]]
    return [
        (TOPICS[c], raw(order[n], c), at(n), at(n) + c * late * STEP_NS) for n in range(30) for c in (0, 1)
    ]


def test_offsets_of_topics_are_found_by_motion() -> None:
    data = written(moving(4))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        asked = with_offsets(
            RecordingSettings((TOPICS,)), lambda settings: Recording(io.BytesIO(data), "rec", settings)
        )
        sets = list(Recording(io.BytesIO(data), "rec", asked).frame_sets())
    assert len(sets) == 30
    shown = [[number_of(picture) for picture in item.pictures.values()] for item in sets]
    assert all(first == second for first, second in shown)
    assert any("by motion, /cam1 is 133.3 ms ahead of /cam0" in str(w.message) for w in caught)


def test_a_folder_of_rosbag2_is_a_recording(tmp_path: Path) -> None:
    bag, out = tmp_path / "bag", tmp_path / "out.mcap"
    bag.mkdir()
    messages = raws(range(22))
    for number in range(11):
        (bag / f"bag_{number}.mcap").write_bytes(written(messages[4 * number : 4 * number + 4]))
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  storage_identifier: mcap\n")
    options = ("--topics", ",".join(TOPICS), "--disparity-range", "0,8", "--quiet")
    succeeds("encode", bag, out, *options)
    assert read_info(out).frames == 22
    succeeds("encode", bag / "metadata.yaml", out, "-y", *options)
    assert "motion: a recording's topics have no sound" in fails(
        2, "encode", bag, out, "-y", *options, "--sync", "audio"
    )


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("a.db3", "a rosbag2 recording in SQLite, expected MCAP: rosbags-convert"),
        ("a.bag", "a ROS 1 bag, expected MCAP: rosbags-convert"),
        ("a.mcap.zstd", "a recording that rosbag2 compressed as a file, expected MCAP: zstd -d"),
    ],
)
def test_other_bags_are_refused_by_name(name: str, found: str, tmp_path: Path) -> None:
    bag, out = tmp_path / "bag", tmp_path / "out.mcap"
    bag.mkdir()
    (bag / name).write_bytes(b"anything")
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
    for given in (bag / name, bag):
        assert f"{bag / name}: found {found}" in fails(1, "encode", given, out, "--topics", "/a,/b")

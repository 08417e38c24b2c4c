"""A recording's own calibration: taken where its cameras are a rectified array, told where they are not."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coding import encoded_file, make_array
from command_line import mvcodec, succeeds
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap_protobuf.writer import Writer
from recordings import ARRAY, GRID, START_NS, recording, shots

from mvcodec.array import Calibration, Position
from mvcodec.capture.recorded_calibration import NotRectified, array_calibration
from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.container import McapReader
from mvcodec.container.message_schema import MessageSchema
from mvcodec.container.recorded_rig import RecordedRig

SIZE = (96, 64)
ACROSS_M, DOWN_M = 0.2, 0.3
FX, FY, CX, CY = 80.0, 82.0, 47.0, 31.0
D_INF = 1.5
TURNED = (0.0, 0.0, 0.6, 0.8)
"""A quaternion (x, y, z, w)."""

Rig = dict[str, Any]
"""Frame -> its calibration; "tf FRAME" -> its transform."""


def frame_of(camera: Position) -> str:
    return f"frame{camera}"


def make_rig(*, places: bool = True) -> Rig:
    """Four cameras, turned as a whole, whose principal points move with the columns and rows."""
    rig: Rig = {}
    for row, col in ARRAY.real:
        frame = frame_of((row, col))
        cx, cy = CX - D_INF * col, CY - D_INF * row * DOWN_M * FY / (ACROSS_M * FX)
        offsets = (0.0, 0.0) if places else (-FX * ACROSS_M * col, -FY * DOWN_M * row)
        rig[frame] = CameraCalibration(
            frame_id=frame,
            width=96,
            height=64,
            K=[1, 0, 1, 0, 1, 1, 0, 0, 1],
            P=[FX, 0, cx, offsets[0], 0, FY, cy, offsets[1], 0, 0, 1, 0],
        )
        if places:
            # The head is turned on the stand, and each camera's axes are the head's.
            moved = FrameTransform(parent_frame_id="head", child_frame_id=frame)
            moved.translation.x, moved.translation.y = ACROSS_M * col, DOWN_M * row
            moved.rotation.w = 1
            rig[f"tf {frame}"] = moved
    if places:
        head = FrameTransform(parent_frame_id="stand", child_frame_id="head")
        head.translation.z = 1.0
        turn = head.rotation
        turn.x, turn.y, turn.z, turn.w = TURNED
        rig["tf head"] = head
    return rig


def taken(rig: Rig, size: tuple[int, int] = SIZE) -> tuple[Calibration, float] | None:
    found = RecordedRig()
    for message in rig.values():
        schema = MessageSchema(message.DESCRIPTOR.full_name, "protobuf")
        found.push("/rig", schema, message.SerializeToString())
    return array_calibration(found, {camera: frame_of(camera) for camera in ARRAY.real}, size)


def check(found: tuple[Calibration, float] | None) -> None:
    assert found is not None
    calibration, rho = found
    assert calibration.given
    values = (calibration.fx_px, calibration.fy_px, calibration.cx_px, calibration.cy_px)
    assert values == (FX, FY, CX, CY)
    assert calibration.baseline_m == pytest.approx(ACROSS_M)
    assert calibration.d_inf_px_per_step == pytest.approx(D_INF)
    assert rho == pytest.approx(DOWN_M * FY / (ACROSS_M * FX))


@pytest.mark.parametrize("places", [True, False])
def test_cameras_of_a_rectified_array_give_its_calibration(places: bool) -> None:
    check(taken(make_rig(places=places)))


def test_several_transforms_in_a_message_and_cameras_that_rectification_turns() -> None:
    rig = make_rig()
    frame = frame_of((1, 1))
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    rig[frame].R[:] = quarter.T.ravel()
    rotation = rig[f"tf {frame}"].rotation
    rotation.z = rotation.w = np.sqrt(0.5)
    with pytest.raises(NotRectified, match=r"turned by 180\.00 degrees"):
        taken(rig)  # R turns the same way as the transform
    rig[frame].R[:] = quarter.ravel()
    transforms = [rig.pop(name) for name in list(rig) if name.startswith("tf ")]
    rig["all"] = FrameTransforms(transforms=transforms)
    check(taken(rig))


def test_without_calibration_there_is_none() -> None:
    assert taken({}) is None
    assert taken({name: message for name, message in make_rig().items() if name.startswith("tf ")}) is None


def _change(frame: str, change: Callable[[Any], None]) -> Rig:
    rig = make_rig()
    change(rig[frame])
    return rig


def _move(message: Any) -> None:
    message.translation.x += 0.01


def _turn(message: Any) -> None:
    message.rotation.z = 0.01


def _swap() -> Rig:
    rig = make_rig()
    for col in range(2):
        rig[f"tf frame(0, {col})"].translation.x, rig[f"tf frame(1, {col})"].translation.x = (
            0.2 - 0.2 * col,
        ) * 2
    return rig


LAST = "frame(1, 1)"


@pytest.mark.parametrize(
    ("rig", "told"),
    [
        (
            _change(LAST, lambda m: m.P.__setitem__(0, 82)),
            r"'frame\(1, 1\)' has a focal length of 82 px, another 80",
        ),
        (
            _change(LAST, lambda m: m.P.__setitem__(6, 40)),
            "has its principal point .* px away from the others'",
        ),
        (_change(LAST, lambda m: setattr(m, "width", 192)), "is for 192x64 px, the pictures have 96x64"),
        (_change(LAST, lambda m: m.P.__setitem__(0, float("nan"))), "has no focal length"),
        (_change(f"tf {LAST}", _turn), r"is turned by 1\.15 degrees against another"),
        (_change(f"tf {LAST}", _move), r"is 0\.01 m away from its place on the grid"),
        (_swap(), "steps of -0.2, 0.3 m between its cameras"),
        ({name: m for name, m in make_rig().items() if name != LAST}, r"but none of 'frame\(1, 1\)'"),
        ({name: m for name, m in make_rig().items() if not name.startswith("tf")}, "steps of 0, 0 m"),
    ],
)
def test_what_is_no_rectified_array_is_told(rig: Rig, told: str) -> None:
    with pytest.raises(NotRectified, match=told):
        taken(rig)


def test_transforms_in_a_circle_end() -> None:
    rig = make_rig()
    rig["tf head"].parent_frame_id = frame_of((0, 0))
    rig["tf frame(0, 0)"].parent_frame_id = "head"
    check(taken(rig))  # up to the circle all cameras go the same way


def written(rig: Rig) -> bytes:
    """A recording with a rig at its start."""
    target = io.BytesIO()
    pictures = recording("png", shots(3))
    with Writer(target) as writer:
        for name, message in rig.items():
            topic = "/tf" if name.startswith("tf ") else f"/info/{name}"
            writer.write_message(topic, message, START_NS, START_NS)
        copy_pictures(pictures, writer)
    return target.getvalue()


def copy_pictures(content: bytes, writer: Writer) -> None:
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    reader = make_reader(io.BytesIO(content), decoder_factories=[DecoderFactory()])
    for _, channel, message, decoded in reader.iter_decoded_messages():
        writer.write_message(channel.topic, decoded, message.log_time, message.log_time)


def test_the_command_takes_the_recordings_calibration(tmp_path: Path) -> None:
    source, out = tmp_path / "rec.mcap", tmp_path / "out.mcap"
    source.write_bytes(written(make_rig()))
    options = ("--topics", GRID, "--preset", "ultrafast", "--disparity-range", "0,16", "--fps", "10")
    done = mvcodec("encode", source, out, *options, "--depth", "raw16")
    assert (done.returncode, done.stderr) == (0, "")
    with McapReader.open(out) as reader:
        array = reader.header.array
    check((array.calibration, array.rho))
    given = {"fx_px": 50.0, "fy_px": 50.0, "cx_px": 48.0, "cy_px": 32.0, "baseline_m": 0.5}
    (tmp_path / "c.json").write_text(json.dumps(given))
    succeeds("encode", source, out, "-y", *options, "--calibration", tmp_path / "c.json")
    with McapReader.open(out) as reader:
        assert reader.header.array.calibration == Calibration(50.0, 50.0, 48.0, 32.0, 0.5)


def test_the_command_tells_once_why_it_does_not(tmp_path: Path) -> None:
    source, out = tmp_path / "rec.mcap", tmp_path / "out.mcap"
    source.write_bytes(written(_change(LAST, lambda m: m.P.__setitem__(0, 90))))
    options = ("--topics", GRID, "--preset", "ultrafast", "--disparity-range", "0,16", "--fps", "10")
    done = mvcodec("encode", source, out, *options)
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert "its calibration is not that of a rectified array (frame 'frame(1, 1)' has a focal length" in line
    assert line.endswith("; nominal values stand in")
    with McapReader.open(out) as reader:
        assert not reader.header.array.calibration.given


@pytest.mark.parametrize("given", [True, False])
def test_files_of_ours_are_recordings_too(given: bool) -> None:
    array = make_array()
    calibration = Calibration(FX, FX, CX, CY, ACROSS_M, d_inf_px_per_step=0.75, given=given)
    content = encoded_file(replace(array, calibration=calibration, rho=1.25), 3)
    grid = tuple(tuple(f"/camera/r0{row}_c0{col}/video" for col in range(2)) for row in range(2))
    found = Recording(io.BytesIO(content), "ours", RecordingSettings(grid))
    if given:
        assert found.array.calibration == calibration
        assert found.array.rho == pytest.approx(1.25)
    else:
        assert not found.array.calibration.given
        assert found.calibration_note == "no calibration given"

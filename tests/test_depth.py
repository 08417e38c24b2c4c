"""Metric depth and points: of a wall at a known distance, as Foxglove's tools read them."""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coding import config, frame_set, make_array
from command_line import fails, mvcodec, succeeds
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.reader import make_reader
from small_arrays import write_array

from mvcodec.array import Calibration, CameraArray
from mvcodec.conformance.validation import validate
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.depth import depth_m, depth_mm, points_of, warn_behind_infinity
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import MvCodecWarning
from mvcodec.frames import DecodedSet, DisparityMap

GIVEN = Calibration(100.0, 100.0, 47.5, 31.5, 0.05)
ARRAY = replace(make_array(96, 64), calibration=GIVEN)


def test_depth_is_focal_length_times_baseline_over_disparity() -> None:
    values_px = np.array([[5.0, 10.0, 0.0, -1.0]], np.float32)
    np.testing.assert_allclose(depth_m(ARRAY, values_px), [[1.0, 0.5, np.inf, np.inf]])
    assert depth_mm(ARRAY, values_px).tolist() == [[1000, 500, 0, 0]]
    wide = replace(ARRAY, rows=2, cols=3, real_cols=(0, 2))
    np.testing.assert_allclose(depth_m(wide, values_px)[0, :2], [2.0, 1.0])
    toed_in = replace(ARRAY, calibration=replace(GIVEN, d_inf_px_per_step=2.0))
    np.testing.assert_allclose(depth_m(toed_in, values_px)[0, :2], [5 / 3, 0.625])
    column = CameraArray(3, 1, 96, 64, 10.0, (0, 2), (0,), replace(GIVEN, fy_px=200.0))
    np.testing.assert_allclose(depth_m(column, values_px)[0, 0], 4.0)
    far = np.array([[0.05]], np.float32)
    assert depth_mm(ARRAY, far).tolist() == [[0]], "100 m don't fit 16 bits of millimetres"


def test_cameras_in_the_wrong_order_are_told() -> None:
    """Left and right swapped, everything lies behind infinity."""
    right_order = np.full((4, 6), 5, np.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_behind_infinity(ARRAY, [right_order, right_order], "a")
    with pytest.warns(MvCodecWarning, match=r"a: 100% of the pixels lie behind infinity .* cameras swapped"):
        warn_behind_infinity(ARRAY, [-right_order, -right_order], "a")


def _wall() -> DecodedSet:
    """A wall one metre away, each pixel of its camera's own colour."""
    flat = DisparityMap(np.full((64, 96), 5, np.float32), np.ones((64, 96), np.bool_))
    pictures = {camera: np.full((64, 96, 3), 60 * sum(camera), np.uint8) for camera in ARRAY.real}
    return DecodedSet(ARRAY, 0, 0, pictures, dict.fromkeys(ARRAY.real, flat), (0.0, 9.0))


def test_points_lie_where_the_cameras_see_them() -> None:
    points = points_of(_wall())
    assert points.places_m.shape == (4 * 96 * 64, 3)
    np.testing.assert_allclose(points.places_m[:, 0], 1.0)
    right_below = points.places_m[points.colours[:, 0] == 120]
    # the middle pixel of the camera one step to the right and one down
    middle = right_below.reshape(64, 96, 3)[31:33, 47:49].mean(axis=(0, 1))
    np.testing.assert_allclose(middle, [1.0, -0.05, -0.05], atol=1e-6)
    corner = right_below.reshape(64, 96, 3)[0, 0]
    np.testing.assert_allclose(corner, [1.0, -0.05 + 0.475, -0.05 + 0.315], atol=1e-6)
    assert len(points_of(_wall(), stride=4).places_m) == 4 * 24 * 16
    assert len(points_of(_wall(), max_depth_m=0.9).places_m) == 0
    assert len(points_of(replace(_wall(), absent=((0, 0),))).places_m) == 3 * 96 * 64


@pytest.mark.parametrize(("rows", "cols"), [(2, 2), (1, 2), (3, 1)])
def test_cameras_that_see_infinity_at_a_disparity_agree_on_where_a_point_is(rows: int, cols: int) -> None:
    """One point, projected by hand: each camera's principal point is where it sees infinity."""
    given = Calibration(100.0, 100.0, 47.0, 31.0, 0.05, d_inf_px_per_step=2.0)
    array = replace(
        make_array(96, 64, rows=rows, cols=cols), calibration=given, rho=1.0 if cols == 1 else 1.5
    )
    x, y = (67, 46) if cols == 1 else (67, 49)  # in view (0, 0); 5 px a step nearer than infinity: 1 m away
    pictures, maps = {}, {}
    for row, col in array.real:
        pictures[row, col] = np.zeros((64, 96, 3), np.uint8)
        pictures[row, col][round(y - row * 7 * array.rho), x - 7 * col] = 255
        maps[row, col] = DisparityMap(np.full((64, 96), 7, np.float32), np.ones((64, 96), np.bool_))
    points = points_of(DecodedSet(array, 0, 0, pictures, maps, (0.0, 9.0)))
    seen = points.places_m[points.colours[:, 0] == 255]
    expected = [1.0, -(x - 47) / 100, -(y - 31) / 100]
    # a pixel is a centimetre at that depth, and rho's rows lie between pixels
    np.testing.assert_allclose(seen, np.tile(expected, (rows * cols, 1)), atol=0.0051)


def test_depth_topics_are_what_viewers_expect_and_our_reader_ignores(tmp_path: Path) -> None:
    path = tmp_path / "depth.mcap"
    with Encoder(ARRAY, config(depth=True)) as encoder, McapWriter(path) as writer:
        for index in range(3):
            writer.push(encoder.push(frame_set(ARRAY, index)))
    found = [
        (message.log_time, RawImage.FromString(message.data))
        for _, channel, message in make_reader(io.BytesIO(path.read_bytes())).iter_messages()
        if channel.topic == "/camera/r01_c01/depth"
    ]
    assert [time for time, _ in found] == [0, 100_000_000, 200_000_000]
    image = found[0][1]
    assert (image.encoding, image.width, image.height, image.step) == ("16UC1", 96, 64, 192)
    assert image.frame_id == "camera_r01_c01"
    millimetres = np.frombuffer(image.data, "<u2").reshape(64, 96)
    with Decoder.open(path) as decoder:
        decoded = next(iter(decoder))
    expected = depth_mm(ARRAY, decoded.disparities[1, 1].values_px)
    near = (expected > 0) & (expected < 3000)
    assert near.mean() > 0.3
    assert np.abs(millimetres[near].astype(int) - expected[near]).mean() < 100, "but for coding"
    assert validate(path) == []


def test_the_commands_want_a_calibration(tmp_path: Path) -> None:
    array = write_array(tmp_path / "array", frames=2)
    out = tmp_path / "x.mcap"
    fast = ("--preset", "ultrafast", "--disparity-range", "0,8")
    line = fails(2, "encode", array, out, "--depth", "raw16", *fast)
    assert "calibration: found none given" in line
    assert mvcodec("encode", array, out, "--depth", "raw16", "--nominal", *fast).returncode == 0
    summary = make_reader(io.BytesIO(out.read_bytes())).get_summary()
    assert summary is not None
    assert "/camera/r00_c00/depth" in {channel.topic for channel in summary.channels.values()}
    assert "calibration: found none given" in fails(2, "export-points", out, tmp_path / "x.ply")
    text = '{"fx_px": 80, "fy_px": 80, "cx_px": 30, "cy_px": 20, "baseline_m": 0.1}'
    (tmp_path / "calibration.json").write_text(text)
    calibrated = ("--calibration", tmp_path / "calibration.json")
    succeeds("export-points", out, tmp_path / "x.ply", *calibrated, "--stride", "2")
    assert mvcodec("encode", array, out, "--depth", "raw16", "-y", *calibrated, *fast).stderr == ""
    (tmp_path / "calibration.json").write_text('{"fx_px": 80}')
    assert "fy_px" in fails(1, "encode", array, out, "-y", *calibrated)


def test_points_are_exported_as_ply_and_as_point_clouds(tmp_path: Path) -> None:
    coded = tmp_path / "x.mcap"
    with Encoder(ARRAY, config()) as encoder, McapWriter(coded) as writer:
        for index in range(3):
            writer.push(encoder.push(frame_set(ARRAY, index)))
    told = succeeds("export-points", coded, tmp_path / "x.ply", "--max-depth", "20")
    head, body = (tmp_path / "x.ply").read_bytes().split(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    assert len(body) == 15 * count
    assert told == f"{tmp_path / 'x.ply'}: {count} points of frame 0\n"
    places = np.frombuffer(body, np.dtype([("place", "<f4", 3), ("colour", "u1", 3)]))["place"]
    assert 0 < places[:, 0].min() <= places[:, 0].max() <= 20
    some = ("--max-depth", "20", "--frames", "1:3")
    told = succeeds("export-points", coded, tmp_path / "points.mcap", *some)
    clouds = [
        PointCloud.FromString(message.data)
        for _, _, message in make_reader(io.BytesIO((tmp_path / "points.mcap").read_bytes())).iter_messages()
    ]
    total = sum(len(cloud.data) // cloud.point_stride for cloud in clouds)
    assert told == f"{tmp_path / 'points.mcap'}: {total} points of 2 frames\n"
    assert succeeds("export-points", coded, tmp_path / "points.mcap", *some, "-y", "--quiet") == ""
    assert [cloud.timestamp.ToNanoseconds() for cloud in clouds] == [100_000_000, 200_000_000]
    cloud = clouds[0]
    assert (cloud.frame_id, cloud.point_stride) == ("rig", 16)
    assert [(field.name, field.offset) for field in cloud.fields][:4] == [
        ("x", 0),
        ("y", 4),
        ("z", 8),
        ("red", 12),
    ]
    packed = np.frombuffer(cloud.data, np.dtype([("place", "<f4", 3), ("colour", "u1", 4)]))
    assert (packed["colour"][:, 3] == 255).all()
    assert 0 < packed["place"][:, 0].min() <= packed["place"][:, 0].max() <= 20
    assert "ends in .mcap or .ply" in fails(2, "export-points", coded, tmp_path / "x.obj")


@pytest.mark.parametrize("name", ["x.mcap", "x.ply"])
def test_a_damaged_input_is_named(name: str, tmp_path: Path) -> None:
    (tmp_path / "bad.mcap").write_bytes(b"not a recording at all")
    assert "not MCAP" in fails(1, "export-points", tmp_path / "bad.mcap", tmp_path / name)

"""`mvcodec validate` on files that are not FORMAT.md's: views, points, and what is neither."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from broken_files import rewritten
from coding import config, frame_set, make_array
from command_line import fails, mvcodec, succeeds
from damage import chunk_ends, small_file
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from mcap.reader import make_reader
from mcap.writer import Writer

from mvcodec.array import Viewpoint
from mvcodec.conformance.validation import FileKind, Validation, examine
from mvcodec.container.point_writer import PointWriter
from mvcodec.container.video_topics import VideoTopicsWriter
from mvcodec.encoding.encoder import Encoder
from mvcodec.output.forms import OutputPlan
from mvcodec.output.mcap_views import McapViews
from mvcodec.stream import TrackKind
from mvcodec.video.annexb import nal_type, nal_units
from mvcodec.video.codecs import CODECS

ARRAY = make_array(48, 32, rows=1)
TOPIC = "/view/r00_c00/video"
Change = Callable[[str, Any, int], tuple[Any, int] | None]


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """25 frames of two views, 10 a second, as `decode --format mcap` writes them."""
    path = tmp_path_factory.mktemp("views") / "views.mcap"
    plan = OutputPlan(ARRAY, (Viewpoint(0, 0), Viewpoint(0, 0.5)), None)
    with McapViews(path, plan, 500) as writer:
        for index in range(25):
            picture = frame_set(ARRAY, index).pictures[0, 0]
            writer.push([picture, picture[:, ::-1]], index, index * 100_000_000)
    return path.read_bytes()


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Three clouds, as `export-points` writes them."""
    path = tmp_path_factory.mktemp("points") / "points.mcap"
    with PointWriter(path) as writer:
        for index in range(3):
            writer.push(index, index * 100_000_000, np.ones((7, 3), np.float32), np.ones((7, 3), np.uint8))
    return path.read_bytes()


def _changed(content: bytes, message_type: Any, change: Change) -> bytes:
    """The file once more, each message of a type changed (message, log time) or left out."""
    names = {
        channel.topic: schema.name
        for schema, channel, _ in make_reader(io.BytesIO(content)).iter_messages()
        if schema is not None
    }

    def changed(topic: str, data: bytes, time_ns: int) -> tuple[bytes, int] | None:
        if names[topic] != message_type.DESCRIPTOR.full_name:
            return data, time_ns
        new = change(topic, message_type.FromString(data), time_ns)
        return None if new is None else (new[0].SerializeToString(), new[1])

    return rewritten(content, changed)


def _examined(
    content: bytes, tmp_path: Path
) -> tuple[FileKind | None, list[tuple[str, str | None, int | None]]]:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    found = examine(path)
    return found.kind, [(finding.code, finding.topic, finding.time_ns) for finding in found.findings]


def test_what_our_commands_write_is_clean(tmp_path: Path) -> None:
    coded, views, points = (tmp_path / name for name in ("x.mcap", "views.mcap", "points.mcap"))
    coded.write_bytes(small_file())
    succeeds("decode", coded, views, "--format", "mcap", "--grid", "1x3", "--quiet")
    succeeds("export-points", coded, points, "--nominal", "--stride", "4")
    for path, kind, said in (
        (coded, "array", "clean\n"),
        (views, "views", "clean (video topics without /mvcodec/header: checked as such)\n"),
        (points, "points", "clean (point clouds: checked as such)\n"),
    ):
        assert succeeds("validate", path) == f"{path}: {said}"
        document = json.loads(succeeds("validate", path, "--json"))
        assert document == {"file": str(path), "kind": kind, "clean": True, "findings": []}


@pytest.mark.parametrize("codec", CODECS)
def test_views_of_every_codec_are_clean(codec: str, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with (
        Encoder(ARRAY, config(gop=5, codec=codec)) as encoder,
        VideoTopicsWriter(path, ARRAY, {"0": Viewpoint(0, 0)}, codec) as writer,
    ):
        for index in range(12):
            packets = encoder.push(frame_set(ARRAY, index))
            unit = next(packet for packet in packets if packet.track.kind is TrackKind.TEXTURE)
            writer.push(index, unit.time_ns, index % 5 == 0, [unit.data])
    assert examine(path) == Validation(FileKind.VIEWS, [])


def _no_sets(data: bytes) -> bytes:
    return b"".join(b"\x00\x00\x00\x01" + unit for unit in nal_units(data) if nal_type(unit) not in (7, 8))


def _set(**fields: object) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        for name, value in fields.items():
            setattr(message, name, value)

    return change


def _cut_start_code(message: Any) -> None:
    message.data = message.data[4:]


def _twice(message: Any) -> None:
    message.data += message.data


@pytest.mark.parametrize(
    ("change", "time_s", "expected"),
    [
        (_set(format="vp8"), 0.5, "format"),
        (_set(frame_id="elsewhere"), 0.5, "frame-id"),
        (_set(frame_id=""), 0.5, "frame-id"),
        (_cut_start_code, 0.5, "annex-b"),
        (_twice, 0.5, "one-picture"),
        (_set(data=b""), 0.5, "one-picture"),
        (lambda message: setattr(message, "data", _no_sets(message.data)), 1.0, "parameter-sets"),
        (lambda message: message.timestamp.FromNanoseconds(7), 0.5, "time"),
    ],
)
def test_each_rule_for_video_is_checked(
    views: bytes, change: Callable[[Any], None], time_s: float, expected: str, tmp_path: Path
) -> None:
    at_ns = round(time_s * 1e9)

    def changed(topic: str, message: Any, time_ns: int) -> tuple[Any, int]:
        if (topic, time_ns) == (TOPIC, at_ns):
            change(message)
        return message, time_ns

    assert _examined(_changed(views, CompressedVideo, lambda _, m, n: (m, n)), tmp_path)[1] == []
    kind, findings = _examined(_changed(views, CompressedVideo, changed), tmp_path)
    assert kind is FileKind.VIEWS
    assert (expected, TOPIC, at_ns) in findings


def test_missing_keyframes_and_pictures_and_times_are_found(views: bytes, tmp_path: Path) -> None:
    def rare(_: str, message: Any, time_ns: int) -> tuple[Any, int]:
        message.timestamp.FromNanoseconds(2 * time_ns)
        return message, 2 * time_ns

    for change, expected in (
        (lambda t, m, n: None if (t, n) == (TOPIC, 500_000_000) else (m, n), "missing-reference"),
        (lambda t, m, n: None if (t, n) == (TOPIC, 0) else (m, n), "parameter-sets"),
        (lambda _, m, n: (m, 3 * 10**9 - n), "order"),
        (lambda _, m, n: (m, n - n % 200_000_000), "order"),
        (rare, "keyframe-interval"),
    ):
        codes = {code for code, *_ in _examined(_changed(views, CompressedVideo, change), tmp_path)[1]}
        assert expected in codes


def test_b_frames_are_found_in_anyones_video(tmp_path: Path) -> None:
    coder = av.CodecContext.create("libx264", "w")
    assert isinstance(coder, av.VideoCodecContext)
    coder.width, coder.height, coder.pix_fmt, coder.framerate = 48, 32, "yuv420p", Fraction(10)
    coder.time_base, coder.options = Fraction(1, 10), {"bf": "2", "b-adapt": "0", "g": "8"}
    pictures = [frame_set(ARRAY, index).pictures[0, 0] for index in range(8)]
    coded = [packet for picture in pictures for packet in coder.encode(av.VideoFrame.from_ndarray(picture))]
    path = tmp_path / "x.mcap"
    with VideoTopicsWriter(path, ARRAY, {"0": Viewpoint(0, 0)}, "h264") as writer:
        for index, packet in enumerate([*coded, *coder.encode(None)]):
            writer.push(index, index * 100_000_000, index == 0, [bytes(packet)])
    found = examine(path)
    assert found.kind is FileKind.VIEWS
    assert "b-frames" in {finding.code for finding in found.findings}


def test_calibration_and_places_must_be_the_videos(views: bytes, tmp_path: Path) -> None:
    def renamed(field: str) -> Change:
        def change(_: str, message: Any, time_ns: int) -> tuple[Any, int]:
            if getattr(message, field) == "view_r00_c00":
                setattr(message, field, "other")
            return message, time_ns

        return change

    _, findings = _examined(_changed(views, CameraCalibration, renamed("frame_id")), tmp_path)
    assert findings == [("frame-id", "/view/r00_c00/calibration", None), ("frame-id", TOPIC, None)]
    _, findings = _examined(_changed(views, FrameTransform, renamed("child_frame_id")), tmp_path)
    assert findings == [("frame-id", TOPIC, None)]
    without = _changed(views, CameraCalibration, lambda *_: None)
    assert _examined(without, tmp_path) == (FileKind.VIEWS, []), "a file need not have calibration"


def test_each_rule_for_points_is_checked(points: bytes, tmp_path: Path) -> None:
    def without_z(message: Any) -> None:
        del message.fields[2]

    for change in (
        _set(point_stride=0),
        _set(data=b"odd"),
        _set(point_stride=8),
        without_z,
    ):

        def changed(_: str, message: Any, time_ns: int, change: Callable[[Any], None] = change) -> Any:
            if time_ns == 100_000_000:
                change(message)
            return message, time_ns

        kind, findings = _examined(_changed(points, PointCloud, changed), tmp_path)
        assert kind is FileKind.POINTS
        assert set(findings) == {("points", "/points", 100_000_000)}


def test_damage_in_their_containers_is_found(views: bytes, points: bytes, tmp_path: Path) -> None:
    for content, kind in ((views, FileKind.VIEWS), (points, FileKind.POINTS)):
        broken = bytearray(content)
        broken[chunk_ends(content)[0] - 40] ^= 4
        found, findings = _examined(bytes(broken), tmp_path)
        assert found is kind
        assert ("chunk", "/points" if kind is FileKind.POINTS else "/tf", 0) in findings
        found, findings = _examined(content[: chunk_ends(content)[0] + 20], tmp_path)
        assert found is kind
        assert "cut-off" in {code for code, *_ in findings}


def test_a_file_that_is_neither_has_one_clear_finding(tmp_path: Path) -> None:
    target = io.BytesIO()
    writer = Writer(target, use_summary_offsets=False)
    writer.start()
    channel = writer.register_channel("/log", "json", writer.register_schema("log", "jsonschema", b"{}"))
    writer.add_message(channel, 0, b"{}", 0)
    writer.finish()  # type: ignore[no-untyped-call]
    path = tmp_path / "x.mcap"
    path.write_bytes(target.getvalue())
    document = json.loads(mvcodec("validate", path, "--json").stdout)
    (finding,) = document["findings"]
    assert (document["kind"], finding["code"]) == (None, "kind")
    assert finding["message"].startswith("topics: /log; expected one with /mvcodec/header")
    assert "1 error, 0 warnings" in fails(1, "validate", path)
    path.write_bytes(b"text " * 50)
    assert [code for code, *_ in _examined(path.read_bytes(), tmp_path)[1]] == ["magic"]


def test_our_own_file_stays_ours_where_its_first_chunk_is_damaged(tmp_path: Path) -> None:
    content = bytearray(small_file())
    content[chunk_ends(bytes(content))[0] - 100] ^= 8
    for broken in (bytes(content), bytes(content[:-40])):
        assert _examined(broken, tmp_path)[0] is FileKind.ARRAY
    (tmp_path / "x.mcap").write_bytes(content)
    damage, later = examine(tmp_path / "x.mcap").findings
    assert (damage.code, damage.topic, damage.time_ns) == ("chunk", "/camera/r00_c00/calibration", 0)
    assert later.message == "first_frame 0, but the first frame set is 5"

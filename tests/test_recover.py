"""`mvcodec recover`: all that a decoder would use, and nothing that it could not."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from broken_files import Sets, coded_sets, rewritten, written
from coding import config, encode, frame_set, make_array
from command_line import fails, mvcodec
from damage import chunk_ends, outcome
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.reader import make_reader

from mvcodec.array import Calibration
from mvcodec.conformance.recovery import Incomplete, Recovered, recover
from mvcodec.conformance.validation import validate
from mvcodec.container import McapReader, McapWriter
from mvcodec.container.declared import DROPPED_KEY
from mvcodec.container.limits import DEFAULT_LIMITS
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import SettingError, StreamError
from mvcodec.stream import Packet, TrackKind
from mvcodec.video.codecs import CODECS

ARRAY = replace(make_array(48, 32, rows=1), calibration=Calibration(100.0, 100.0, 23.5, 15.5, 0.05))
Wanted = Callable[[Packet], bool]


@pytest.fixture(scope="module")
def depth_file() -> bytes:
    """12 frame sets of two cameras with depth; keyframes, and so chunks, every four."""
    target = io.BytesIO()
    with Encoder(ARRAY, config(gop=4, qp=30, depth=True)) as encoder, McapWriter(target) as writer:
        for index in range(12):
            writer.push(encoder.push(frame_set(ARRAY, index)))
    return target.getvalue()


def _recovered(content: bytes, incomplete: Incomplete = "keep") -> tuple[bytes, Recovered, list[str]]:
    """The new file, what was said of it, and what was told."""
    target, told = io.BytesIO(), []

    def tell(error: StreamError) -> None:
        told.append(str(error))

    result = recover(io.BytesIO(content), target, tell, DEFAULT_LIMITS, incomplete)
    return target.getvalue(), result, told


def _messages(content: bytes) -> list[tuple[str, int, int, bytes]]:
    return [
        (channel.topic, message.log_time, message.sequence, message.data)
        for _, channel, message in make_reader(io.BytesIO(content)).iter_messages(log_time_order=False)
    ]


def _only(sets: Sets, wanted: Wanted) -> bytes:
    return written([[packet for packet in packets if wanted(packet)] for packets in sets])


def _findings(content: bytes, tmp_path: Path) -> Counter[str]:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    return Counter(finding.code for finding in validate(path))


def test_a_whole_file_comes_back_message_by_message(depth_file: bytes, tmp_path: Path) -> None:
    copy, result, told = _recovered(depth_file)
    assert _messages(copy) == _messages(depth_file)
    assert sum(topic.endswith("/depth") for topic, *_ in _messages(copy)) == 2 * 12
    assert (result, told) == (Recovered(12, 0, 0), [])
    assert _findings(copy, tmp_path) == {}


def test_depth_stays_with_its_frame_set_where_others_are_lost(depth_file: bytes, tmp_path: Path) -> None:
    broken = bytearray(depth_file)
    ends = chunk_ends(depth_file)
    broken[ends[1] - 100] ^= 16
    cut = depth_file[: ends[1] + 40]
    for content, frames in ((bytes(broken), [*range(4), *range(8, 12)]), (cut, range(8))):
        copy, result, told = _recovered(content)
        assert result == Recovered(len(frames), 0, 0)
        assert len(told) <= 1
        depth = [(topic, index) for topic, _, index, _ in _messages(copy) if topic.endswith("depth")]
        assert depth == [(f"/camera/r00_c0{col}/depth", index) for index in frames for col in (0, 1)]
        assert _findings(copy, tmp_path) == {}


def test_a_depth_image_that_is_none_is_told_and_costs_no_picture(depth_file: bytes) -> None:
    broken = io.BytesIO()
    with McapReader(io.BytesIO(depth_file), depth=True) as reader, McapWriter(broken) as writer:
        sets: dict[int, list[Packet]] = {}
        for _, packet in reader.packets():
            if packet.track.kind is TrackKind.DEPTH and packet.index == 5:
                packet = replace(packet, data=packet.data[:-2])  # noqa: PLW2901
            sets.setdefault(packet.index, []).append(packet)
        for packets in sets.values():
            writer.push(packets)
    copy, result, told = _recovered(broken.getvalue())
    assert result == Recovered(12, 1, 0)
    assert "/camera/r00_c00/depth at 0.500 s: found 48x32 px of 16UC1, 96 bytes a row, 3070 bytes" in told[0]
    assert outcome(copy).frames == list(range(12))
    images = [RawImage.FromString(data) for topic, *_, data in _messages(copy) if topic.endswith("depth")]
    assert {len(image.data) for image in images} == {3072}
    assert len(images) == 2 * 11


def test_a_camera_that_is_missing_throughout_does_not_cost_the_others() -> None:
    content = _only(coded_sets(), lambda packet: packet.track.camera != (0, 1))
    expected = outcome(content, "skip")
    assert expected.frames == list(range(12))
    copy, result, told = _recovered(content)
    assert result == Recovered(12, 12, 0)
    assert [text.split(":")[1] for text in told] == [
        " /camera/r00_c01/disparity at 0.000 s",
        " /camera/r00_c01/video at 0.000 s",
    ]
    assert outcome(copy).frames == expected.frames
    with pytest.raises(StreamError, match="no complete frame set that can be decoded"):
        _recovered(content, "drop")


def test_frame_sets_without_a_camera_are_kept_or_dropped(tmp_path: Path) -> None:
    content = _only(coded_sets(), lambda packet: packet.track.camera != (0, 1) or packet.index != 5)
    kept, result, _ = _recovered(content)
    assert result == Recovered(12, 3, 0)
    gone = {(topic, index) for topic, _, index, _ in _messages(written(coded_sets()))} - {
        (topic, index) for topic, _, index, _ in _messages(kept)
    }
    assert gone == {(f"/camera/r00_c01/{kind}", n) for n in (5, 6, 7) for kind in ("video", "disparity")}
    assert _findings(kept, tmp_path) == {"incomplete": 6}
    assert outcome(kept, "stop").frames == list(range(12))
    clean, result, told = _recovered(content, "drop")
    assert result == Recovered(9, 0, 3)
    assert len(told) == 2
    assert _findings(clean, tmp_path) == {}


@pytest.mark.parametrize("codec", CODECS)
def test_pictures_that_build_on_a_missing_frame_set_are_left_out(codec: str, tmp_path: Path) -> None:
    sets = coded_sets(codec=codec)
    del sets[5]
    for incomplete in ("keep", "drop"):
        copy, result, told = _recovered(written(sets), incomplete)
        assert (result, len(told)) == (Recovered(9, 0, 2), 4)
        assert _findings(copy, tmp_path) == {}


def test_the_number_of_dropped_frame_sets_is_copied() -> None:
    target = io.BytesIO()
    with McapWriter(target) as writer:
        for packets in coded_sets():
            writer.push(packets)
        writer.note({DROPPED_KEY: "3"})
    with McapReader(io.BytesIO(_recovered(target.getvalue())[0])) as reader:
        assert reader.dropped == 3


def test_the_command_says_how_many_are_incomplete(tmp_path: Path) -> None:
    source, target = tmp_path / "in.mcap", tmp_path / "out.mcap"
    source.write_bytes(_only(encode(ARRAY, 6, gop=3), lambda packet: packet.track.camera != (0, 1)))
    done = mvcodec("recover", source, target)
    assert (done.returncode, done.stdout) == (
        0,
        f"{target}: 6 frame sets recovered, 6 of them incomplete\n",
    )
    assert all(line.startswith("mvcodec: warning: ") for line in done.stderr.splitlines())
    line = fails(1, "recover", source, target, "-y", "--incomplete", "drop")
    assert "found no complete frame set that can be decoded" in line
    with pytest.raises(SettingError, match="incomplete: found some, expected keep or drop"):
        recover(source, target, lambda _: None, incomplete="some")  # type: ignore[arg-type]


def test_validate_misses_depth_where_it_is_lost(depth_file: bytes, tmp_path: Path) -> None:
    def without(wanted: Wanted) -> list[tuple[str, str | None, int | None]]:
        path = tmp_path / "x.mcap"
        sets: Sets = []
        with McapReader(io.BytesIO(depth_file), depth=True) as reader:
            for _, packet in reader.packets():
                if packet.index == len(sets):
                    sets.append([])
                if packet.track.kind is not TrackKind.DEPTH or wanted(packet):
                    sets[-1].append(packet)
        path.write_bytes(written(sets))
        return [(found.code, found.topic, found.time_ns) for found in validate(path)]

    assert without(lambda _: True) == []
    assert without(lambda _: False) == [], "depth is optional"
    topic = "/camera/r00_c01/depth"
    assert without(lambda packet: (packet.index, packet.track.topic) != (11, topic)) == [
        ("incomplete", topic, 1_100_000_000)
    ]
    assert without(lambda packet: packet.index > 0 or packet.track.topic != topic) == [
        ("incomplete", topic, 100_000_000)
    ]


def test_validate_finds_depth_that_is_not_as_specified(depth_file: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    changes: list[tuple[dict[str, object], str]] = [
        ({"encoding": "mono16"}, "depth"),
        ({"step": 95}, "depth"),
        ({"frame_id": "elsewhere"}, "frame-id"),
    ]
    for fields, code in changes:
        path.write_bytes(_with_depth(depth_file, fields))
        (found,) = validate(path)
        assert (found.code, found.topic, found.time_ns) == (code, "/camera/r00_c00/depth", 500_000_000)


def _with_depth(content: bytes, fields: dict[str, object]) -> bytes:
    """The file with other fields in one depth message."""

    def changed(topic: str, data: bytes, time_ns: int) -> tuple[bytes, int]:
        if (topic, time_ns) == ("/camera/r00_c00/depth", 500_000_000):
            image = RawImage.FromString(data)
            for name, value in fields.items():
                setattr(image, name, value)
            data = image.SerializeToString()
        return data, time_ns

    return rewritten(content, changed)

"""The MCAP file: what Foxglove's tools find in it, ranges, streams, cuts and bad files."""

from __future__ import annotations

import errno
import io
import json
import struct
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import pytest
from coding import RANGE_PX, Pipe, encode, encoded_file, make_array
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from mcap.reader import make_reader
from mcap.writer import Writer

from mvcodec.container import McapReader, McapWriter, read_info
from mvcodec.errors import InputError, MvCodecWarning, OutputError, SettingError, StreamClosed, StreamError
from mvcodec.stream import Packet, TrackKind

ARRAY = make_array()


@pytest.fixture(scope="module")
def coded() -> list[list[Packet]]:
    """14 frame sets, keyframes at 0, 4, 8 and 12, first index 30."""
    return encode(ARRAY, 14, first=30, gop=4)


@pytest.fixture(scope="module")
def file(coded: list[list[Packet]]) -> bytes:
    return _written(coded)


def _written(coded: Iterable[list[Packet]]) -> bytes:
    target = io.BytesIO()
    with McapWriter(target) as writer:
        for packets in coded:
            writer.push(packets)
    return target.getvalue()


def _push_all(writer: McapWriter, coded: Iterable[list[Packet]]) -> None:
    with writer:
        for packets in coded:
            writer.push(packets)


def _numbers(reader: McapReader, *ends: int) -> list[int]:
    """The frame sets read, each of which must be whole."""
    counts = Counter(number for number, packet in reader.packets(*ends) if packet.track.camera is not None)
    assert set(counts.values()) <= {2 * len(ARRAY.real)}
    return list(counts)


def test_packets_come_back_as_they_went_in(coded: list[list[Packet]], file: bytes) -> None:
    expected = [packet for packets in coded for packet in packets]
    assert [packet for _, packet in McapReader(io.BytesIO(file)).packets()] == expected
    assert [packet for _, packet in McapReader(Pipe(file)).packets()] == expected  # type: ignore[arg-type]


def test_other_tools_find_video_calibration_and_rig(coded: list[list[Packet]], file: bytes) -> None:
    messages: dict[str, list[tuple[str, int, bytes]]] = {}
    for schema, channel, message in make_reader(io.BytesIO(file), validate_crcs=True).iter_messages():
        assert schema is not None
        assert message.log_time == message.publish_time
        messages.setdefault(channel.topic, []).append((schema.name, message.log_time, message.data))
    for row, col in ARRAY.real:
        name = f"r{row:02d}_c{col:02d}"
        for kind in ("video", "disparity"):
            found = messages[f"/camera/{name}/{kind}"]
            assert [time for _, time, _ in found] == [packets[0].time_ns for packets in coded]
            assert {schema for schema, _, _ in found} == {"foxglove.CompressedVideo"}
            video = CompressedVideo.FromString(found[3][2])
            assert (video.format, video.frame_id) == ("h264", f"camera_{name}")
            assert video.timestamp.ToNanoseconds() == found[3][1]
        schema_name, time, data = messages[f"/camera/{name}/calibration"][1]
        calibration = CameraCalibration.FromString(data)
        assert (schema_name, time) == ("foxglove.CameraCalibration", coded[4][0].time_ns)
        assert (calibration.frame_id, calibration.width, calibration.height) == (f"camera_{name}", 96, 64)
        assert list(calibration.K) == [96, 0, 47.5, 0, 96, 31.5, 0, 0, 1]
    places = {
        t.child_frame_id: t for t in (FrameTransform.FromString(data) for _, _, data in messages["/tf"])
    }
    right_below = places["camera_r01_c01"]
    assert right_below.parent_frame_id == "rig"
    place = right_below.translation
    assert (place.x, place.y, place.z) == pytest.approx((0, -0.1, -0.1)), "x forward, y left, z up"
    assert json.loads(messages["/mvcodec/header"][0][2])["disparity_range_px"] == list(RANGE_PX)
    assert len(messages["/mvcodec/header"]) == len(messages["/tf"]) / len(ARRAY.real) == 4


def test_header_is_metadata_too(file: bytes) -> None:
    (metadata,) = make_reader(io.BytesIO(file)).iter_metadata()
    assert metadata.name == "mvcodec"
    assert json.loads(metadata.metadata["header"])["format"] == "mvcodec"


def test_chunks_start_at_keyframes_and_last_half_a_second_at_most() -> None:
    coded = encode(make_array(fps=20.0), 45, gop=18)
    summary = make_reader(io.BytesIO(_written(coded))).get_summary()
    assert summary is not None
    starts = [chunk.message_start_time for chunk in summary.chunk_indexes]
    assert {packets[0].time_ns for packets in coded[::18]} <= set(starts)
    for chunk in summary.chunk_indexes:
        assert chunk.message_end_time - chunk.message_start_time < 500_000_000


def test_a_growing_file_loses_half_a_second_at_most(tmp_path: Path) -> None:
    coded = encode(make_array(fps=20.0), 30, gop=20)
    path = tmp_path / "growing.mcap"
    writer = McapWriter(path)
    assert not path.exists(), "no file before the first frame set"
    for number, packets in enumerate(coded):
        writer.push(packets)
        if number >= 10:
            with pytest.warns(MvCodecWarning, match="growing.mcap: cut off after"):
                last = [number for number, _ in McapReader.open(path).packets()][-1]
            assert number - last <= 10
    writer.close()
    assert _numbers(McapReader.open(path)) == list(range(30))


def test_nothing_pushed_leaves_no_file(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "none.mcap"):
        pass
    assert not (tmp_path / "none.mcap").exists()


@pytest.mark.parametrize("count", [3, 8])
def test_ranges_start_at_the_keyframe_before(file: bytes, count: int) -> None:
    for start in range(14 - count):
        reader = McapReader(io.BytesIO(file))
        assert _numbers(reader, start, start + count) == list(range(start - start % 4, start + count))


def test_a_range_reads_only_its_chunks() -> None:
    content = encoded_file(ARRAY, 60, gop=10)
    reader = McapReader(io.BytesIO(content))
    assert _numbers(reader, 47, 48) == list(range(40, 48))
    assert reader.bytes_read < len(content) / 3
    index = [packet.index for _, packet in reader.packets(47, 48)]
    assert index[-1] == 47


@pytest.mark.parametrize(
    ("frames", "resolved"),
    [
        (None, (0, None)),
        (slice(2, 5), (2, 5)),
        (slice(None, 99), (0, 14)),
        (slice(-3, None), (11, 14)),
        (slice(1, -1), (1, 13)),
    ],
)
def test_slices_are_pythons(file: bytes, frames: slice | None, resolved: tuple[int, int | None]) -> None:
    assert McapReader(io.BytesIO(file)).resolve(frames) == resolved


@pytest.mark.parametrize("frames", [slice(5, 5), slice(14, None), slice(0, 8, 2)])
def test_empty_slices_are_refused(file: bytes, frames: slice) -> None:
    with pytest.raises(SettingError, match="frames: found"):
        McapReader(io.BytesIO(file)).resolve(frames)


def test_a_pipe_has_no_end_to_count_from(file: bytes) -> None:
    reader = McapReader(Pipe(file))  # type: ignore[arg-type]
    assert reader.frame_count is None
    assert reader.resolve(slice(3, None)) == (3, None)
    with pytest.raises(SettingError, match="frames: found -3:, expected counts from the start"):
        reader.resolve(slice(-3, None))


def test_a_cut_file_gives_every_complete_chunk_and_one_warning(file: bytes) -> None:
    summary = make_reader(io.BytesIO(file)).get_summary()
    assert summary is not None
    ends = [chunk.chunk_start_offset + chunk.chunk_length for chunk in summary.chunk_indexes]
    held = [4, 8, 12, 14]
    cuts = {end + more for end in ends for more in (-1, 0, 1, 7, 100)} | set(range(ends[-1], len(file), 97))
    for cut in sorted(cut for cut in cuts if ends[0] <= cut < len(file)):
        expected = held[sum(end <= cut for end in ends) - 1]
        for source in (io.BytesIO(file[:cut]), Pipe(file[:cut])):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                reader = McapReader(source, "cut.mcap")  # type: ignore[arg-type]
                assert _numbers(reader) == list(range(expected))
            (warning,) = caught
            assert warning.category is MvCodecWarning
            assert f"cut.mcap: cut off after {(30 + expected - 1) / 10:.3f} s" in str(warning.message)


@pytest.mark.parametrize("cut", [1, 8, 60, 700])
def test_a_file_cut_before_its_first_frame_set_is_an_error(file: bytes, cut: int) -> None:
    with pytest.raises(StreamError, match="before its first frame set"):
        McapReader(io.BytesIO(file[:cut]))


def test_a_newer_format_is_refused_by_its_number(coded: list[list[Packet]]) -> None:
    head = coded[0][0]
    newer = Packet(
        head.track, head.index, head.time_ns, True, head.data.replace(b'"version":1', b'"version":7')
    )
    with pytest.raises(StreamError, match="found format version 7, expected version 1"):
        McapReader(io.BytesIO(_with_header(newer)))


def _with_header(packet: Packet) -> bytes:
    target = io.BytesIO()
    writer = Writer(target)
    writer.start()
    channel = writer.register_channel("/mvcodec/header", "json", 0)
    writer.add_message(channel, packet.time_ns, packet.data, packet.time_ns, packet.index)
    writer.finish()  # type: ignore[no-untyped-call]
    return target.getvalue()


def test_a_flipped_bit_in_a_chunk_is_found_with_its_time(file: bytes) -> None:
    summary = make_reader(io.BytesIO(file)).get_summary()
    assert summary is not None
    third = summary.chunk_indexes[2]
    broken = bytearray(file)
    broken[third.chunk_start_offset + third.chunk_length // 2] ^= 4
    for source in (io.BytesIO(bytes(broken)), Pipe(bytes(broken))):
        reader = McapReader(source)  # type: ignore[arg-type]
        seen: set[int] = set()
        where = r"/calibration and 13 more topics at 3\.800\.\.4\.100 s: found damage"
        with pytest.raises(StreamError, match=where):
            seen.update(number for number, _ in reader.packets())
        assert seen <= set(range(8))


def test_a_chunk_that_claims_terabytes_is_refused(file: bytes) -> None:
    summary = make_reader(io.BytesIO(file)).get_summary()
    assert summary is not None
    broken = bytearray(file)
    size_at = summary.chunk_indexes[0].chunk_start_offset + 9 + 16
    broken[size_at : size_at + 8] = struct.pack("<Q", 1 << 44)
    with pytest.raises(StreamError, match="a chunk of 17592186044416 bytes"):
        McapReader(io.BytesIO(bytes(broken)))


def test_missing_file_and_unwritable_target(tmp_path: Path, coded: list[list[Packet]]) -> None:
    with pytest.raises(InputError, match=r"none\.mcap: found No such file"):
        McapReader.open(tmp_path / "none.mcap")
    with pytest.raises(OutputError, match=r"out\.mcap: cannot be written: No such file or directory"):
        McapWriter(tmp_path / "missing" / "out.mcap").push(coded[0])


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_one_line(coded: list[list[Packet]]) -> None:
    with pytest.raises(OutputError, match="/dev/full: cannot be written: No space left on device"):
        _fill_up(Path("/dev/full"), coded)
    with (
        Path("/dev/full").open("wb", buffering=0) as pipe,
        pytest.raises(OutputError, match="No space left on device"),
    ):
        _fill_up(pipe, coded)


def _fill_up(target: BinaryIO | Path, coded: list[list[Packet]]) -> None:
    with McapWriter(target) as writer:
        for packets in coded:
            writer.push(packets)


def test_closed_writer_takes_nothing(coded: list[list[Packet]]) -> None:
    writer = McapWriter(io.BytesIO())
    writer.push(coded[0])
    writer.close()
    writer.close()
    with pytest.raises(StreamClosed):
        writer.push(coded[1])


def test_info_says_where_the_bits_go(coded: list[list[Packet]], file: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(file)
    for source in (path, str(path), io.BytesIO(file), Pipe(file)):
        info = read_info(source)  # type: ignore[arg-type]
        assert info.frames == 14
        assert info.header.array == ARRAY
        assert info.bits.total == 8 * len(file)
        sizes = Counter[TrackKind]()
        for packet in (packet for packets in coded for packet in packets):
            sizes[packet.track.kind] += 8 * len(packet.data)
        assert info.bits.texture == sizes[TrackKind.TEXTURE]
        assert info.bits.disparity == sizes[TrackKind.DISPARITY]
        assert info.bits.other == info.bits.total - info.bits.texture - info.bits.disparity


def test_the_container_costs_little() -> None:
    """Of a second of four small cameras, less than 300 bytes a frame set and 7 kB once."""
    info = read_info(io.BytesIO(encoded_file(ARRAY, 10, qp=20)))
    assert info.bits.other / 8 < 7000 + 300 * 10


class _FullDisk(io.BytesIO):
    """Takes so many bytes, then no more."""

    def __init__(self, room: int) -> None:
        super().__init__()
        self._room = room

    def write(self, data: Any, /) -> int:
        if self.tell() + len(data) > self._room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


def test_a_writer_counts_what_is_surely_in_the_file(coded: list[list[Packet]], file: bytes) -> None:
    whole = McapWriter(io.BytesIO())
    _push_all(whole, coded)
    assert whole.written_count == len(coded)

    disk = _FullDisk(len(file) // 2)
    cut = McapWriter(disk)
    with pytest.raises(OutputError, match="No space left on device"):
        _push_all(cut, coded)
    with pytest.warns(MvCodecWarning):
        readable = _numbers(McapReader(io.BytesIO(disk.getvalue()), "cut"))
    assert 0 < cut.written_count < cut.frame_count <= len(coded)
    assert cut.written_count <= len(readable) < len(coded)

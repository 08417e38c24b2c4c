"""Recordings as people have them: clocks, gaps, losses and orders of all kinds."""

from __future__ import annotations

import io
import random
import warnings
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import pytest
from coding import Pipe
from command_line import fails, succeeds
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import CompressionType
from odd_recordings import START_NS, STEP_NS, TOPICS, Timed, at, raw, raws, videos, written
from timed_videos import SIZE, number_of, numbered

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.container import read_info
from mvcodec.errors import InputError, SettingError, StreamError

PAUSE_NS = 60 * 10**9


class Read:
    """What comes of recordings."""

    def __init__(self, *contents: bytes, pipe: bool = False, skip: bool = False, **settings: Any) -> None:
        files = [cast("BinaryIO", Pipe(content) if pipe else io.BytesIO(content)) for content in contents]
        self.errors: list[InputError] = []
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            asked = RecordingSettings((TOPICS,), **settings)
            self.recording = Recording(files, "rec", asked, on_damage=self.errors.append if skip else None)
            sets = list(self.recording.frame_sets())
        self.told = "\n".join(str(warning.message) for warning in caught)
        self.numbers = [[number_of(picture) for picture in item.pictures.values()] for item in sets]
        self.times = [item.time_ns for item in sets]
        self.pictures = [item.pictures for item in sets]

    @property
    def pairs(self) -> list[int]:
        """The numbers, where each frame set has one only."""
        assert all(first == second for first, second in self.numbers), self.numbers
        return [first for first, _ in self.numbers]


def without(messages: list[Timed], topic: str, numbers: set[int]) -> list[Timed]:
    return [m for m in messages if not (m[0] == topic and round((m[2] - START_NS) / STEP_NS) in numbers)]


@pytest.mark.parametrize("pipe", [False, True])
def test_a_pause_is_no_rate(pipe: bool) -> None:
    taken = without(raws(range(16)), TOPICS[1], {5, 6})
    paused = [
        (t, m, log + PAUSE_NS * (log >= at(8)), stamp + PAUSE_NS * (stamp >= at(8)))
        for t, m, log, stamp in taken
    ]
    read = Read(written(paused), pipe=pipe)
    assert read.pairs == [n for n in range(16) if n not in (5, 6)]
    assert read.times == [at(n) + PAUSE_NS * (n >= 8) for n in read.pairs]
    assert read.recording.array.fps == pytest.approx(30, rel=1e-4)


@pytest.mark.parametrize("order", ["topic by topic", "shuffled"])
def test_messages_are_taken_in_order_of_time_where_there_is_an_index(order: str) -> None:
    messages = raws(range(24))
    if order == "topic by topic":
        messages.sort(key=lambda message: message[0])
    else:
        random.Random(1).shuffle(messages)
    read = Read(written(messages, chunk_bytes=40_000))
    assert read.pairs == list(range(24))
    assert read.told.count("\n") == 0


def test_stamps_that_overtake_each_other_are_put_in_order() -> None:
    """A picture that was written down late has its place by its stamp."""
    late = {at(5): at(6.5), at(11): at(13.2)}
    messages = [
        (t, m, late.get(log, log) if t == TOPICS[1] else log, stamp) for t, m, log, stamp in raws(range(16))
    ]
    assert Read(written(messages)).pairs == list(range(16))


def test_cameras_whose_clocks_differ_are_told_and_paired_by_the_log() -> None:
    messages = [(t, m, log, stamp + 5 * 10**9 * (t == TOPICS[1])) for t, m, log, stamp in raws(range(12))]
    with pytest.raises(
        InputError, match=r"no frame set .* /cam1 are 5\.000 s ahead of those of /cam0.*`clock` log"
    ):
        Read(written(messages))
    assert Read(written(messages), clock="log").pairs == list(range(12))
    assert Read(written(messages), offsets_ms={"/cam1": -5000}).pairs == list(range(12))
    near = [(t, m, log, stamp + 4 * STEP_NS * (t == TOPICS[1])) for t, m, log, stamp in raws(range(12))]
    read = Read(written(near))
    assert "/cam1 are 0.133 s ahead of those of /cam0" in read.told, (
        "or other moments are paired without a word"
    )
    assert Read(written(near), clock="log").told == ""
    with pytest.raises(SettingError, match="clock: found sun"):
        RecordingSettings((TOPICS,), clock=cast("Any", "sun"))


@pytest.mark.parametrize("pipe", [False, True])
def test_a_clock_that_is_set_back_is_told_and_survived(pipe: bool) -> None:
    back = 3600 * 10**9
    messages = [(t, m, log, stamp - back * (stamp >= at(8))) for t, m, log, stamp in raws(range(16))]
    read = Read(written(messages), pipe=pipe)
    assert read.pairs == list(range(16))
    assert "was set back by 3600.000 s" in read.told
    assert read.told.count("set back") == 1, "one clock, told once"
    assert np.diff(read.times).min() > 0.9 * STEP_NS
    assert np.diff(read.times).max() < 1.1 * STEP_NS


def test_a_recorders_clock_that_is_set_back_does_not_mix_two_stretches() -> None:
    back = 10 * STEP_NS
    messages = [(t, m, log - back * (log >= at(12)), 0) for t, m, log, _ in raws(range(24))]
    read = Read(written(messages, chunk_bytes=40_000))
    assert "was set back" in read.told
    assert all(first == second for first, second in read.numbers)
    assert read.pairs[:12] == list(range(12))


def test_the_rate_is_that_of_the_slowest_topic() -> None:
    messages = [m for n in range(30) for m in raws([n], (0, 1) if n % 3 == 0 else (0,))]
    read = Read(written(messages))
    assert read.pairs == list(range(0, 30, 3))
    assert read.recording.array.fps == pytest.approx(10, rel=1e-4)


def test_offsets_within_a_frame_are_told() -> None:
    messages = [(t, m, log, stamp + 10_000_000 * (t == TOPICS[1])) for t, m, log, stamp in raws(range(10))]
    read = Read(written(messages))
    assert read.pairs == list(range(10))
    assert "/cam1 takes its pictures 10 ms after /cam0 all the time, 0.30 of a frame" in read.told


@pytest.mark.parametrize("pipe", [False, True])
def test_what_builds_on_a_lost_message_is_left_out(pipe: bool) -> None:
    read = Read(written(videos(20, lost=[(1, 11)])), pipe=pipe)
    assert read.pairs == [*range(11), *range(16, 20)]
    assert "/cam1 at 1700000000.400 s: dropped, it builds on a picture that is missing" in read.told
    for number, pictures in zip(read.pairs, read.pictures, strict=True):
        assert abs(pictures[0, 1].astype(int) - numbered(number, 1)).mean() < 6


def test_a_video_begins_at_its_first_keyframe() -> None:
    messages = [m for m in videos(20) if m[2] >= at(3)]
    read = Read(written(messages))
    assert read.pairs == list(range(8, 20))
    assert "dropped, a video before its first keyframe" in read.told


def test_a_duplicate_message_costs_itself_alone() -> None:
    messages = videos(16)
    doubled = [m for m in messages for _ in range(2 if m[2] in (at(3), at(9)) else 1)]
    for content in (written(doubled), written([*raws(range(9)), *raws([8]), *raws(range(9, 16))])):
        read = Read(content)
        assert read.pairs == list(range(16))
        assert "dropped" in read.told


def test_pictures_that_are_sent_out_of_order_are_put_in_order() -> None:
    options = {"bf": "3", "g": "24", "x264-params": "repeat-headers=1:b-adapt=0"}
    messages = videos(24, options=options)
    assert [m[3] for m in messages if m[0] == TOPICS[0]] != sorted(
        m[3] for m in messages if m[0] == TOPICS[0]
    )
    read = Read(written(messages))
    assert read.pairs == list(range(24))
    assert read.times == [at(n) for n in range(24)]
    assert read.told == ""


def test_parameter_sets_may_come_by_themselves() -> None:
    messages: list[Timed] = []
    for topic, message, log, stamp in videos(12):
        head, key, rest = message.data.partition(b"\0\0\1\x65")
        parts = [head.removesuffix(b"\0"), key + rest] if key else [message.data]
        messages += [(topic, type(message)(data=part, format="h264"), log, stamp) for part in parts]
    assert Read(written(messages)).pairs == list(range(12))


def test_video_without_start_codes_is_told() -> None:
    """Length prefixes in place of start codes, as MP4 has them."""
    messages = [
        (t, CompressedVideo(data=m.data.replace(b"\0\0\1", b"\0\0\2"), format="h264"), log, stamp)
        for t, m, log, stamp in videos(4)
    ]
    data = io.BytesIO(written(messages))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with pytest.raises(InputError, match="no frame set of all cameras"):
            Recording(data, "rec", RecordingSettings((TOPICS,)))
    assert any("it has no start codes" in str(warning.message) for warning in caught)


@pytest.mark.parametrize("compression", [CompressionType.LZ4, CompressionType.NONE])
def test_packings(compression: CompressionType) -> None:
    assert Read(written(raws(range(4)), compression)).pairs == list(range(4))
    assert Read(written(raws(range(4)), compression), pipe=True).pairs == list(range(4))


def test_what_is_not_supported_is_called_so() -> None:
    content = written(raws(range(4)), CompressionType.LZ4)
    with pytest.raises(StreamError, match=r"chunks packed with 'lzx', expected zstd, lz4 or none: other"):
        Read(content.replace(b"\x03\0\0\0lz4", b"\x03\0\0\0lzx"))
    for message, complaint in (
        (CameraCalibration(), "found foxglove.CameraCalibration as protobuf, which is not supported"),
        (
            RawImage(width=1, height=1, encoding="32FC1", step=4, data=bytes(4)),
            "'32FC1', which is not supported",
        ),
        (CompressedVideo(data=b"x", format="theora"), "format 'theora', which is not supported"),
    ):
        with pytest.raises(InputError, match=complaint):
            Read(written([(topic, message, at(0), at(0)) for topic in TOPICS]))


def test_several_files_are_one_recording() -> None:
    parts = [written(raws(numbers)) for numbers in (range(6), range(6, 12), range(12, 18))]
    read = Read(*parts)
    assert read.pairs == list(range(18))
    assert Read(parts[2], parts[0], parts[1]).pairs == list(range(18)), "by their time"
    assert Read(*parts, pipe=True).pairs == list(range(18))


def test_calibration_may_come_late() -> None:
    width, height = SIZE
    rig: list[Timed] = []
    for col, topic in enumerate(TOPICS):
        projection = [60.0, 0, 32, -60.0 * 0.2 * col, 0, 60.0, 24, 0, 0, 0, 1, 0]
        message = CameraCalibration(frame_id=f"frame of {topic}", width=width, height=height, P=projection)
        rig.append((f"{topic}/calibration", message, at(10), at(10)))
    read = Read(written([*raws(range(10)), *rig, *raws(range(10, 14))], chunk_bytes=40_000))
    assert read.recording.calibration_note == ""
    assert read.recording.array.calibration.baseline_m == pytest.approx(0.2)


@pytest.mark.parametrize(("encoding", "bits"), [("mono16", 16), ("mono16", 12), ("16UC1", 10)])
def test_deep_pixels_keep_their_levels(encoding: str, bits: int) -> None:
    width, height = SIZE
    top = (1 << bits) - 1
    messages: list[Timed] = []
    for number in range(3):
        for camera in (0, 1):
            values = np.round(numbered(number, camera)[..., 0] * (top / 235)).clip(0, top).astype("<u2")
            message = RawImage(
                width=width, height=height, encoding=encoding, step=2 * width, data=values.tobytes()
            )
            messages.append((TOPICS[camera], message, at(number), at(number)))
    read = Read(written(messages))
    expected = numbered(2, 1)[..., 0] * (255 / 235)
    assert np.abs(read.pictures[2][0, 1][..., 1] - expected.clip(0, 255)).max() <= 1.5
    assert ("taken as" in read.told) == (bits < 16)


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE])
def test_a_recording_that_is_cut_off_early_is_called_so(compression: CompressionType) -> None:
    """Its only chunk breaks off, at several places."""
    whole = written(raws(range(4)), compression)
    told = set()
    for size in (10, 60, 200, 1000, 2000):
        with pytest.raises(InputError) as error:
            Read(whole[:size])
        assert "cut off" in str(error.value), (size, error.value)
        told.add(error.value.found)
    assert f"no topic {min(TOPICS)} before it is cut off" in told


def test_an_unreadable_picture_costs_its_frame_set_where_that_is_wanted() -> None:
    messages = raws(range(8))
    messages[9][1].data = messages[9][1].data[:100]
    read = Read(written(messages), skip=True)
    assert read.pairs == [n for n in range(8) if n != 4]
    assert ["/cam1 at 1700000000.133 s" in str(error) for error in read.errors] == [True]
    with pytest.raises(InputError, match=r"/cam1 at 1700000000\.133 s: found 100 bytes"):
        Read(written(messages))


def test_damaged_access_units_are_told_and_nothing_builds_on_them() -> None:
    messages = videos(20)
    damaged = next(m for m in messages if m[0] == TOPICS[1] and m[2] == at(11))
    data = bytearray(damaged[1].data)
    data[30:50] = bytes(20)
    damaged[1].data = bytes(data)
    read = Read(written(messages), skip=True)
    assert read.pairs[:11] == list(range(11))
    assert read.pairs[-4:] == list(range(16, 20))
    for number, pictures in zip(read.pairs, read.pictures, strict=True):
        assert abs(pictures[0, 1].astype(int) - numbered(number, 1)).mean() < 8


def test_one_raw_picture_reads_as_it_was_taken() -> None:
    """What the tests above compare with can be told apart."""
    assert number_of(numbered(37)) == 37
    assert raw(3, 1).data != raw(4, 1).data


def stereo(number: int, first: int) -> RawImage:
    """Two cameras beside each other in one picture."""
    both = np.concatenate([numbered(number, first), numbered(number, first + 1)], axis=1)
    return RawImage(
        width=both.shape[1],
        height=both.shape[0],
        encoding="rgb8",
        step=3 * both.shape[1],
        data=both.tobytes(),
    )


def test_a_topic_may_hold_several_views_in_each_picture() -> None:
    data = written([(TOPICS[t], stereo(n, 2 * t), at(n), at(n)) for n in range(3) for t in (0, 1)])
    read = Read(data, split=(1, 2), real="all")
    assert (read.recording.array.cols, read.recording.array.width) == (4, SIZE[0])
    assert read.numbers == [[n] * 4 for n in range(3)]
    for n, pictures in enumerate(read.pictures):
        assert list(pictures) == [(0, col) for col in range(4)]
        for (_, col), picture in pictures.items():
            np.testing.assert_array_equal(picture, numbered(n, col))
    assert [list(pictures) for pictures in Read(data, split=(1, 2)).pictures] == [[(0, 0), (0, 3)]] * 3
    with pytest.raises(InputError, match="a width that 1 and a height that 7 divide"):
        Read(data, split=(7, 1))
    with pytest.raises(SettingError, match="split: found with depth_topics"):
        RecordingSettings((TOPICS,), split=(1, 2), depth_topics=(("/d", "/e"),))


def test_the_command_splits_topics(tmp_path: Path) -> None:
    (tmp_path / "rec.mcap").write_bytes(written([("/zed", stereo(n, 0), at(n), at(n)) for n in range(2)]))
    asked = ("encode", tmp_path / "rec.mcap", tmp_path / "out.mcap", "--topics", "/zed", "--split", "1x2")
    assert "1 topics of 1x2 views each, expected 2x2" in fails(2, *asked, "--grid", "2x2")
    succeeds(*asked, "--grid", "1x2", "--matcher", "sgbm")
    info = read_info(tmp_path / "out.mcap")
    assert (info.frames, info.header.array.real) == (2, ((0, 0), (0, 1)))

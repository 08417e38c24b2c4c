"""Gaps in time where the codec does not say whether pictures are missing: lost ones, or a pause."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
import pytest
from av.video.stream import VideoStream
from command_line import succeeds
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from odd_recordings import START_NS, TOPICS, Timed, at, written
from timed_videos import SIZE, number_of, numbered, write_video

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.capture.time_gaps import GapWatch, TimedPacket, behind_gaps
from mvcodec.capture.video_input import VideoView

VP9 = {"crf": "8", "b": "0", "cpu-used": "8", "deadline": "realtime", "lag-in-frames": "0"}
KINDS: dict[str, tuple[str, str, Mapping[str, str]]] = {
    "VP8": ("libvpx", "webm", {"crf": "4", "b": "4M"}),
    "VP9": ("libvpx-vp9", "webm", VP9),
    "MPEG-4": ("mpeg4", "mp4", {"q": "2"}),
    "MPEG-4 in AVI": ("mpeg4", "avi", {"q": "2"}),
    "WMV": ("wmv2", "asf", {"q": "2"}),
}


def coded(path: Path, library: str, times: Sequence[int], options: Mapping[str, str]) -> Path:
    """Numbered pictures at times of 1/30 s, keyframes every 8 pictures."""
    with av.open(str(path), "w") as out:
        stream = cast("VideoStream", out.add_stream(library, rate=30, options={"g": "8", **options}))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for number, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(numbered(number), format="rgb24")
            frame.pts, frame.time_base = time, Fraction(1, 30)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def without(source: Path, target: Path, lost: Callable[[int], bool]) -> Path:
    """A copy without some packets, numbered in coding order."""
    with av.open(str(source)) as old, av.open(str(target), "w") as new:
        stream = new.add_stream_from_template(old.streams.video[0])
        for number, packet in enumerate(p for p in old.demux(video=0) if p.size):
            if not lost(number):
                packet.stream = stream
                new.mux(packet)
    return target


def shown(view: VideoView) -> list[int]:
    return [number_of(picture) for picture in view.pictures(range(view.count))]


@pytest.mark.parametrize("kind", KINDS)
def test_what_follows_a_gap_is_left_out_up_to_the_next_keyframe(kind: str, tmp_path: Path) -> None:
    library, form, options = KINDS[kind]
    full = coded(tmp_path / f"full.{form}", library, range(24), options)
    assert shown(VideoView(full)) == list(range(24))
    path = without(full, tmp_path / f"lost.{form}", lambda number: number == 11)
    view = VideoView(path)
    assert shown(view) == [*range(11), *range(16, 24)]
    assert any(note.startswith("4 pictures are left out: after a gap in time") for note in view.notes)
    view = VideoView(path, "pause")
    assert view.count == 23
    assert view.notes == (), "the user knows better"


def test_a_picture_may_be_missing_anywhere_between_keyframes_where_they_are_reordered(tmp_path: Path) -> None:
    full = coded(tmp_path / "full.mkv", "mpeg4", range(24), {"q": "2", "bf": "2"})
    whole = list(VideoView(full).pictures(range(24)))
    for lost in range(9, 15):
        view = VideoView(without(full, tmp_path / "lost.mkv", lost.__eq__))
        pictures = list(view.pictures(range(view.count)))
        assert [number_of(picture) for picture in pictures[:6]] == list(range(6))
        for picture in pictures:
            number = number_of(picture)
            assert np.array_equal(picture, whole[number]), (number, "a ghost", lost)
        assert view.notes, lost


def test_pictures_that_stand_alone_lose_nothing_to_a_gap(tmp_path: Path) -> None:
    full = coded(tmp_path / "full.mkv", "ffv1", range(12), {"g": "1"})
    view = VideoView(without(full, tmp_path / "lost.mkv", lambda number: number == 5))
    assert shown(view) == [number for number in range(12) if number != 5]
    assert view.notes == ()


def test_a_variable_rate_is_no_loss_unless_the_user_says_so(tmp_path: Path) -> None:
    times = [0, 1, 2, 4, 5, 9, 10, 11, 14, 15, 17, 18, 19, 24, 25, 26, 28, 29, 31, 33]
    path = coded(tmp_path / "screen.webm", "libvpx-vp9", times, VP9)
    view = VideoView(path)
    assert shown(view) == list(range(20))
    assert any("are taken for those of a variable rate" in note for note in view.notes)
    assert VideoView(path, "lost").count < 20


def test_only_what_may_build_on_a_missing_picture_is_left_out() -> None:
    packets = [TimedPacket(10 * n, n % 8 == 0) for n in range(24)]
    assert behind_gaps(packets, False, None) == (set(), 0)
    kept = [packet for packet in packets if packet.time != 80]  # a keyframe is missing
    assert behind_gaps(kept, False, None)[0] == set(range(8, 15))
    kept = [packet for packet in packets if packet.time != 70]  # the last one before a keyframe
    assert behind_gaps(kept, False, None) == (set(), 0)


def watched(times: Sequence[int], gaps: Any = None) -> list[int]:
    watch = GapWatch(gaps)
    return [place for place, time in enumerate(times) if watch.push(time)]


def test_gaps_are_seen_as_pictures_come() -> None:
    steady = [10, 20, 30, 40, 50, 60, 70, 90, 100, 110, 120, 140, 150]
    assert watched(steady) == [7, 11]
    assert watched(steady, "pause") == []
    variable = [0, 10, 20, 30, 70, 90, 100, 160, 170, 230, 240]
    assert watched(variable) == [4], "the first one may be a loss"
    assert watched(variable, "lost")[0] == 4


def vp9_messages(lost: Sequence[int] = ()) -> list[Timed]:
    """Two cameras' VP9 with a keyframe every 8 pictures; the first one loses some."""
    found: list[Timed] = []
    contexts = []
    for _ in TOPICS:
        context = av.CodecContext.create("libvpx-vp9", "w")
        context.width, context.height, context.pix_fmt = *SIZE, "yuv420p"
        context.time_base, context.options = Fraction(1, 30), {"g": "8", **VP9}
        contexts.append(context)
    for number in range(24):
        for camera, context in enumerate(contexts):
            frame = av.VideoFrame.from_ndarray(numbered(number, camera), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, 30)
            (packet,) = context.encode(frame)
            if camera or number not in lost:
                message = CompressedVideo(data=bytes(packet), format="vp9")
                found.append((TOPICS[camera], message, at(number), at(number)))
    return found


@pytest.mark.parametrize("lost", [(), (11,), (11, 20)])
def test_lost_messages_of_vp9(lost: Sequence[int]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        content = BytesIO(written(vp9_messages(lost)))
        sets = list(Recording(content, "rec", RecordingSettings((TOPICS,))).frame_sets())
    missing = {n for first in lost for n in range(first, 8 * (first // 8 + 1))}
    taken = [round((item.time_ns - START_NS) * 30 / 1e9) for item in sets]
    assert taken == [number for number in range(24) if number not in missing]
    assert [number_of(item.pictures[0, 0]) for item in sets] == taken


def test_the_command_takes_gaps_for_pauses_where_it_is_told_so(tmp_path: Path) -> None:
    full = coded(tmp_path / "full.webm", "libvpx", range(24), KINDS["VP8"][2])
    paths = [without(full, tmp_path / f"{name}.webm", lambda number: number == 11) for name in "ab"]
    options = ("--grid", "1x2", "--preset", "ultrafast", "--disparity-range", "0,8", "--matcher", "sgbm")
    succeeds("encode", *paths, tmp_path / "out.mcap", *options)
    assert "19 frame" in succeeds("info", tmp_path / "out.mcap")
    succeeds("encode", *paths, tmp_path / "all.mcap", *options, "--gaps", "pause")
    assert "23 frame" in succeeds("info", tmp_path / "all.mcap")


def test_files_that_were_joined_go_on_in_time(tmp_path: Path) -> None:
    """`cat` of what a camera wrote in parts: the clock of each begins anew."""
    parts = [write_video(tmp_path / f"{n}.ts", range(n, n + 20), g="4") for n in (0, 20)]
    path = tmp_path / "both.ts"
    path.write_bytes(b"".join(part.read_bytes() for part in parts))
    view = VideoView(path)
    found = shown(view)
    assert found == sorted(found), "each part in its place"
    assert {*range(16), *range(20, 40)} <= set(found), "what lies at the joint may count as damaged"
    assert view.times_ns is not None
    assert all(a < b for a, b in zip(view.times_ns, view.times_ns[1:], strict=False))
    assert any("its clock was set back 1 times" in note for note in view.notes)


def test_what_the_container_calls_damaged_never_enters(tmp_path: Path) -> None:
    path = tmp_path / "lost.ts"
    coded(path, "libx264", range(24), {"crf": "4", "bf": "0"})
    data = path.read_bytes()
    packets = [data[place : place + 188] for place in range(0, len(data), 188)]
    video = [place for place, packet in enumerate(packets) if packet[1:3] in (b"\x01\x00", b"\x41\x00")]
    del packets[video[len(video) // 2] + 2]
    path.write_bytes(b"".join(packets))
    view = VideoView(path)
    found = shown(view)
    assert 12 <= len(found) < 24
    assert any("left out: damaged" in note for note in view.notes)

"""Video files whose pictures have no times of their own, or only in the order of packets; and broken ones."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import pytest
from av.video.stream import VideoStream
from timed_videos import SIZE, number_of, numbered, write_video

from mvcodec.capture import open_input
from mvcodec.capture.timing import Timing, rate_of_times
from mvcodec.errors import InputError


def raw_stream(path: Path, lost: Iterable[int] = (), options: Mapping[str, str] | None = None) -> Path:
    """30 pictures as bare H.264 with a keyframe every ten, without some units (by their place)."""
    context = av.CodecContext.create("libx264", "w")
    context.width, context.height, context.pix_fmt = *SIZE, "yuv420p"
    context.time_base, context.framerate = Fraction(1, 30), Fraction(30)
    defaults = {"crf": "16", "preset": "ultrafast", "g": "10", "bf": "0", "sc_threshold": "0"}
    context.options = defaults | {"x264-params": "repeat-headers=1"} | dict(options or {})
    frames: list[av.VideoFrame | None] = []
    for number in range(30):
        frame = av.VideoFrame.from_ndarray(numbered(number), format="rgb24")
        frame.pts, frame.time_base = number, context.time_base
        frames.append(frame)
    units = [bytes(packet) for frame in [*frames, None] for packet in context.encode(frame)]
    path.write_bytes(b"".join(unit for place, unit in enumerate(units) if place not in set(lost)))
    return path


def sets(*paths: Path) -> tuple[list[list[int]], list[int], list[str]]:
    """Numbers and times of the frame sets at 30 pictures a second, and what was told."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        source = open_input(list(paths), grid=(1, len(paths)), real="all", timing=Timing(fps=30))
        found = list(source.frame_sets())
    shown = [[number_of(picture) for picture in item.pictures.values()] for item in found]
    return shown, [item.time_ns for item in found], [str(warning.message) for warning in caught]


@pytest.mark.parametrize("bf", ["0", "2"])
def test_a_bare_stream_ends_where_pictures_are_missing(tmp_path: Path, bf: str) -> None:
    """Nothing says how many are missing, hence when the later ones were taken."""
    whole = raw_stream(tmp_path / "a.h264", options={"bf": bf})
    shown, _, told = sets(whole, raw_stream(tmp_path / "b.h264", lost=[14], options={"bf": bf}))
    end = 14 if bf == "0" else 10  # with B-pictures the whole group is uncertain
    assert shown == [[number, number] for number in range(end)]
    assert any("10 pictures are left out: how many pictures are missing before them" in text for text in told)


def test_what_a_bare_stream_has_before_its_first_keyframe_takes_its_time(tmp_path: Path) -> None:
    late = raw_stream(tmp_path / "late.h264", lost=[0])
    shown, times, _ = sets(late)
    assert shown == [[number] for number in range(10, 30)]
    assert times[0] == round(9e9 / 30), "nine pictures of the file come before"


def test_a_bare_stream_without_a_certain_picture_says_why(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no frames \(9 are left out: it builds on a picture that is missing"
    ):
        sets(raw_stream(tmp_path / "a.h264", lost=[5], options={"bf": "2"}))


@pytest.mark.parametrize("bf", ["0", "2"])
def test_avi_files_are_read_in_the_order_of_time(tmp_path: Path, bf: str) -> None:
    """AVI has no times, and FFmpeg's are those of coding."""
    shown, times, told = sets(write_video(tmp_path / "a.avi", range(20), bf=bf))
    assert shown == [[number] for number in range(20)]
    assert times == [round(number * 1e9 / 30) for number in range(20)]
    assert not told


def test_beside_a_gap_avi_files_with_b_pictures_are_uncertain(tmp_path: Path) -> None:
    kept = [number for number in range(30) if number != 15]
    with av.open(str(tmp_path / "a.avi"), "w") as out:
        options = {"crf": "16", "preset": "ultrafast", "bf": "2", "g": "10", "sc_threshold": "0"}
        stream = out.add_stream("libx264", rate=30, options=options)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 30)
        for number in kept:
            frame = av.VideoFrame.from_ndarray(numbered(number), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, 30)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    shown, times, told = sets(tmp_path / "a.avi")
    assert [number for (number,) in shown] == [round(time * 30 / 1e9) for time in times]
    assert len(shown) >= 15
    assert any("beside a gap" in text for text in told)


def test_a_picture_with_the_time_of_the_one_before_costs_itself_alone(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mkv", range(12), [round(n * 1000 / 30) for n in range(12)])
    with av.open(str(tmp_path / "a.mkv")) as source, av.open(str(tmp_path / "b.mkv"), "w") as out:
        stream = out.add_stream_from_template(source.streams.video[0])
        for number, packet in enumerate(source.demux(source.streams.video[0])):
            if packet.dts is not None:
                packet.pts = packet.dts = packet.dts - (33 if number == 7 else 0)
                packet.stream = stream
                out.mux(packet)
    shown, times, told = sets(tmp_path / "b.mkv")
    assert len(shown) == 11
    assert times[-1] == round(11e9 / 30)
    assert told == [
        f"{tmp_path / 'b.mkv'}: 1 pictures are left out: they have the time of the picture before"
    ]


def test_a_file_that_breaks_off_gives_what_is_whole(tmp_path: Path) -> None:
    with av.open(
        str(tmp_path / "a.mp4"), "w", container_options={"movflags": "frag_keyframe+empty_moov"}
    ) as out:
        stream = out.add_stream("libx264", rate=30, options={"crf": "16", "g": "10", "bf": "0"})
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for number in range(30):
            out.mux(stream.encode(av.VideoFrame.from_ndarray(numbered(number), format="rgb24")))
        out.mux(stream.encode())
    data = (tmp_path / "a.mp4").read_bytes()
    (tmp_path / "b.mp4").write_bytes(data[: len(data) * 7 // 10])
    shown, _, told = sets(tmp_path / "b.mp4")
    assert 10 <= len(shown) < 30
    assert shown == [[number] for number in range(len(shown))]
    assert any("damaged" in text or "breaks off" in text for text in told)


def test_a_rate_is_that_of_all_usual_steps() -> None:
    milliseconds = [round(number * 1000 / 30) * 1_000_000 for number in range(40)]
    assert rate_of_times(milliseconds) == 30.0
    assert rate_of_times([time + (60 * 10**9 if time > 5e8 else 0) for time in milliseconds]) == 30.0
    assert rate_of_times([5]) is None


@pytest.mark.parametrize(("codec", "unsure"), [("libvpx", True), ("libx264", False)])
def test_what_is_behind_a_gap_is_left_out_where_the_codec_does_not_tell_losses(
    codec: str, unsure: bool, tmp_path: Path
) -> None:
    with av.open(str(tmp_path / "a.mkv"), "w") as out:
        stream = cast("VideoStream", out.add_stream(codec, rate=30, options={"g": "10"}))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for number in (*range(5), *range(6, 12)):
            frame = av.VideoFrame.from_ndarray(numbered(number), format="rgb24")
            frame.pts = number
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    shown, _, told = sets(tmp_path / "a.mkv")
    assert len(shown) == (5 + 1 if unsure else 11)
    assert any("after a gap in time" in text for text in told) == unsure

"""Whole pictures or none: what builds on a missing picture never comes out of a video file."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
import pytest
from av.stream import Disposition
from av.video.reformatter import ColorRange, ColorTrc
from av.video.stream import VideoStream
from timed_videos import SIZE, number_of, numbered, write_video

from mvcodec.capture.video_input import VideoView
from mvcodec.errors import InputError
from mvcodec.frames import Picture
from mvcodec.stream import TrackKind
from mvcodec.video.codec import Planes, RateControl, VideoSettings
from mvcodec.video.codecs import CODECS as CODECS_OF_TRACKS

CODECS = {"h264": ("libx264", {}), "hevc": ("libx265", {"x265-params": "log-level=none:bframes=0:keyint=8"})}


def coded(path: Path, library: str, count: int, **options: str) -> Path:
    """A video of numbered pictures, keyframes every 8 pictures."""
    with av.open(str(path), "w") as out:
        settings = {"g": "8", "bf": "0", "preset": "ultrafast", "sc_threshold": "0"} | options
        stream = cast("VideoStream", out.add_stream(library, rate=30, options=settings))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for number in range(count):
            out.mux(stream.encode(av.VideoFrame.from_ndarray(numbered(number), format="rgb24")))
        out.mux(stream.encode())
    return path


def copied(source: Path, target: Path, keep: Callable[[int], bool], start: int = 0) -> Path:
    """A copy of a video without some of its packets, numbered in coding order."""
    with av.open(str(source)) as old, av.open(str(target), "w") as new:
        stream = new.add_stream_from_template(old.streams.video[0])
        for number, packet in enumerate(p for p in old.demux(video=0) if p.size):
            if keep(number) and number >= start:
                packet.stream = stream
                new.mux(packet)
    return target


def shown(view: VideoView) -> list[int]:
    return [number_of(picture) for picture in view.pictures(range(view.count))]


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("form", ["mkv", "mp4", "ts"])
def test_pictures_that_build_on_a_lost_packet_are_left_out(tmp_path: Path, codec: str, form: str) -> None:
    library, options = CODECS[codec]
    full = coded(tmp_path / f"full.{form}", library, 20, **options)
    assert shown(VideoView(full)) == list(range(20))
    view = VideoView(copied(full, tmp_path / f"lost.{form}", lambda number: number != 11))
    assert shown(view) == [*range(11), *range(16, 20)]
    assert view.notes == ("4 pictures are left out: it builds on a picture that is missing",)
    assert view.times_ns is not None
    assert view.times_ns[11] == pytest.approx(16e9 / 30, abs=1e6)


def test_av1_whose_pictures_are_coded_out_of_order_is_whole_up_to_a_lost_packet(tmp_path: Path) -> None:
    """Hidden pictures are usual in AV1: the numbers of those that are shown tell what is missing."""
    rate = RateControl(qp=20)
    settings = VideoSettings(TrackKind.TEXTURE, *SIZE, 30, 64, rate, "ultrafast", low_delay=False)
    encoder = CODECS_OF_TRACKS["av1"].encoder(settings)
    grey = np.full((SIZE[1] // 2, SIZE[0] // 2), 128, np.uint8)
    units = [unit for n in range(20) for unit in encoder.push(Planes(numbered(n)[..., 0], grey, grey))]
    units += encoder.flush()
    assert any(len(unit.data) < 8 for unit in units), "a picture that was coded before is shown"
    for lost, kept in ((None, 20), (11, 11)):
        path = tmp_path / f"lost_{lost}.mkv"
        with av.open(str(path), "w") as out:
            stream = out.add_mux_stream("av1", rate=30, width=SIZE[0], height=SIZE[1])
            for number, unit in enumerate(units):
                packet = av.Packet(unit.data)
                packet.stream, packet.time_base, packet.is_keyframe = stream, Fraction(1, 30), unit.keyframe
                packet.pts = packet.dts = number
                if number != lost:
                    out.mux(packet)
        view = VideoView(path)
        assert shown(view) == list(range(kept))
        assert bool(view.notes) == (lost is not None)


def test_b_pictures_cost_those_that_build_on_the_lost_one_alone(tmp_path: Path) -> None:
    """Nothing builds on an ordinary B-picture: without one, its own moment is missing."""
    full = coded(tmp_path / "full.mkv", "libx264", 16, bf="2", **{"x264-params": "b-pyramid=none:b-adapt=0"})
    with av.open(str(full)) as container:
        stamps = [packet.pts or 0 for packet in container.demux(video=0) if packet.size]
    disposable = next(i for i, stamp in enumerate(stamps) if i > 3 and stamp < max(stamps[:i]))
    lost = sorted(stamps).index(stamps[disposable])
    view = VideoView(copied(full, tmp_path / "lost.mkv", lambda number: number != disposable))
    assert shown(view) == [number for number in range(16) if number != lost]


def test_a_stream_joined_at_an_open_gop_begins_with_whole_pictures(tmp_path: Path) -> None:
    """A recovery point is no IDR picture; what is shown before it builds on what was never there."""
    options = {"x264-params": "open-gop=1:keyint=8:min-keyint=8:scenecut=0:b-adapt=0"}
    full = coded(tmp_path / "full.mkv", "libx264", 28, bf="3", **options)
    with av.open(str(full)) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size]
        keys = [index for index, packet in enumerate(packets) if packet.is_keyframe]
        order = sorted(packet.pts or 0 for packet in packets)
        entry = order.index(packets[keys[1]].pts or 0)
        assert any((packet.pts or 0) < order[entry] for packet in packets[keys[1] :]), "it leads"
    view = VideoView(copied(full, tmp_path / "joined.mkv", lambda _: True, start=keys[1] - 2))
    assert shown(view) == list(range(entry, 28))


def test_damage_inside_a_picture_is_told_and_costs_what_builds_on_it(tmp_path: Path) -> None:
    path = coded(tmp_path / "v.mkv", "libx264", 24)
    with av.open(str(path)) as container:
        place = [packet.pos or 0 for packet in container.demux(video=0) if packet.size][10]
    data = bytearray(path.read_bytes())
    data[place + 40 : place + 60] = bytes(range(200, 220))
    path.write_bytes(data)
    view, told = VideoView(path), list[InputError]()
    found = list(view.readable(range(24), told.append))
    whole = [number for number, picture in enumerate(found) if picture is not None]
    assert whole[:10] == list(range(10))
    assert 16 in whole, "the next keyframe heals it"
    assert 10 not in whole
    for number, picture in enumerate(found):
        if picture is not None:
            assert np.abs(picture.astype(int) - numbered(number)).mean() < 12, "no ghosts"
    assert len(told) == 24 - len(whole)
    assert "v.mkv: found no whole picture 10 at 0.333 s" in str(told[0])
    with pytest.raises(InputError, match=r"no whole picture 10 at 0\.333 s, the file is damaged there"):
        list(view.pictures(range(24)))


def written(path: Path, library: str, pix_fmt: str, picture: Picture, **tags: Any) -> VideoView:
    """A lossless file of one picture in a form of pixels."""
    with av.open(str(path), "w") as out:
        stream = cast("VideoStream", out.add_stream(library, rate=30))
        stream.width, stream.height, stream.pix_fmt = picture.shape[1], picture.shape[0], pix_fmt
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame = frame.reformat(
            format=pix_fmt, src_color_range=ColorRange.JPEG, dst_color_range=ColorRange.MPEG
        )
        for name, value in tags.items():
            setattr(frame, name, value)
        out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return VideoView(path)


_YUV = ["420p", "422p", "444p", "420p10le", "422p10le", "444p12le", "420p16le"]
FORMS = [*(f"yuv{form}" for form in _YUV), "gbrp10le", "bgr0"]


@pytest.mark.parametrize("pix_fmt", FORMS)
def test_every_form_of_pixels_keeps_its_levels(tmp_path: Path, pix_fmt: str) -> None:
    picture = np.full((48, 64, 3), (200, 120, 60), np.uint8)
    view = written(tmp_path / "v.mkv", "ffv1", pix_fmt, picture)
    (found,) = view.pictures(range(1))
    assert np.abs(found.astype(int) - picture).max() <= 2
    assert view.notes == ()


def test_what_pictures_lose_is_told(tmp_path: Path) -> None:
    picture = np.full((48, 64, 3), 90, np.uint8)
    for name, pix_fmt, tags, note in (
        ("alpha.mkv", "yuva420p", {}, "how opaque its pixels are is left out"),
        ("pq.mkv", "yuv420p10le", {"color_trc": ColorTrc.SMPTE2084}, "coded for HDR (PQ)"),
        ("hlg.mkv", "yuv420p10le", {"color_trc": ColorTrc.ARIB_STD_B67}, "coded for HDR (HLG)"),
    ):
        (found,) = written(tmp_path / name, "ffv1", pix_fmt, picture, **tags).notes
        assert note in found
    interlaced = coded(tmp_path / "i.mkv", "libx264", 3, flags="+ildct+ilme")
    (found,) = VideoView(interlaced).notes
    assert "interlaced" in found


def test_a_cover_picture_is_no_video(tmp_path: Path) -> None:
    video = write_video(tmp_path / "v.mp4", range(3))
    with av.open(str(video)) as old, av.open(str(tmp_path / "covered.mp4"), "w") as new:
        cover = new.add_stream("mjpeg", rate=1)
        cover.width, cover.height, cover.pix_fmt = 32, 32, "yuvj420p"
        cover.disposition = Disposition.attached_pic
        stream = new.add_stream_from_template(old.streams.video[0])
        new.mux(cover.encode(av.VideoFrame.from_ndarray(np.zeros((32, 32, 3), np.uint8), format="rgb24")))
        for packet in old.demux(video=0):
            if packet.size:
                packet.stream = stream
                new.mux(packet)
    view = VideoView(tmp_path / "covered.mp4")
    assert view.size == SIZE
    assert shown(view) == [0, 1, 2]

"""What `validate` says of wrong streams, codec by codec: size, profile, colour, range, order."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc
from broken_files import coded_sets, written
from small_arrays import photograph

from mvcodec.conformance.unit_rules import UnitRules
from mvcodec.conformance.validation import validate
from mvcodec.errors import StreamError
from mvcodec.stream import TrackKind
from mvcodec.video.bits import NalError
from mvcodec.video.codec import RateControl, VideoSettings
from mvcodec.video.codecs import CODECS
from mvcodec.video.reference_watch import ReferenceWatch
from mvcodec.workers import scheduling_kept

SIZE = (64, 48)
COUNT = 12
ENCODERS = {"h264": "libx264", "hevc": "libx265", "av1": "libsvtav1", "vp9": "libvpx-vp9"}
OTHER_PIXELS = {"h264": "yuv444p", "hevc": "yuv444p", "av1": "yuv420p10le", "vp9": "yuv444p"}


def _stream(
    name: str,
    pixels: str = "yuv420p",
    matrix: Colorspace = Colorspace.ITU709,
    colours: ColorPrimaries = ColorPrimaries.BT709,
    transfer: ColorTrc = ColorTrc.BT709,
    levels: ColorRange = ColorRange.MPEG,
    *,
    low_delay: bool = True,
) -> list[bytes]:
    """Access units of a moving picture, tagged as said."""
    settings = VideoSettings(TrackKind.TEXTURE, *SIZE, 10.0, COUNT, RateControl(qp=30), "medium", low_delay)
    context = cast("VideoCodecContext", VideoCodecContext.create(ENCODERS[name], "w"))
    context.width, context.height, context.pix_fmt = *SIZE, pixels
    context.framerate, context.thread_count = Fraction(10), 1
    context.colorspace, context.color_primaries, context.color_trc = matrix, colours, transfer
    context.color_range, context.options = levels, CODECS[name].options(settings)
    with scheduling_kept():
        context.open(strict=False)
    packets = []
    for number in range(COUNT):
        picture = photograph("coffee")[60 + number : 108 + number, 90 + 2 * number : 154 + 2 * number]
        frame = VideoFrame.from_ndarray(np.ascontiguousarray(picture), "rgb24").reformat(format=pixels)
        frame.pts = number
        packets += context.encode(frame)
    return [bytes(packet) for packet in [*packets, *context.encode(None)]]


def _codes(
    name: str,
    units: list[bytes],
    kind: TrackKind | None = TrackKind.TEXTURE,
    size: tuple[int, int] = SIZE,
) -> set[str]:
    rules = UnitRules(CODECS[name], kind, size)
    return {
        code
        for number, unit in enumerate(units)
        for code, _ in rules.push(unit, None if kind is None else number == 0, number)
    }


@pytest.fixture(params=CODECS)
def name(request: pytest.FixtureRequest) -> str:
    found: str = request.param
    return found


def test_a_plain_stream_is_clean(name: str) -> None:
    assert _codes(name, _stream(name)) == set()


def test_another_size_is_told_and_never_decoded(name: str) -> None:
    units = _stream(name)
    assert _codes(name, units, size=(9998, 9998)) == {"size"}
    with pytest.raises(StreamError, match="found a picture of 64x48, expected 9998x9998"):
        ReferenceWatch(CODECS[name], (9998, 9998)).push(units[0], "unit", 0)


def test_another_profile_is_told(name: str) -> None:
    assert _codes(name, _stream(name, OTHER_PIXELS[name])) == {"profile"}


def test_another_matrix_is_told(name: str) -> None:
    bt601 = _stream(
        name,
        matrix=Colorspace.SMPTE170M,
        colours=ColorPrimaries.SMPTE170M,
        transfer=ColorTrc.SMPTE170M,
    )
    assert _codes(name, bt601) == {"colour"}


def test_the_range_is_that_of_pictures_or_of_maps(name: str) -> None:
    limited, full = _stream(name), _stream(name, levels=ColorRange.JPEG)
    assert _codes(name, full) == {"colour"}
    assert _codes(name, limited, TrackKind.DISPARITY) == {"colour"}
    assert _codes(name, full, TrackKind.DISPARITY) == set()


def test_pictures_that_wait_for_later_ones_are_told(name: str) -> None:
    units = _stream(name, low_delay=False)
    if name == "vp9":  # libvpx makes hidden frames in its second pass only
        hidden = bytes([units[0][0] & ~2]) + units[0][1:]
        units = [_superframe(hidden, units[1]), *units[2:]]
    found = _codes(name, units)
    expected = {
        "h264": {"b-frames", "reorder"},
        "hevc": {"reorder"},
        "av1": {"hidden", "one-picture"},
        "vp9": {"hidden", "one-picture"},
    }
    assert expected[name] <= found


def _superframe(*frames: bytes) -> bytes:
    """Frames in one message, with their sizes behind them (VP9, annex B)."""
    marker = bytes([0b11001000 | len(frames) - 1])
    return b"".join(frames) + marker + b"".join(len(f).to_bytes(2, "little") for f in frames) + marker


def test_a_superframe_that_lies_about_its_sizes_is_damage() -> None:
    first, second = _stream("vp9")[:2]
    whole = _superframe(first, second)
    assert CODECS["vp9"].units().push(whole).pictures == 2
    for size in (0, len(whole)):
        lying = whole[:-5] + size.to_bytes(2, "little") + whole[-3:]
        with pytest.raises(NalError, match="sizes cannot be"):
            CODECS["vp9"].units().push(lying)


def test_without_a_header_size_profile_and_colour_are_free(name: str) -> None:
    units = _stream(name, OTHER_PIXELS[name], matrix=Colorspace.SMPTE170M, levels=ColorRange.JPEG)
    assert _codes(name, units, None, (0, 0)) == set()


def test_every_beginning_of_a_keyframe_is_damage_or_read(name: str) -> None:
    key = _stream(name)[0]
    for end in range(min(len(key), 120)):
        with suppress(NalError):
            assert CODECS[name].units().push(key[:end]).pictures <= 1


def test_a_file_whose_header_says_another_size_does_not_pass(name: str, tmp_path: Path) -> None:
    def enlarged() -> Iterator[list[object]]:
        for packets in coded_sets(5, codec=name):
            yield [
                replace(packet, data=_resized(packet.data)) if packet.track.camera is None else packet
                for packet in packets
            ]

    path = tmp_path / "x.mcap"
    path.write_bytes(written(list(enlarged())))  # type: ignore[arg-type]
    found = validate(path)
    assert {finding.code for finding in found} == {"size"}
    assert any("expected 9999x9999" in f.message or "expected 10000x10000" in f.message for f in found)


def _resized(header: bytes) -> bytes:
    document = json.loads(header)
    document["array"] |= {"width": 9999, "height": 9999}
    return json.dumps(document).encode()

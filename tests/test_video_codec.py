"""What every codec of the table must do, and what H.264 streams must look like to be played."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import cast

import av
import numpy as np
import pytest
from av.codec.context import Flags
from av.video.codeccontext import VideoCodecContext
from small_arrays import photograph

from mvcodec.errors import SettingError, StreamError
from mvcodec.stream import TrackKind
from mvcodec.video import annexb
from mvcodec.video.bits import BitReader
from mvcodec.video.codec import (
    PRESETS,
    Codec,
    CodedPicture,
    Planes,
    RateControl,
    VideoDecoder,
    VideoSettings,
)
from mvcodec.video.codecs import CODECS, find_codec
from mvcodec.video.colour import grey_planes, to_picture, to_planes
from mvcodec.video.disparity_code import dequantise, quantise

WIDTH, HEIGHT = 128, 96


def _settings(kind: TrackKind = TrackKind.TEXTURE, preset: str = "medium", **rate: float) -> VideoSettings:
    control = RateControl(**(rate or {"qp": 24}))  # type: ignore[arg-type]
    return VideoSettings(kind, WIDTH, HEIGHT, 10.0, 5, control, preset)


def _picture(number: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    left = 50 + 3 * number
    return photograph("coffee")[80 : 80 + HEIGHT, left : left + WIDTH]


def _coded(codec: Codec, settings: VideoSettings, count: int = 12) -> list[CodedPicture]:
    encoder = codec.encoder(settings)
    coded = []
    for number in range(count):
        out = encoder.push(to_planes(_picture(number)), keyframe=number % 5 == 0)
        assert len(out) == 1, "a picture waits for a later one"
        coded += out
    assert encoder.flush() == []
    return coded


@pytest.fixture(params=list(CODECS))
def codec(request: pytest.FixtureRequest) -> Codec:
    return CODECS[request.param]


@pytest.mark.parametrize("preset", PRESETS)
def test_one_picture_in_one_access_unit_out_and_back(codec: Codec, preset: str) -> None:
    decoder = codec.decoder()
    for number, picture in enumerate(_coded(codec, _settings(preset=preset), 7)):
        (planes,) = decoder.push(picture.data, "test")
        error = to_picture(planes, WIDTH, HEIGHT).astype(float) - _picture(number)
        assert math.sqrt(np.mean(error**2)) < 8, "not the picture that went in"
    assert decoder.flush() == []


def test_a_picture_that_is_looked_at_late_is_still_itself(codec: Codec) -> None:
    """Planes are copied when somebody looks: the decoder must not have drawn the next picture over them."""
    coded = _coded(codec, _settings(), 7)
    at_once, late = codec.decoder(), codec.decoder()
    expected = [np.concatenate([p.y.ravel(), p.u.ravel(), p.v.ravel()]) for p in _pushed(at_once, coded)]
    kept = list(_pushed(late, coded))
    for planes, values in zip(kept, expected, strict=True):
        assert planes.size == (WIDTH, HEIGHT)
        found = np.concatenate([planes.y.ravel(), planes.u.ravel(), planes.v.ravel()])
        np.testing.assert_array_equal(found, values)
        assert planes.y is planes.y, "copied once"


def _pushed(decoder: VideoDecoder, coded: list[CodedPicture]) -> Iterator[Planes]:
    for picture in coded:
        yield from decoder.push(picture.data, "test")


def test_keyframes_come_when_asked_and_decoding_can_start_at_each(codec: Codec) -> None:
    coded = _coded(codec, _settings())
    assert [number for number, picture in enumerate(coded) if picture.keyframe] == [0, 5, 10]
    from_start, from_key = codec.decoder(), codec.decoder()
    for number, picture in enumerate(coded):
        (expected,) = from_start.push(picture.data, "test")
        if number >= 5:
            (found,) = from_key.push(picture.data, "test")
            np.testing.assert_array_equal(found.y, expected.y)


def test_damage_is_an_error_that_names_the_packet(codec: Codec) -> None:
    coded = _coded(codec, _settings(), 3)
    damage = [b"no video at all" * 9]
    if codec not in (CODECS["hevc"], CODECS["vp9"]):  # whose decoders take a cut slice for a whole one
        damage.append(coded[1].data[: len(coded[1].data) // 2])
    for broken in damage:
        decoder = codec.decoder()
        decoder.push(coded[0].data, "key")
        with pytest.raises(StreamError, match=r"^/camera/r00_c00/video at 0\.1 s: found a damaged picture"):
            decoder.push(broken, "/camera/r00_c00/video at 0.1 s")
    with pytest.raises(StreamError):
        codec.decoder().push(coded[1].data, "without its keyframe")


def test_fewer_bits_at_higher_qp_and_crf(codec: Codec) -> None:
    sizes = [sum(len(c.data) for c in _coded(codec, _settings(qp=qp))) for qp in (1, 20, 40, codec.max_qp)]
    assert all(a > b for a, b in pairwise(sizes))
    sizes = [sum(len(c.data) for c in _coded(codec, _settings(crf=crf))) for crf in (15.0, 22.5, 30.0)]
    assert all(a > b for a, b in pairwise(sizes))


def test_bitrate_is_met(codec: Codec) -> None:
    # SVT-AV1's and libvpx's finest quantisers need less than 200 kbit/s here.
    rate = 60.0 if codec in (CODECS["av1"], CODECS["vp9"]) else 200.0
    coded = _coded(codec, _settings(bitrate_kbps=rate), 40)
    kbps = sum(len(picture.data) for picture in coded) * 8 / (40 / 10.0) / 1000
    assert 0.7 * rate < kbps < 1.3 * rate


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="the system has no scheduling policies")
def test_coding_leaves_the_process_its_scheduling(codec: Codec) -> None:
    before = os.sched_getscheduler(0)
    encoder = codec.encoder(_settings(qp=30))
    encoder.push(to_planes(_picture(0)), keyframe=True)
    # As root SVT-AV1 makes its threads and its caller real-time ones: nothing else would run beside them.
    tasks = Path("/proc/self/task")
    threads = [int(task.name) for task in tasks.iterdir()] if tasks.is_dir() else [0]
    assert {os.sched_getscheduler(thread) for thread in threads} == {before}


def test_h264_keyframes_are_idr_with_their_parameter_sets_and_one_slice() -> None:
    for picture in _coded(CODECS["h264"], _settings()):
        types = [annexb.nal_type(unit) for unit in annexb.nal_units(picture.data)]
        assert picture.data.startswith(b"\x00\x00\x00\x01") or picture.data.startswith(b"\x00\x00\x01")
        if picture.keyframe:
            assert types == [annexb.SPS, annexb.PPS, annexb.IDR_SLICE]
        else:
            assert types == [annexb.SLICE]


@pytest.mark.parametrize("qp", [1, 27, 51])
def test_h264_profile_is_one_that_players_know(qp: int) -> None:
    (sps,) = [
        u for u in annexb.nal_units(_coded(CODECS["h264"], _settings(qp=qp), 1)[0].data) if u[0] & 31 == 7
    ]
    assert sps[1] in (66, 77, 100), "not Baseline, Main or High"


@pytest.mark.parametrize(("kind", "colour_range"), [(TrackKind.TEXTURE, 1), (TrackKind.DISPARITY, 2)])
def test_streams_tag_matrix_and_range(codec: Codec, kind: TrackKind, colour_range: int) -> None:
    context = cast("VideoCodecContext", VideoCodecContext.create(codec.library, "r"))
    context.thread_count = 1
    context.flags |= Flags.low_delay
    (frame,) = context.decode(av.Packet(_coded(codec, _settings(kind), 1)[0].data))
    assert (frame.colorspace, frame.color_range) == (1, colour_range)
    # VP9 has one number for primaries, transfer and matrix, of which FFmpeg reads the matrix.
    points = (2, 2) if codec is CODECS["vp9"] else (1, 1)
    assert (context.color_primaries, context.color_trc) == points
    assert not context.has_b_frames


def test_maps_keep_their_codes_within_the_quantiser(codec: Codec) -> None:
    codes = np.tile(np.arange(0, 256, 2, dtype=np.uint8), (HEIGHT, 1))
    encoder, decoder = codec.encoder(_settings(TrackKind.DISPARITY, qp=10)), codec.decoder()
    (coded,) = encoder.push(grey_planes(codes), True)
    (planes,) = decoder.push(coded.data, "test")
    assert np.abs(planes.y.astype(int) - codes).max() <= 3, "maps must not pass through a range conversion"
    assert np.all(planes.u == 128)
    assert np.all(planes.v == 128)


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        ({"qp": 0}, r"qp: found 0, expected 1\.\.63 \(0 is lossless"),
        ({"qp": 64}, r"qp: found 64, expected a whole number, 1\.\.63"),
        ({"crf": 0.0}, r"crf: found 0\.0, expected 1\.\.63"),
        ({"bitrate_kbps": -5.0}, r"bitrate_kbps: found -5\.0"),
        ({}, r"found none of them, expected exactly one"),
        ({"qp": 20, "crf": 20.0}, r"found qp and crf, expected exactly one"),
    ],
)
def test_bad_rates_are_refused(rate: dict[str, float], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        RateControl(**rate)  # type: ignore[arg-type]


def test_each_codec_keeps_to_its_own_scale(codec: Codec) -> None:
    top = codec.max_qp
    codec.encoder(_settings(qp=top))
    with pytest.raises(SettingError, match=rf"expected a whole number, 1\.\.{top}"):
        codec.encoder(_settings(qp=top + 1))
    with pytest.raises(SettingError, match=rf"expected 1\.\.{top}"):
        codec.encoder(_settings(crf=top + 0.5))


@pytest.mark.parametrize("size", [(2, 2), (34, 18), (32, 32), (1920, 16)])
def test_a_size_is_coded_or_refused_in_one_line(codec: Codec, size: tuple[int, int]) -> None:
    width, height = size
    settings = VideoSettings(TrackKind.TEXTURE, width, height, 10.0, 5, RateControl(qp=20), "medium")
    rng = np.random.default_rng(1)
    planes = grey_planes(rng.integers(100, 120, (height, width), np.uint8))
    encoder = codec.encoder(settings)
    if (width, height) == (2, 2) and codec in (CODECS["hevc"], CODECS["av1"]):
        with pytest.raises(SettingError, match=f"which refuses {width}x{height}"):
            encoder.push(planes, True)
        return
    (coded,) = encoder.push(planes, True)
    (found,) = codec.decoder().push(coded.data, "test")
    assert found.y.shape == (height, width)
    assert np.abs(found.y.astype(int) - planes.y).mean() < 8


def test_pictures_out_of_order_come_back_in_order(codec: Codec) -> None:
    settings = replace(_settings(), gop=20, low_delay=False)
    encoder, decoder = codec.encoder(settings), codec.decoder(low_delay=False)
    coded = []
    for number in range(20):
        coded += encoder.push(to_planes(_picture(number)), keyframe=number == 0)
    assert len(coded) < 20, "no look-ahead"
    coded += encoder.flush()
    assert [picture.keyframe for picture in coded] == [True] + [False] * 19
    planes = [plane for picture in coded for plane in decoder.push(picture.data, "test")] + decoder.flush()
    assert len(planes) == 20
    for number, plane in enumerate(planes):
        error = to_picture(plane, WIDTH, HEIGHT).astype(float) - _picture(number)
        assert math.sqrt(np.mean(error**2)) < 8


def test_hevc_keyframes_carry_their_parameter_sets_and_no_text() -> None:
    for picture in _coded(CODECS["hevc"], _settings()):
        types = [unit[0] >> 1 & 63 for unit in annexb.nal_units(picture.data)]
        assert types in ([[32, 33, 34, 19], [32, 33, 34, 20]] if picture.keyframe else [[1]])


def test_av1_keyframes_carry_a_sequence_header() -> None:
    delimiter, sequence_header, frame = 2, 1, 6
    for picture in _coded(CODECS["av1"], _settings()):
        expected = [delimiter, sequence_header, frame] if picture.keyframe else [delimiter, frame]
        assert _obu_types(picture.data) == expected


def _obu_types(data: bytes) -> list[int]:
    """obu_type of each unit of a temporal unit in the low-overhead format (AV1, section 5.3)."""
    types, at = [], 0
    while at < len(data):
        assert data[at] & 2, "an OBU without its size"
        types.append(data[at] >> 3 & 15)
        size, shift, more = 0, 0, True
        while more:
            at += 1
            size, shift, more = size | (data[at] & 127) << shift, shift + 7, bool(data[at] & 128)
        at += 1 + size
    return types


def test_unknown_names_are_refused_with_the_choices() -> None:
    with pytest.raises(SettingError, match=r"preset: found turbo, expected ultrafast, .*placebo"):
        _settings(preset="turbo")
    with pytest.raises(SettingError, match=r"codec: found vp8, expected one of h264"):
        find_codec("vp8")


def test_user_data_is_taken_out_and_the_rest_left_alone() -> None:
    start, sps, idr = b"\x00\x00\x00\x01", b"\x67\x64\x01", b"\x65\x88\x00\x00\x03\x01\x80"
    about, timing = b"\x06\x05\x03abc\x80", b"\x06\x01\x01\x10\x80"
    assert (
        annexb.without_user_data(start + sps + start + about + start[1:] + idr) == start + sps + start + idr
    )
    untouched = start[1:] + timing + start + idr
    assert annexb.without_user_data(untouched) == untouched


def test_disparity_codes_are_linear_with_255_nearest() -> None:
    values = np.array([[-4.0, 12.0, 4.0, -100.0, 100.0]], np.float32)
    codes = quantise(values, (-4.0, 12.0))
    np.testing.assert_array_equal(codes, [[0, 255, 128, 0, 255]])
    back = dequantise(codes, (-4.0, 12.0))
    np.testing.assert_allclose(back.values_px[0, :3], values[0, :3], atol=16 / 255 / 2 + 1e-6)
    assert back.values_px.dtype == np.float32
    assert back.valid.all()


def test_every_code_survives_the_way_there_and_back() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16)
    for range_px in ((-25.3, 20.1), (0.0, 0.5), (7.0, 1023.0)):
        np.testing.assert_array_equal(quantise(dequantise(codes, range_px).values_px, range_px), codes)


@pytest.mark.parametrize("preset", ["ultrafast", "fast", "medium"])
def test_vp9_codes_every_picture_with_the_quantiser_that_was_asked_for(preset: str) -> None:
    for qp, index in ((1, 4), (27, 108), (63, 255)):
        coded = _coded(CODECS["vp9"], _settings(qp=qp, preset=preset), 7)
        assert {_base_q_idx(picture.data) for picture in coded} == {index}


def _base_q_idx(frame: bytes) -> int:
    """From a frame of profile 0 (VP9, section 6.2) that libvpx coded without delay."""
    bits = BitReader(frame[:64])
    assert bits.u(5) == 0b10000
    key, shown, resilient = not bits.flag(), bits.flag(), bits.flag()
    assert shown
    if key:
        bits.u(24 + 4 + 32)
        assert not bits.flag(), "a render size"
    else:
        bits.u((not resilient) * 2 + 8 + 12)
        assert bits.flag(), "no size of the first reference"
        assert not bits.flag(), "a render size"
        bits.flag()
        bits.u(2 * (not bits.flag()))  # interpolation filter
    bits.u(2 * (not resilient) + 2 + 6 + 3)
    if bits.flag() and bits.flag():  # loop filter deltas
        for _ in range(6):
            bits.u(7 * bits.flag())
    return bits.u(8)

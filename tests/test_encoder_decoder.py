"""The whole codec: frame sets in, packets, decoded sets out."""

from __future__ import annotations

import io
import json
import os
import threading
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import pytest
from coding import (
    RANGE_PX,
    Pipe,
    RampMatcher,
    config,
    encode,
    encoded_file,
    frame_set,
    luma_psnr,
    make_array,
    ramp,
)

from mvcodec.array import CameraArray, Position
from mvcodec.container import McapReader, McapWriter, read_info
from mvcodec.decoder import Decoder
from mvcodec.encoder import Encoder, EncoderConfig, default_gop
from mvcodec.errors import InputError, MvCodecWarning, SettingError, StreamClosed, StreamError
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track, TrackKind
from mvcodec.video.disparity_rate import default_disparity_qp
from mvcodec.video.table import find_codec

ARRAY = make_array()


@pytest.fixture(scope="module")
def file() -> bytes:
    """14 frame sets, keyframes at 0, 4, 8 and 12, first index 30."""
    return encoded_file(ARRAY, 14, first=30, gop=4)


def _decoded(content: bytes, frames: slice | None = None) -> list[DecodedSet]:
    with Decoder.open(io.BytesIO(content), frames) as decoder:
        return list(decoder)


def _assert_equal(found: DecodedSet, expected: DecodedSet) -> None:
    assert (found.index, found.time_ns) == (expected.index, expected.time_ns)
    for camera in expected.array.real:
        np.testing.assert_array_equal(found.pictures[camera], expected.pictures[camera])
        np.testing.assert_array_equal(
            found.disparities[camera].values_px, expected.disparities[camera].values_px
        )


@pytest.mark.parametrize(
    ("width", "height", "rows", "cols"), [(96, 64, 2, 2), (33, 17, 2, 1), (35, 50, 1, 3), (16, 16, 1, 2)]
)
def test_round_trip(width: int, height: int, rows: int, cols: int) -> None:
    array = make_array(width, height, rows=rows, cols=cols)
    decoded = _decoded(encoded_file(array, 5, qp=8, disparity_qp=4))
    assert [found.index for found in decoded] == list(range(5))
    for found in decoded:
        original = frame_set(array, found.index)
        assert found.array == array
        assert found.time_ns == original.time_ns
        assert found.disparity_range_px == RANGE_PX
        for camera in array.real:
            assert found.pictures[camera].shape == (height, width, 3)
            assert luma_psnr(found.pictures[camera], original.pictures[camera]) > 44
            disparity = found.disparities[camera]
            assert disparity.valid.all()
            assert disparity.values_px.dtype == np.float32
            error_px = np.abs(disparity.values_px - ramp(array, camera))
            assert error_px.mean() < 0.1
            assert error_px.max() < 0.5


@pytest.mark.parametrize(
    ("width", "height", "rows", "cols"),
    [(96, 64, 2, 2), (33, 17, 2, 1), (35, 50, 1, 3), (16, 16, 1, 2), (1, 1, 1, 2)],
)
def test_maps_of_half_size_come_back_whole(width: int, height: int, rows: int, cols: int) -> None:
    array = make_array(width, height, rows=rows, cols=cols)
    file = encoded_file(array, 5, qp=8, disparity_qp=4, disparity_scale=2)
    with Decoder.open(io.BytesIO(file)) as decoder:
        assert decoder.header.disparity_scale == 2
        decoded = list(decoder)
    assert len(decoded) == 5
    for found in decoded:
        for camera in array.real:
            disparity = found.disparities[camera]
            assert disparity.values_px.shape == disparity.valid.shape == (height, width)
            error_px = np.abs(disparity.values_px - ramp(array, camera))
            # The second nearest of four stands a quarter of a ramp's step beside their middle.
            step_px = (RANGE_PX[1] - RANGE_PX[0]) / max(width - 1, 1)
            assert width == 1 or error_px.mean() < 0.1 + step_px / 2
    _assert_equal(_decoded(file, slice(3, 4))[0], decoded[3])


def test_stock_decoders_see_the_maps_at_half_size() -> None:
    sizes = set()
    for packet in encode(make_array(70, 66), 1, disparity_scale=2)[0]:
        if packet.track.kind is TrackKind.DISPARITY:
            (planes,) = find_codec("h264").decoder().push(packet.data, "a map")
            sizes.add(planes.y.shape)
    assert sizes == {(34, 36)}


def test_cameras_without_their_map_of_half_size_are_made_from_the_others() -> None:
    packets = encode(ARRAY, 2, qp=40, disparity_cameras="all")
    assert StreamHeader.from_json(packets[0][0].data).disparity_scale == 2
    lost = Track(TrackKind.DISPARITY, ARRAY.real[1])
    with Decoder() as decoder, pytest.warns(MvCodecWarning, match="go on without camera"):
        found = [
            decoded
            for packet in (*packets[0], *packets[1])
            if packet.track != lost
            for decoded in decoder.push(packet)
        ] + decoder.flush()
    assert [decoded.absent for decoded in found] == [(ARRAY.real[1],)] * 2
    assert found[0].disparities[ARRAY.real[1]].values_px.shape == (ARRAY.height, ARRAY.width)


def test_headers_without_a_scale_have_maps_of_full_size() -> None:
    document = json.loads(encode(ARRAY, 1, disparity_scale=2)[0][0].data)
    del document["disparity_scale"]
    assert StreamHeader.from_json(json.dumps(document).encode()).disparity_scale == 1
    document["disparity_scale"] = 3
    with pytest.raises(StreamError, match="disparity_scale: found 3, expected 1 or 2"):
        StreamHeader.from_json(json.dumps(document).encode())


def test_each_push_returns_its_own_packets_at_once() -> None:
    coded = encode(ARRAY, 12, gop=5)
    for number, packets in enumerate(coded):
        assert {packet.index for packet in packets} == {number}
        assert {packet.keyframe for packet in packets} == {number % 5 == 0}
        kinds = [packet.track.kind for packet in packets]
        head = [TrackKind.HEADER] if number % 5 == 0 else []
        assert kinds == head + [TrackKind.TEXTURE] * 4 + [TrackKind.DISPARITY] * 4
    header = StreamHeader.from_json(coded[5][0].data)
    assert header.array == ARRAY
    assert header.first_frame == 0
    expected = {"qp": 20, "disparity_qp": 25, "gop": 5, "preset": "veryfast", "matcher": "RampMatcher"}
    assert expected.items() <= header.settings.items()


@pytest.mark.parametrize("frames", [slice(5, 7), slice(13, None), slice(None, 3), slice(-6, -1), slice(4, 5)])
def test_a_range_decodes_to_the_same_pictures(file: bytes, frames: slice) -> None:
    everything = _decoded(file)
    expected = everything[frames]
    found = _decoded(file, frames)
    assert len(found) == len(expected)
    for a, b in zip(found, expected, strict=True):
        _assert_equal(a, b)


def test_a_pipe_decodes_to_the_same_pictures(file: bytes) -> None:
    with Decoder.open(_pipe(file), slice(6, 9)) as decoder:
        found = list(decoder)
    for a, b in zip(found, _decoded(file)[6:9], strict=True):
        _assert_equal(a, b)


def test_an_operating_system_pipe_works_both_ways() -> None:
    reading, writing = os.pipe()

    def produce() -> None:
        with os.fdopen(writing, "wb") as pipe, McapWriter(pipe) as writer:
            for packets in encode(ARRAY, 6, gop=3):
                writer.push(packets)

    thread = threading.Thread(target=produce)
    thread.start()
    with os.fdopen(reading, "rb") as pipe, Decoder.open(pipe) as decoder:
        indexes = [found.index for found in decoder]
    thread.join()
    assert indexes == list(range(6))


def test_a_decoder_can_be_gone_through_twice(file: bytes) -> None:
    with Decoder.open(io.BytesIO(file), slice(3, 5)) as decoder:
        first, second = list(decoder), list(decoder)
    for a, b in zip(first, second, strict=True):
        _assert_equal(a, b)


def test_a_late_joiner_starts_at_the_next_keyframe() -> None:
    decoder = Decoder()
    with pytest.raises(StreamError, match="no header yet"):
        _ = decoder.header
    coded = encode(ARRAY, 10, gop=4)
    late = [packet for packets in coded[2:] for packet in packets]
    indexes = [found.index for packet in late for found in decoder.push(packet)]
    assert indexes == [4, 5, 6, 7, 8, 9]
    assert decoder.header.array == ARRAY


def _pipe(content: bytes) -> BinaryIO:
    return cast("BinaryIO", Pipe(content))


def test_a_cut_file_decodes_up_to_the_cut(file: bytes) -> None:
    with Decoder.open(_pipe(file[: len(file) * 2 // 3])) as decoder, pytest.warns(MvCodecWarning) as caught:
        indexes = [found.index for found in decoder]
    assert indexes in (list(range(30, 38)), list(range(30, 42)))
    assert f"cut off after {indexes[-1] / 10:.3f} s" in str(caught[0].message)


def test_frames_beyond_a_pipes_end_are_an_error(file: bytes) -> None:
    with (
        Decoder.open(_pipe(file), slice(20, None)) as decoder,
        pytest.raises(SettingError, match="14 frame sets"),
    ):
        list(decoder)


def _pushed(packets: Iterable[Packet]) -> list[DecodedSet]:
    with Decoder() as decoder:
        return [found for packet in packets for found in decoder.push(packet)]


def _broken(coded: list[list[Packet]], number: int, place: int, data: bytes) -> list[Packet]:
    packets = [packet for of_one_time in coded[:number] for packet in of_one_time]
    of_one_time = list(coded[number])
    of_one_time[place] = replace(of_one_time[place], data=data)
    return packets + of_one_time


def test_damage_names_topic_and_time() -> None:
    coded = encode(ARRAY, 3)
    half = coded[2][5].data[: len(coded[2][5].data) // 2]
    for data in (half, b"", b"noise" * 20):
        with pytest.raises(StreamError, match=r"stream: /camera/r00_c01/disparity at 0\.200 s: found"):
            _pushed(_broken(coded, 2, 5, data))


def test_a_picture_of_another_size_is_an_error() -> None:
    other = encode(make_array(64, 64), 1)[0][1].data
    with pytest.raises(StreamError, match="a picture of 64x64, expected 96x64"):
        _pushed(_broken(encode(ARRAY, 1), 0, 1, other))


def test_an_unknown_codec_is_named() -> None:
    header = StreamHeader(ARRAY, RANGE_PX, codec="vp9")
    with pytest.raises(StreamError, match="found codec vp9, expected h264"):
        _pushed([Packet(HEADER_TRACK, 0, 0, True, header.to_json())])


def test_nothing_is_taken_after_flush() -> None:
    encoder = Encoder(ARRAY, config())
    packets = encoder.push(frame_set(ARRAY, 0))
    assert encoder.flush() == []
    assert encoder.flush() == []
    with pytest.raises(StreamClosed):
        encoder.push(frame_set(ARRAY, 1))
    decoder = Decoder()
    assert decoder.flush() == []
    with pytest.raises(StreamClosed):
        decoder.push(packets[0])


def test_frame_sets_that_do_not_fit_are_refused() -> None:
    good = frame_set(ARRAY, 3)
    without = {camera: picture for camera, picture in good.pictures.items() if camera != (1, 0)}
    small = {**good.pictures, (0, 1): good.pictures[0, 1][:50]}
    real: Any = good.pictures[0, 0].astype(np.float32)
    grey = {**good.pictures, (0, 0): real}
    with Encoder(ARRAY, config()) as encoder:
        for pictures, message in (
            (without, "frame 3, view r01_c00: found no picture"),
            (
                small,
                r"view r00_c01: found a picture of shape \(50, 96, 3\), uint8, expected uint8 RGB, 96x64",
            ),
            (grey, r"frame 3, view r00_c00: found a picture of shape \(64, 96, 3\), float32"),
        ):
            with pytest.raises(InputError, match=message):
                encoder.push(replace(good, pictures=pictures))
        assert len(encoder.push(good)) == 9, "a refused frame set must leave no trace"
        with pytest.raises(InputError, match="frame 3: found time 300000000 ns after frame 3"):
            encoder.push(good)
        with pytest.raises(InputError, match="in order of time"):
            encoder.push(FrameSet(4, 5, good.pictures))


class _BadMatcher:
    def __init__(self, shape: tuple[int, int] | None) -> None:
        self._shape = shape

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        maps = RampMatcher().match(array, pictures, range_px)
        del maps[1, 1]
        if self._shape is not None:
            maps[1, 1] = DisparityMap(np.zeros(self._shape, np.float32), np.ones(self._shape, np.bool_))
        return maps


def test_after_a_failed_frame_set_the_stream_goes_on_with_a_keyframe() -> None:
    class Moody(RampMatcher):
        fails = False

        def match(
            self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> dict[Position, DisparityMap]:
            if self.fails:
                raise RuntimeError("not today")
            return super().match(array, pictures, range_px)

    matcher = Moody()
    with Encoder(ARRAY, config(matcher=matcher)) as encoder:
        packets = encoder.push(frame_set(ARRAY, 0))
        matcher.fails = True
        with pytest.raises(RuntimeError, match="not today"):
            encoder.push(frame_set(ARRAY, 1))
        matcher.fails = False
        for index in (2, 3):
            packets += encoder.push(frame_set(ARRAY, index))
    assert [packet.index for packet in packets if packet.track == HEADER_TRACK] == [0, 2]
    for found in _pushed(packets):
        for camera, original in frame_set(ARRAY, found.index).pictures.items():
            assert luma_psnr(found.pictures[camera], original) > 36


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (None, r"_BadMatcher\.match, view r01_c01: found no map"),
        ((64, 95), r"_BadMatcher\.match, view r01_c01: found a map of shape \(64, 95\), expected \(64, 96\)"),
    ],
)
def test_a_plugin_matcher_that_errs_is_named(shape: tuple[int, int] | None, message: str) -> None:
    with (
        Encoder(ARRAY, config(matcher=_BadMatcher(shape))) as encoder,
        pytest.raises(InputError, match=message),
    ):
        encoder.push(frame_set(ARRAY, 0))


def test_a_map_that_is_not_finite_is_named() -> None:
    class Nan(RampMatcher):
        def match(
            self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> dict[Position, DisparityMap]:
            maps = super().match(array, pictures, range_px)
            maps[0, 0].values_px[5, 5] = np.nan
            return maps

    with Encoder(ARRAY, config(matcher=Nan())) as encoder, pytest.raises(InputError, match="finite"):
        encoder.push(frame_set(ARRAY, 0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"qp": 0}, r"qp: found 0, expected 1\.\.51"),
        ({"disparity_scale": 3}, "disparity_scale: found 3, expected 1 or 2"),
        ({"disparity_median": 4}, "disparity_median: found 4, expected 0"),
        ({"disparity_qp": 60}, r"disparity_qp: found 60, expected an integer, 1\.\.51"),
        ({"gop": 0}, r"gop: found 0, expected at least 1"),
        ({"crf": 20.0}, r"found qp and crf, expected exactly one"),
        ({"qp": None}, r"found none of them"),
        ({"disparity_range_px": (3.0, 3.0)}, r"disparity_range_px: found \[3\.0, 3\.0\], expected lo < hi"),
        ({"preset": "warp"}, r"preset: found warp, expected ultrafast"),
    ],
)
def test_bad_settings_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        config(**changes)


def test_a_gop_of_more_than_a_second_is_refused() -> None:
    with pytest.raises(
        SettingError, match=r"gop: found 11, expected 1\.\.10 \(a keyframe each second at 10 fps\)"
    ):
        Encoder(ARRAY, config(gop=11))
    with pytest.raises(SettingError, match="matcher: found nonesuch"):
        Encoder(ARRAY, config(matcher="nonesuch"))


@pytest.mark.parametrize(
    ("fps", "gop"), [(15.0, 15), (29.97, 29), (30000 / 1001, 29), (0.5, 1), (59.94, 59), (1.0, 1)]
)
def test_default_gop_is_a_second_at_most(fps: float, gop: int) -> None:
    assert default_gop(fps) == gop


def test_maps_follow_the_pictures_quantiser() -> None:
    def map_qp(**changes: object) -> int | None:
        return config(**changes).rate_of_maps(ARRAY, RANGE_PX).qp

    assert map_qp(qp=20) == default_disparity_qp(20, 1, "all", RANGE_PX)
    assert map_qp(qp=None, crf=40.0) == map_qp(qp=40) == default_disparity_qp(40, 2, "alternate", RANGE_PX)
    assert map_qp(qp=40, disparity_scale=1) == default_disparity_qp(40, 1, "alternate", RANGE_PX)
    assert map_qp(disparity_qp=44) == 44


def test_bit_rate_is_that_of_all_tracks_together() -> None:
    kbps = 800.0
    info = read_info(io.BytesIO(encoded_file(ARRAY, 40, qp=None, bitrate_kbps=kbps)))
    assert 0.6 * kbps < info.bits.total / 4 / 1000 < 1.3 * kbps


def test_coding_is_repeatable() -> None:
    assert encode(ARRAY, 6) == encode(ARRAY, 6)


def test_only_real_cameras_are_coded(tmp_path: Path) -> None:
    dense = make_array(rows=3, cols=3)
    sparse = replace(dense, real_rows=(0, 2), real_cols=(0, 2))
    path = tmp_path / "sparse.mcap"
    with Encoder(sparse, config()) as encoder, McapWriter(path) as writer:
        writer.push(encoder.push(frame_set(dense, 0)))
    with McapReader.open(path) as reader:
        assert reader.header.array.real == ((0, 0), (0, 2), (2, 0), (2, 2))
    with Decoder.open(path) as decoder:
        (found,) = decoder
    assert set(found.pictures) == set(found.disparities) == set(sparse.real)


def test_the_default_matcher_and_range_work() -> None:
    array = replace(make_array(), disparity_per_step_px=(1.0, 9.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MvCodecWarning)
        with Encoder(array, EncoderConfig(preset="veryfast")) as encoder, Decoder() as decoder:
            assert encoder.header is None
            sets = [found for packet in encoder.push(frame_set(array, 0)) for found in decoder.push(packet)]
    (found,) = sets
    # the photograph moves by 5 px from camera to camera
    assert abs(float(np.median(found.disparities[0, 0].values_px)) - 5) < 0.5

"""The whole codec: frame sets in, packets, decoded sets out; ranges, pipes, cuts and damage."""

from __future__ import annotations

import io
import json
import os
import threading
import warnings
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
import pytest
from coding import (
    RANGE_PX,
    Pipe,
    config,
    encode,
    encoded_file,
    frame_set,
    luma_psnr,
    make_array,
    pushed,
    ramp,
)

from mvcodec.container import McapReader, McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.errors import MvCodecWarning, SettingError, StreamClosed, StreamError
from mvcodec.frames import DecodedSet
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track, TrackKind
from mvcodec.video.codecs import find_codec

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
    with pytest.raises(StreamError, match=r"disparity_scale = 3, expected a whole number 1\.\.2"):
        StreamHeader.from_json(json.dumps(document).encode())


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
            pushed(_broken(coded, 2, 5, data))


def test_a_picture_of_another_size_is_an_error() -> None:
    other = encode(make_array(64, 64), 1)[0][1].data
    with pytest.raises(StreamError, match="a picture of 64x64, expected 96x64"):
        pushed(_broken(encode(ARRAY, 1), 0, 1, other))


def test_an_unknown_codec_is_named() -> None:
    header = StreamHeader(ARRAY, RANGE_PX, codec="vp8")
    with pytest.raises(StreamError, match="found codec vp8, expected one of h264"):
        pushed([Packet(HEADER_TRACK, 0, 0, True, header.to_json())])


def test_depth_and_unknown_cameras_are_ignored_by_a_decoder() -> None:
    with_depth = [packet for packets in encode(ARRAY, 3, depth=True) for packet in packets]
    kinds = [packet.track.kind for packet in with_depth]
    assert TrackKind.DEPTH in kinds
    stray = replace(with_depth[1], track=Track(TrackKind.TEXTURE, (77, 77)))
    plain = [packet for packet in with_depth if packet.track.kind is not TrackKind.DEPTH]
    found, expected = pushed([*with_depth[:3], stray, *with_depth[3:]]), pushed(plain)
    assert len(found) == 3
    for one, other in zip(found, expected, strict=True):
        _assert_equal(one, other)


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

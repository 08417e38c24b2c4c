"""Real cameras coded from each other: pictures, random access, missing cameras, damage, and the commands."""

from __future__ import annotations

import io
import json
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coding import RANGE_PX, RampMatcher, encode, encoded_file, frame_set, luma_psnr, make_array, pushed
from command_line import succeeds
from mcap.reader import make_reader
from small_arrays import write_array

from mvcodec.array import CameraArray, Position
from mvcodec.conformance.recovery import recover
from mvcodec.conformance.validation import validate
from mvcodec.container import read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.predicted_cameras import prediction_order
from mvcodec.errors import MvCodecWarning, StreamError
from mvcodec.frames import DecodedSet
from mvcodec.stream import Packet, PredictedCamera, StreamHeader, Track, TrackKind

FORM: dict[str, Any] = {"prediction": "synthesis", "disparity_cameras": "all"}


def predicted_file(array: CameraArray | None = None, frames: int = 3, **changes: object) -> bytes:
    return encoded_file(array or make_array(), frames, 0, **{**FORM, **changes})


def decoded_sets(file: bytes, frames: slice | None = None) -> list[DecodedSet]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with Decoder.open(io.BytesIO(file), frames) as decoder:
            return list(decoder)


@pytest.mark.parametrize("shape", [(1, 2), (2, 1), (2, 2), (3, 3)])
@pytest.mark.parametrize(
    ("maps", "second"), [("all", "none"), ("alternate", "none"), ("alternate", "nearest")]
)
def test_every_camera_comes_back(shape: tuple[int, int], maps: str, second: str) -> None:
    array = make_array(rows=shape[0], cols=shape[1])
    found = decoded_sets(predicted_file(array, disparity_cameras=maps, second_reference=second, qp=24))
    assert [decoded.index for decoded in found] == [0, 1, 2]
    for decoded in found:
        for camera in array.real:
            quality = luma_psnr(decoded.pictures[camera], frame_set(array, decoded.index).pictures[camera])
            assert quality > 34, (camera, quality)


@pytest.mark.parametrize("size", [(95, 63), (90, 52)])
def test_odd_sizes_and_small_maps_come_back(size: tuple[int, int], tmp_path: Path) -> None:
    array = make_array(*size)
    path = tmp_path / "x.mcap"
    path.write_bytes(predicted_file(array, disparity_scale=2, qp=24))
    assert validate(path) == []
    for decoded in decoded_sets(predicted_file(array, disparity_scale=2, qp=24)):
        for camera in array.real:
            original = frame_set(array, decoded.index).pictures[camera]
            assert decoded.pictures[camera].shape == original.shape
            assert luma_psnr(decoded.pictures[camera], original) > 34


def test_each_camera_is_predicted_from_those_before_it() -> None:
    order = prediction_order(make_array(rows=2, cols=3))
    assert order[0] == PredictedCamera((0, 1), ((0, 0),))
    assert order[3] == PredictedCamera((1, 1), ((0, 1), (1, 0)))
    assert len(order) == 5
    assert prediction_order(make_array(rows=1, cols=1)) == ()


def test_the_first_camera_and_the_maps_are_those_of_a_plain_file() -> None:
    plain, new = (
        {packet.track: packet.data for packet in encode(make_array(), 1, **form)[0]} for form in ({}, FORM)
    )
    shared = plain.keys() & new.keys()
    assert {track.kind for track in new.keys() - shared} == {TrackKind.PREDICTED}
    for track in shared - {Track(TrackKind.HEADER)}:
        assert new[track] == plain[track]


def test_viewers_see_topics_of_another_kind() -> None:
    file = predicted_file()
    schemas = {
        channel.topic: schema.name
        for schema, channel, _ in make_reader(io.BytesIO(file)).iter_messages()
        if schema
    }
    assert schemas["/camera/r00_c00/video"] == "foxglove.CompressedVideo"
    assert schemas["/camera/r01_c01/predicted"] == "mvcodec.PredictedVideo"
    assert "/camera/r01_c01/video" not in schemas


def test_the_header_says_who_depends_on_whom() -> None:
    data = encode(make_array(), 1, **FORM)[0][0].data
    document = json.loads(data)
    assert document["version"] == 2
    assert document["prediction"]["cameras"][2] == {"camera": [1, 1], "from": [[0, 1], [1, 0]]}
    header = StreamHeader.from_json(data)
    assert header.to_json() == data
    assert header.predicted == prediction_order(make_array())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"predictor": "warp-9"}, "prediction.predictor = warp-9, expected warp-1 or warp-2"),
        ({"codec": "h264"}, "prediction.codec = h264, expected vp9 or vp9+nearest"),
        ({"cameras": [{"camera": [1, 1], "from": []}]}, "real cameras that are decoded before"),
        (
            {"cameras": [{"camera": [0, 1], "from": [[0, 1]]}]},
            "real cameras that are decoded before",
        ),
        ({"cameras": [{"camera": [9, 9], "from": [[0, 0]]}]}, "expected real cameras, each once"),
        ({"cameras": [{"camera": [1, 1]}]}, "prediction.cameras = "),
        ({"cameras": 7}, "prediction.cameras = 7"),
    ],
)
def test_headers_that_cannot_be_are_refused(change: dict[str, object], message: str) -> None:
    document = json.loads(encode(make_array(), 1, **FORM)[0][0].data)
    document["prediction"] |= change
    with pytest.raises(StreamError) as caught:
        StreamHeader.from_json(json.dumps(document).encode())
    assert message in str(caught.value)


def test_version_1_does_not_say_it() -> None:
    document = json.loads(encode(make_array(), 1, **FORM)[0][0].data) | {"version": 1}
    with pytest.raises(StreamError, match="found predicted cameras in a header of version 1"):
        StreamHeader.from_json(json.dumps(document).encode())


def test_where_maps_are_wrong_the_nearest_camera_itself_saves_bits() -> None:
    """The matcher's ramps are not where things are, but the cameras see the same photograph."""
    plain, nearest = (
        encode(make_array(), 1, **FORM, second_reference=second)[0] for second in ("none", "nearest")
    )
    assert json.loads(nearest[0].data)["prediction"]["codec"] == "vp9+nearest"
    header = StreamHeader.from_json(nearest[0].data)
    assert (header.second_reference, header.to_json()) == ("nearest", nearest[0].data)
    before, now = (
        sum(len(packet.data) for packet in packets if packet.track.kind is TrackKind.PREDICTED)
        for packets in (plain, nearest)
    )
    assert now < 0.7 * before


@pytest.mark.parametrize("second", ["none", "nearest"])
def test_random_access_and_late_join_give_the_same_pictures(second: str) -> None:
    file = predicted_file(frames=7, gop=3, second_reference=second)
    whole, late = decoded_sets(file), decoded_sets(file, slice(4, 6))
    for one, other in zip(whole[4:6], late, strict=True):
        for camera in one.pictures:
            np.testing.assert_array_equal(one.pictures[camera], other.pictures[camera])


def without(packets: list[Packet], lost: Track) -> list[Packet]:
    return [packet for packet in packets if packet.track != lost]


@pytest.mark.parametrize(
    ("lost", "absent"),
    [
        (Track(TrackKind.PREDICTED, (1, 1)), {(1, 1)}),
        (Track(TrackKind.PREDICTED, (0, 1)), {(0, 1), (1, 0), (1, 1)}),
        (Track(TrackKind.DISPARITY, (1, 1)), {(0, 1), (1, 0), (1, 1)}),
    ],
)
def test_who_misses_a_reference_is_made_from_the_others_until_its_keyframe(
    lost: Track, absent: set[Position]
) -> None:
    sets = encode(make_array(), 4, gop=2, **{**FORM, "disparity_cameras": "alternate"})
    packets = [
        packet
        for number, each in enumerate(sets)
        for packet in (without(each, lost) if number == 0 else each)
    ]
    with pytest.warns(MvCodecWarning, match="go on without camera"):
        found = pushed(packets)
    assert [set(decoded.absent) for decoded in found] == [absent, absent, set(), set()]
    whole = pushed([packet for each in sets for packet in each])
    for one, other in zip(found[2:], whole[2:], strict=True):
        np.testing.assert_array_equal(one.pictures[1, 1], other.pictures[1, 1])


def test_another_prediction_is_told_and_never_shown() -> None:
    packets = encode(make_array(), 1, **FORM)[0]
    track = Track(TrackKind.PREDICTED, (1, 1))
    wrong = [replace(p, data=b"\x00\x01\x02\x03" + p.data[4:]) if p.track == track else p for p in packets]
    with pytest.warns(MvCodecWarning, match="not the encoder's, expected checksum 03020100"):
        (found,) = pushed(wrong)
    assert found.absent == ((1, 1),)


@pytest.mark.parametrize("second", ["none", "nearest"])
def test_such_files_are_clean_and_what_remains_of_damaged_ones_too(second: str, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    file = predicted_file(frames=6, gop=2, second_reference=second)
    path.write_bytes(file)
    assert validate(path) == []
    new = tmp_path / "new.mcap"
    with pytest.warns(MvCodecWarning, match="cut off"):
        result = recover(io.BytesIO(file[: len(file) * 2 // 3]), new, lambda _: None)
    assert 0 < result.frames < 6
    assert validate(new) == []
    assert len(decoded_sets(new.read_bytes())) == result.frames


def test_recover_leaves_out_what_cannot_be_predicted(tmp_path: Path) -> None:
    from mvcodec.container import McapWriter

    source, new = io.BytesIO(), tmp_path / "new.mcap"
    lost = Track(TrackKind.PREDICTED, (0, 1))
    with McapWriter(source) as writer:
        for number, packets in enumerate(encode(make_array(), 4, gop=2, **FORM)):
            writer.push(without(packets, lost) if number == 0 else packets)
    told: list[str] = []
    source.seek(0)
    result = recover(source, new, lambda error: told.append(str(error)))
    assert (result.frames, result.incomplete) == (4, 2)
    assert any("a picture whose references are missing" in text for text in told)
    with pytest.warns(MvCodecWarning), Decoder.open(new) as decoder:
        found = list(decoder)
    assert [len(decoded.absent) for decoded in found] == [3, 3, 0, 0]


def test_without_maps_some_are_sent_for_prediction_alone_and_decoders_estimate(tmp_path: Path) -> None:
    """The pictures are predicted as ever; what is rendered with comes from a matcher."""
    few = predicted_file(disparity_cameras="alternate", qp=24)
    file = predicted_file(disparity_cameras="none", qp=24)
    with Decoder.open(io.BytesIO(file), matcher=RampMatcher()) as decoder:
        found = list(decoder)
        header = decoder.header
    assert (header.version, header.disparity_use) == (2, "prediction")
    assert header.map_cameras == ((0, 0), (1, 1))
    for one, other in zip(decoded_sets(few), found, strict=True):
        assert not np.array_equal(one.disparities[0, 0].values_px, other.disparities[0, 0].values_px)
        np.testing.assert_array_equal(
            other.disparities[0, 0].values_px,
            RampMatcher().match(make_array(), other.pictures, RANGE_PX)[0, 0].values_px,
        )
    path = tmp_path / "x.mcap"
    path.write_bytes(file)
    assert validate(path) == []
    assert "maps of 2 cameras for prediction alone: decoders estimate 4" in succeeds("info", path)


def test_a_use_of_maps_that_cannot_be_is_refused() -> None:
    document = json.loads(encode(make_array(), 1, **{**FORM, "disparity_cameras": "none"})[0][0].data)
    for change, message in (
        ({"disparity_use": "some"}, "disparity_use: found some, expected all or prediction"),
        ({"disparity_cameras": "none", "prediction": None}, "disparity_use: found prediction, expected all"),
    ):
        wrong = {name: value for name, value in {**document, **change}.items() if value is not None}
        with pytest.raises(StreamError) as caught:
            StreamHeader.from_json(json.dumps(wrong).encode())
        assert message in str(caught.value)
    del document["prediction"]
    with pytest.raises(StreamError, match="found disparity_use prediction in a header of version 1"):
        StreamHeader.from_json(json.dumps(document | {"version": 1}).encode())


@pytest.mark.parametrize("count", [1, 3])
def test_threads_change_no_bit(count: int) -> None:
    packets = []
    for threads in (2, count):
        config = EncoderConfig(
            qp=30, matcher=RampMatcher(), disparity_range_px=RANGE_PX, threads=threads, prediction="synthesis"
        )
        with Encoder(make_array(), config) as encoder:
            packets.append([packet.data for packet in encoder.push(frame_set(make_array(), 0))])
    assert packets[0] == packets[1]


def test_the_commands_know_such_files(tmp_path: Path) -> None:
    coded = tmp_path / "coded.mcap"
    array = write_array(tmp_path / "array", 3, 3, 2)
    options = ("--disparity-range", "0,12", "--preset", "veryfast", "--matcher", "sgbm", "--quiet")
    succeeds("encode", array, coded, "--prediction", "synthesis", *options)
    assert "3 cameras coded from others; /camera/r00_c00/video plays alone" in succeeds("info", coded)
    facts = json.loads(succeeds("info", coded, "--json"))
    assert facts["predicted"][0] == {"camera": [0, 2], "from": [[0, 0]]}
    succeeds("validate", coded)
    succeeds("decode", coded, tmp_path / "views", "--quiet")
    assert len(list((tmp_path / "views").glob("*/*.png"))) == 18
    assert read_info(coded).bits.texture > 0
    held = tmp_path / "held.mcap"
    succeeds("encode", array, held, "--prediction", "synthesis", "--bitrate", "500", *options)
    assert json.loads(succeeds("info", held, "--json"))["rate"] == {"bitrate_kbps": 500}

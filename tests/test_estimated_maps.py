"""Files without maps: the decoder estimates them from the decoded pictures, when somebody looks at them."""

from __future__ import annotations

import io
import json
import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coding import RANGE_PX, RampMatcher, encode, encoded_file, make_array, ramp
from command_line import fails, succeeds
from plane_scene import Plane, PlaneScene
from small_arrays import write_array

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.conformance.recovery import recover
from mvcodec.conformance.validation import validate
from mvcodec.container import read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.estimated_maps import MapsOnDemand, Smoothed, can_be_estimated, estimate_maps
from mvcodec.decoding.frame_store import FrameStore
from mvcodec.encoding.encoder import EncoderConfig
from mvcodec.errors import MvCodecWarning, SettingError, StreamError
from mvcodec.frames import DisparityMap, Picture
from mvcodec.layers.refinement import make_matcher
from mvcodec.stream import StreamHeader, Track, TrackKind


class CountingMatcher(RampMatcher):
    """Counts how often it was asked."""

    def __init__(self) -> None:
        self.count = 0

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        self.count += 1
        return super().match(array, pictures, range_px)


def without_maps(frames: int, **changes: object) -> bytes:
    return encoded_file(make_array(), frames, 0, disparity_cameras="none", **changes)


def test_the_encoder_does_not_match_and_the_file_holds_pictures_only() -> None:
    matcher = CountingMatcher()
    file = without_maps(2, matcher=matcher)
    info = read_info(io.BytesIO(file))
    assert matcher.count == 0
    assert info.bits.disparity == 0
    assert info.header.tracks == tuple(Track(TrackKind.TEXTURE, camera) for camera in make_array().real)
    assert info.header.disparity_range_px == RANGE_PX


def test_only_such_files_are_of_version_2_and_a_version_1_header_cannot_ask_for_them() -> None:
    plain, new = (
        json.loads(encode(make_array(), 1, disparity_cameras=which)[0][0].data) for which in ("all", "none")
    )
    assert (plain["version"], new["version"]) == (1, 2)
    assert StreamHeader.from_json(json.dumps(new).encode()).disparity_cameras == "none"
    new["version"] = 1
    with pytest.raises(StreamError, match="found disparity_cameras none in a header of version 1"):
        StreamHeader.from_json(json.dumps(new).encode())
    new["version"] = 9
    with pytest.raises(StreamError, match="found format version 9, expected version 1 or 2"):
        StreamHeader.from_json(json.dumps(new).encode())


def test_the_decoder_asks_its_matcher_when_a_map_is_looked_at_and_only_once() -> None:
    array, matcher = make_array(), CountingMatcher()
    with Decoder.open(io.BytesIO(without_maps(3)), matcher=matcher) as decoder:
        found = list(decoder)
    assert matcher.count == 0
    for camera in array.real:
        np.testing.assert_array_equal(found[1].disparities[camera].values_px, ramp(array, camera))
    assert matcher.count == 1
    assert dict(found[1].disparities).keys() == set(array.real)


def test_frame_sets_that_are_only_passed_are_not_matched(tmp_path: Path) -> None:
    path, matcher = tmp_path / "x.mcap", CountingMatcher()
    path.write_bytes(without_maps(6))
    with Decoder.open(path, slice(4, 5), matcher=matcher) as decoder:
        (found,) = decoder
    assert found.disparities[0, 0].valid.all()
    assert matcher.count == 1
    store = FrameStore(path, matcher=matcher)
    assert store.fetch(5).decoded is not None
    assert matcher.count == 1
    store.close()


def test_maps_on_demand_are_made_once_for_all_threads() -> None:
    calls = []
    gate = threading.Barrier(4)
    flat = DisparityMap(np.zeros((2, 2), np.float32), np.ones((2, 2), np.bool_))

    def find() -> dict[Position, DisparityMap]:
        calls.append(1)
        return {(0, 0): flat}

    maps = MapsOnDemand([(0, 0)], find)

    def look() -> None:
        gate.wait()
        assert maps[0, 0] is flat

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert calls == [1]
    assert (0, 1) not in maps


@pytest.fixture(scope="module")
def scene() -> PlaneScene:
    array = replace(make_array(160, 96), rho=2.0)
    return PlaneScene(array, 3, (Plane(9, (30, 50, 70, 110)),))


@pytest.mark.parametrize(
    ("lost", "blocks"),
    [((), 1), (((1, 1),), 2), (((0, 0), (0, 1)), 1), (((0, 0), (1, 0)), 1)],
)
def test_cameras_that_are_there_get_their_maps(
    scene: PlaneScene, lost: tuple[Position, ...], blocks: int
) -> None:
    array = scene.array
    truth = {camera: scene.render(Viewpoint(*camera)) for camera in array.real if camera not in lost}
    pictures = {camera: picture for camera, (picture, _) in truth.items()}
    asked = []

    class Counted:
        def match(
            self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> dict[Position, DisparityMap]:
            asked.append(array)
            return make_matcher("joint").match(array, pictures, range_px)

    assert can_be_estimated(array, pictures)
    maps = estimate_maps(array, pictures, (0.0, 12.0), Counted())
    assert len(asked) == blocks
    assert set(maps) == set(pictures)
    for camera, found in maps.items():
        assert (np.abs(found.values_px - truth[camera][1]) > 1).mean() < 0.1


def test_a_camera_without_neighbours_takes_what_the_others_say() -> None:
    array = make_array(rows=1, cols=4)
    pictures = {(0, col): np.zeros((64, 96, 3), np.uint8) for col in (0, 1, 3)}

    class Flat:
        def match(
            self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> dict[Position, DisparityMap]:
            assert range_px == RANGE_PX
            shape = (array.height, array.width)
            full = DisparityMap(np.full(shape, 5, np.float32), np.ones(shape, np.bool_))
            return dict.fromkeys(pictures, full)

    maps = estimate_maps(array, pictures, RANGE_PX, Flat())
    assert set(maps) == set(pictures)
    assert (maps[0, 3].values_px == 5).all()
    assert not can_be_estimated(array, [(0, 0), (0, 2)])
    assert can_be_estimated(make_array(rows=1, cols=1), [(0, 0)])


def test_noise_of_the_maps_is_smoothed_and_their_edges_stay() -> None:
    array = make_array()
    pictures = {camera: np.zeros((64, 96, 3), np.uint8) for camera in array.real}
    truth = np.where(np.arange(96) < 40, 9, 4).astype(np.float32) * np.ones((64, 1), np.float32)
    noise = np.random.default_rng(1).normal(0, 0.3, truth.shape).astype(np.float32)

    class Noisy:
        def match(
            self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> dict[Position, DisparityMap]:
            assert (array.height, array.width) == truth.shape
            assert range_px == RANGE_PX
            return dict.fromkeys(pictures, DisparityMap(truth + noise, np.ones(truth.shape, np.bool_)))

    for found in Smoothed(Noisy()).match(array, pictures, RANGE_PX).values():
        left = found.values_px - truth
        assert left.std() < 0.5 * noise.std()
        assert np.abs(left).max() < np.abs(noise).max()


def test_the_others_go_on_without_a_camera() -> None:
    array = make_array()
    packets = encode(array, 1, disparity_cameras="none")[0]
    lost = Track(TrackKind.TEXTURE, (0, 1))
    with Decoder(matcher=RampMatcher()) as decoder:
        for packet in packets:
            if packet.track != lost:
                decoder.push(packet)
        with pytest.warns(MvCodecWarning, match="go on without camera r00_c01"):
            (found,) = decoder.flush()
    assert found.absent == ((0, 1),)
    assert set(found.disparities) == set(array.real)


def test_a_lone_camera_of_several_is_no_frame_set() -> None:
    packets = encode(make_array(rows=1, cols=2), 1, disparity_cameras="none")[0]
    with Decoder(matcher=RampMatcher()) as decoder:
        decoder.push(packets[0])
        decoder.push(packets[1])
        with pytest.warns(MvCodecWarning, match="go on without camera r00_c01"):
            assert decoder.flush() == []


def test_such_files_are_clean_and_recover_keeps_them(tmp_path: Path) -> None:
    path, new = tmp_path / "x.mcap", tmp_path / "new.mcap"
    file = without_maps(6, gop=1)
    path.write_bytes(file)
    assert validate(path) == []
    result = recover(io.BytesIO(file[: len(file) * 3 // 4]), new, lambda _: None)
    assert result.frames > 0
    assert validate(new) == []
    assert read_info(new).header.disparity_cameras == "none"


def test_which_matcher_decodes() -> None:
    file = io.BytesIO(without_maps(1, matcher="sgbm"))
    with Decoder.open(file) as decoder:
        (by_default,) = decoder
        maps = by_default.disparities
    expected = estimate_maps(
        by_default.array,
        by_default.pictures,
        RANGE_PX,
        Smoothed(make_matcher("sgbm")),
        by_default.coding_error,
    )
    np.testing.assert_array_equal(maps[0, 0].values_px, expected[0, 0].values_px)
    with pytest.raises(SettingError, match="matcher: found guess, expected one of"):
        Decoder.open(file, matcher="guess")


def test_auto_leaves_all_maps_to_the_decoder_where_there_are_pairs() -> None:
    config = EncoderConfig(qp=30, disparity_cameras="auto")
    assert config.cameras_for(make_array()) == "none"
    assert config.cameras_for(make_array(rows=1, cols=1)) == "all"
    assert EncoderConfig(qp=20, prediction="synthesis").cameras_for(make_array()) == "alternate"
    predicted = EncoderConfig(qp=30, disparity_cameras="auto", prediction="synthesis")
    assert predicted.use_for(make_array()) == "prediction"
    assert predicted.use_for(make_array(rows=1, cols=1)) == "all"
    enhanced = EncoderConfig(qp=30, disparity_cameras="auto", enhance="auto")
    assert enhanced.use_for(make_array()) == "all"  # its maps serve most views anyway
    assert EncoderConfig(qp=None, bitrate_kbps=800, disparity_cameras="none").rate_of_pictures(
        make_array()
    ).bitrate_kbps == pytest.approx(200)


def test_the_commands_know_such_files(tmp_path: Path) -> None:
    coded, plain = tmp_path / "coded.mcap", tmp_path / "plain.mcap"
    array = write_array(tmp_path / "array", 3, 3, 1)
    options = ("--disparity-range", "0,12", "--preset", "veryfast", "--matcher", "sgbm", "--quiet")
    succeeds("encode", array, coded, "--disparity-cameras", "none", *options)
    succeeds("encode", array, plain, *options)
    text = succeeds("info", coded)
    assert "no maps: decoders estimate 4 a frame set, by matcher sgbm" in text
    assert json.loads(succeeds("info", coded, "--json"))["version"] == 2
    assert succeeds("validate", coded)
    succeeds("decode", coded, tmp_path / "views", "--matcher", "sad", "--quiet")
    assert len(list((tmp_path / "views").glob("*/*.png"))) == 9
    line = fails(2, "decode", plain, tmp_path / "no", "--matcher", "sad")
    assert "--matcher: found sad, expected no such option: the file holds maps" in line
    assert "--matcher: found guess" in fails(2, "decode", coded, tmp_path / "no", "--matcher", "guess")

"""Maps that are not sent: derived from those of the cameras around, in the kernel, alone and in the chain."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from coding import RANGE_PX, RampMatcher, encode, encoded_file, frame_set, make_array
from hypothesis import given, settings
from hypothesis import strategies as st

from mvcodec.array import CameraArray, Position
from mvcodec.conformance.validation import validate
from mvcodec.container import read_info
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.derived_maps import REACH, derive_map
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.errors import MvCodecWarning, SettingError, StreamError
from mvcodec.frames import DecodedSet, DisparityMap, FloatMap
from mvcodec.kernels.map_projection import from_steps, merge, to_steps
from mvcodec.kernels.view_depth import MARGIN, UNKNOWN, splat
from mvcodec.stream import Packet, StreamHeader, Track, TrackKind, map_cameras

FAR_PX, NEAR_PX = -2.0, 9.0
TOP, LEFT, SIZE = 20, 30, 24
"""The near square, as camera (0, 0) sees it."""


@pytest.mark.parametrize(("right", "down"), [(1.0, 0.0), (0.0, -1.0)])
def test_whole_maps_have_no_cracks(right: float, down: float) -> None:
    # A slanted wall: where the other camera sees it, its pixels stand 1.3 px apart.
    rows, columns = np.mgrid[:40, :50]
    slope = (0.3 * (rows if down else -columns)).astype(np.float32)
    out = np.empty((42, 50 + 2 * MARGIN), np.float32)
    splat(slope, right, down, REACH, out)
    assert (out[1:31, MARGIN : MARGIN + 30] > UNKNOWN).all()


def test_a_map_is_not_moved_to_where_it_has_no_room() -> None:
    slope = np.zeros((40, 50), np.float32)
    with pytest.raises(ValueError, match="border"):
        splat(slope, 1.0, 0.0, REACH, np.empty((42, 52), np.float32))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_the_merging_kernel_is_its_twin(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    # Eighths of a pixel: sums are exact.
    seen = (rng.integers(-40, 41, (count, 5, 7)) / 8).astype(np.float32)
    seen[rng.random(seen.shape) < 0.3] = UNKNOWN
    values, known = np.empty((5, 7), np.float32), np.empty((5, 7), np.bool_)
    merge(np.pad(seen, ((0, 0), (1, 1), (MARGIN, MARGIN))), 2.0, values, known)
    np.testing.assert_array_equal(known, (seen > UNKNOWN).any(axis=0))
    for place in np.ndindex(5, 7):
        of_pixel = seen[(slice(None), *place)]
        agreeing = of_pixel[of_pixel > of_pixel.max() - 2] if known[place] else of_pixel[:1]
        assert values[place] == pytest.approx(agreeing.mean())


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([2.0**-10, 0.125]))
def test_steps_are_their_twin(seed: int, width: int, step: float) -> None:
    values = np.random.default_rng(seed).uniform(-20, 80, (3, width)).astype(np.float32)
    steps, back = np.empty(values.shape, np.uint16), np.empty(values.shape, np.float32)
    to_steps(values, -16.0, step, steps)
    np.testing.assert_array_equal(steps, np.floor((values + 16) / step + 0.5).clip(0, 65535))
    from_steps(steps, -16.0, step, back)
    np.testing.assert_array_equal(back, steps * np.float32(step) - 16)


def square(array: CameraArray, camera: Position) -> FloatMap:
    """What a camera of the array sees of a near square before a far wall; exact."""
    values = np.full((array.height, array.width), FAR_PX, np.float32)
    top, left = TOP - round(NEAR_PX) * camera[0], LEFT - round(NEAR_PX) * camera[1]
    values[top : top + SIZE, left : left + SIZE] = NEAR_PX
    return values


def test_a_derived_map_is_what_the_camera_sees() -> None:
    array = make_array(96, 64)
    seen = np.ones((64, 96), np.bool_)
    maps = {camera: DisparityMap(square(array, camera), seen) for camera in ((0, 0), (1, 1))}
    for camera in ((0, 1), (1, 0)):
        found = derive_map(array, maps, RANGE_PX, camera)
        wrong = np.abs(found.values_px - square(array, camera)) > 0.01
        # Sharp corners are rounded by the median; nothing else differs.
        assert wrong.sum() <= 4 * 3
        hidden = ~found.valid
        assert 0 < hidden.sum() < 0.03 * hidden.size, "what the square hides from both"
        assert (found.values_px[hidden & ~wrong] == FAR_PX).all()


def test_surfaces_that_agree_are_averaged_and_others_hide() -> None:
    array = make_array(32, 16)
    seen = np.ones((16, 32), np.bool_)
    for of_first, of_other, expected in ((4.0, 5.0, 4.5), (4.0, 7.0, 7.0), (-3.0, 3.0, 3.0)):
        maps = {
            (0, 0): DisparityMap(np.full((16, 32), of_first, np.float32), seen),
            (1, 1): DisparityMap(np.full((16, 32), of_other, np.float32), seen),
        }
        found = derive_map(array, maps, RANGE_PX, (0, 1)).values_px
        assert found[8, 14] == pytest.approx(expected)


def test_what_nobody_sees_is_finite() -> None:
    array = make_array(16, 16, rows=1, cols=3)
    far = DisparityMap(np.full((16, 16), 40.0, np.float32), np.ones((16, 16), np.bool_))
    found = derive_map(array, {(0, 0): far}, RANGE_PX, (0, 2))
    assert not found.valid.any()
    np.testing.assert_array_equal(found.values_px, np.float32(RANGE_PX[0]))


def test_every_second_camera_sends_a_map() -> None:
    assert map_cameras(make_array(rows=3, cols=3), "alternate") == ((0, 0), (0, 2), (1, 1), (2, 0), (2, 2))
    assert map_cameras(make_array(rows=1, cols=2), "alternate") == ((0, 0),)
    assert map_cameras(make_array(rows=1, cols=1), "alternate") == ((0, 0),)
    assert map_cameras(make_array(), "all") == make_array().real


class SquareMatcher:
    """Knows `square`."""

    def match(self, array: CameraArray, pictures: object, range_px: object) -> dict[Position, DisparityMap]:
        """See `Matcher`."""
        del pictures, range_px
        seen = np.ones((array.height, array.width), np.bool_)
        return {camera: DisparityMap(square(array, camera), seen) for camera in array.real}


def decoded_sets(file: bytes) -> list[DecodedSet]:
    with Decoder.open(io.BytesIO(file)) as decoder:
        return list(decoder)


@pytest.mark.parametrize("scale", [1, 2])
def test_the_decoder_gives_every_camera_its_map(scale: int) -> None:
    array = make_array(96, 64)
    changes: dict[str, object] = {
        "qp": 12,
        "disparity_qp": 4,
        "disparity_scale": scale,
        "matcher": SquareMatcher(),
    }
    file, whole = (
        encoded_file(array, 2, 0, disparity_cameras=which, **changes) for which in ("alternate", "all")
    )
    bits, bits_of_all = (read_info(io.BytesIO(each)).bits.disparity for each in (file, whole))
    assert 0.4 * bits_of_all < bits < 0.6 * bits_of_all
    for found in decoded_sets(file):
        assert list(found.pictures) == list(array.real)
        assert set(found.disparities) == set(array.real)
        for camera in array.real:
            off = np.abs(found.disparities[camera].values_px - square(array, camera)) > 0.5
            assert off.mean() < 0.02


def test_files_without_some_maps_are_clean(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(encoded_file(make_array(rows=2, cols=3), 3, disparity_cameras="alternate"))
    assert validate(path) == []


def test_the_header_says_who_sends_a_map() -> None:
    data = encode(make_array(), 1, disparity_cameras="alternate")[0][0].data
    header = StreamHeader.from_json(data)
    assert header.disparity_cameras == "alternate"
    assert [track.camera for track in header.tracks if track.kind is TrackKind.DISPARITY] == [(0, 0), (1, 1)]
    document = json.loads(data)
    del document["disparity_cameras"]
    assert StreamHeader.from_json(json.dumps(document).encode()).map_cameras == make_array().real
    document["disparity_cameras"] = "some"
    with pytest.raises(StreamError, match="disparity_cameras: found some, expected all or alternate"):
        StreamHeader.from_json(json.dumps(document).encode())


def decoded_without(packets: list[Packet], lost: set[Track]) -> list[DecodedSet]:
    with Decoder() as decoder:
        for packet in packets:
            if packet.track not in lost:
                decoder.push(packet)
        return decoder.flush()


@pytest.mark.parametrize(
    ("lost", "absent"),
    [
        (((0, 0),), ((0, 0),)),
        (((1, 0),), ((1, 0),)),
        (((0, 0), (0, 1)), ((0, 0), (0, 1))),
    ],
)
def test_the_others_go_on_without_a_camera(lost: tuple[Position, ...], absent: tuple[Position, ...]) -> None:
    array = make_array()
    tracks = {Track(TrackKind.TEXTURE, camera) for camera in lost}
    packets = encode(array, 1, disparity_cameras="alternate")[0]
    with pytest.warns(MvCodecWarning, match="go on without camera"):
        (found,) = decoded_without(packets, tracks)
    assert found.absent == absent
    for camera in array.real:
        assert found.disparities[camera].values_px.shape == (array.height, array.width)
        assert np.isfinite(found.disparities[camera].values_px).all()


def test_without_any_map_there_is_no_frame_set() -> None:
    packets = encode(make_array(), 1, disparity_cameras="alternate")[0]
    maps = {packet.track for packet in packets if packet.track.kind is TrackKind.DISPARITY}
    with pytest.warns(MvCodecWarning, match="go on without camera"):
        assert decoded_without(packets, maps) == []


def test_the_default_leaves_maps_out_of_coarse_streams_of_whole_cells() -> None:
    square_array, line = make_array(), make_array(rows=1, cols=3)
    chosen = [EncoderConfig(qp=qp).cameras_for(square_array) for qp in range(1, 52)]
    assert chosen == sorted(chosen)
    assert set(chosen) == {"all", "alternate"}
    assert EncoderConfig(qp=40).cameras_for(line) == "all"
    assert EncoderConfig(qp=None, bitrate_kbps=500).cameras_for(square_array) == "alternate"
    assert EncoderConfig(qp=40, disparity_cameras="all").cameras_for(square_array) == "all"
    with pytest.raises(SettingError, match="disparity_cameras: found some, expected one of all, alternate"):
        EncoderConfig(disparity_cameras="some")


def test_a_bit_rate_is_shared_by_those_who_send() -> None:
    array = make_array()
    total = {}
    for which in ("all", "alternate"):
        config = EncoderConfig(qp=None, bitrate_kbps=800, disparity_cameras=which)
        pictures, maps = config.rate_of_pictures(array), config.rate_of_maps(array, RANGE_PX)
        assert pictures.bitrate_kbps is not None
        assert maps.bitrate_kbps is not None
        senders = map_cameras(array, which)
        total[which] = 4 * pictures.bitrate_kbps + len(senders) * maps.bitrate_kbps
    assert total == pytest.approx({"all": 800, "alternate": 800})


def test_metric_depth_is_there_for_every_camera_all_the_same() -> None:
    array = make_array()
    settings = EncoderConfig(
        disparity_cameras="alternate", depth=True, matcher=RampMatcher(), disparity_range_px=RANGE_PX
    )
    with Encoder(array, settings) as encoder:
        packets = encoder.push(frame_set(array, 0))
    cameras = [packet.track.camera for packet in packets if packet.track.kind is TrackKind.DEPTH]
    assert cameras == list(array.real)

"""What the encoder takes, refuses and gives: frame sets, matchers, settings and rates."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from coding import (
    RANGE_PX,
    RampMatcher,
    config,
    encode,
    encoded_file,
    frame_set,
    luma_psnr,
    make_array,
    pushed,
)

from mvcodec.array import CameraArray, Position
from mvcodec.container import read_info
from mvcodec.encoding.encoder import Encoder, default_gop
from mvcodec.errors import InputError, SettingError
from mvcodec.frames import DisparityMap, FrameSet, Picture
from mvcodec.stream import HEADER_TRACK, StreamHeader, TrackKind
from mvcodec.video.disparity_rate import default_disparity_qp

ARRAY = make_array()


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
    for found in pushed(packets):
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
        ({"disparity_qp": 60}, r"disparity_qp: found 60, expected a whole number, 1\.\.51"),
        ({"gop": 0}, r"gop: found 0, expected a whole number of at least 1"),
        ({"crf": 20.0}, r"found qp and crf, expected exactly one"),
        ({"disparity_range_px": (3.0, 3.0)}, r"disparity_range_px: found \[3\.0, 3\.0\], expected lo < hi"),
        ({"preset": "warp"}, r"preset: found warp, expected one of ultrafast"),
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

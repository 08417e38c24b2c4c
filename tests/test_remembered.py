"""Matching once for several codings: the same maps bit for bit, the time that they took, no file left."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coding import RANGE_PX, RampMatcher, config, encode, frame_set, make_array, ramp
from study_runs import study_run

from mvcodec.array import CameraArray, Position
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import OutputError
from mvcodec.evaluation.remembered import MapSpool, Remembered
from mvcodec.frames import DisparityMap, Picture
from mvcodec.plugin_tables import Plugin
from mvcodec.stereo.matchers import MATCHERS

SECONDS = 0.05


class SlowMatcher:
    """Takes its time; its maps depend on the pictures, and it counts how often it was asked."""

    calls = 0

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher`."""
        self.calls += 1
        time.sleep(SECONDS)
        return {
            camera: DisparityMap(
                (ramp(array, camera) + picture[..., 0] / 977 + range_px[0] / 3).astype(np.float32),
                picture[..., 1] > 100,
            )
            for camera, picture in pictures.items()
        }


@pytest.mark.parametrize("size", [(96, 64), (33, 17)])
def test_maps_come_back_bit_for_bit_in_any_order(tmp_path: Path, size: tuple[int, int]) -> None:
    array, matcher = make_array(*size), SlowMatcher()
    sets = [frame_set(array, number).pictures for number in range(3)]
    with MapSpool(tmp_path) as spool:
        first = Remembered(matcher, spool)
        found = [first.match(array, pictures, RANGE_PX) for pictures in sets]
        again = Remembered(matcher, spool)
        for number in (2, 0, 1):
            maps = again.match(array, sets[number], RANGE_PX)
            assert list(maps) == list(found[number])
            for camera, expected in found[number].items():
                assert maps[camera].values_px.dtype == np.float32
                np.testing.assert_array_equal(maps[camera].values_px, expected.values_px)
                np.testing.assert_array_equal(maps[camera].valid, expected.valid)
    assert matcher.calls == 3


def test_other_pictures_ranges_and_geometries_are_matched_anew(tmp_path: Path) -> None:
    array, matcher = make_array(), SlowMatcher()
    pictures = dict(frame_set(array, 0).pictures)
    changed = {**pictures, (0, 0): pictures[0, 0] ^ np.uint8(1)}
    with MapSpool(tmp_path) as spool:
        remembered = Remembered(matcher, spool)
        for _ in range(2):
            remembered.match(array, pictures, RANGE_PX)
            remembered.match(array, changed, RANGE_PX)
            remembered.match(array, pictures, (-5.0, 12.0))
            remembered.match(replace(array, rho=1.5), pictures, RANGE_PX)
    assert matcher.calls == 4


def test_time_of_matching_counts_as_often_as_maps_are_used(tmp_path: Path) -> None:
    array, matcher = make_array(), SlowMatcher()
    with MapSpool(tmp_path) as spool:
        first, again = Remembered(matcher, spool), Remembered(matcher, spool)
        for remembered in (first, again):
            for number in range(2):
                remembered.match(array, frame_set(array, number).pictures, RANGE_PX)
    assert first.seconds == again.seconds >= 2 * SECONDS
    assert first.spared_seconds == 0
    assert SECONDS < again.spared_seconds < again.seconds


def test_nothing_is_left_in_the_folder_and_nothing_kept_after_the_end(tmp_path: Path) -> None:
    array, matcher = make_array(), SlowMatcher()
    pictures = frame_set(array, 0).pictures
    with MapSpool(tmp_path) as spool:
        Remembered(matcher, spool).match(array, pictures, RANGE_PX)
    assert list(tmp_path.iterdir()) == []
    with spool:
        Remembered(matcher, spool).match(array, pictures, RANGE_PX)
    assert matcher.calls == 2


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    array = make_array()
    with MapSpool(tmp_path / "none") as spool, pytest.raises(OutputError, match=r"none: cannot be written"):
        Remembered(SlowMatcher(), spool).match(array, frame_set(array, 0).pictures, RANGE_PX)


def test_streams_are_those_of_the_matcher_itself(tmp_path: Path) -> None:
    array = make_array()
    plain = [packet.data for packets in encode(array, 2) for packet in packets]
    with MapSpool(tmp_path) as spool:
        for _ in range(2):
            with Encoder(array, config(), Remembered(RampMatcher(), spool)) as encoder:
                coded = [
                    packet.data for number in range(2) for packet in encoder.push(frame_set(array, number))
                ]
            assert coded == plain


def test_a_study_matches_once_and_counts_it_in_each_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    matcher = SlowMatcher()
    monkeypatch.setitem(MATCHERS, "slow", Plugin(lambda: matcher))
    points = study_run(tmp_path, RANGE_PX, "slow").measure()["mvcodec"]
    assert matcher.calls == 2, "once for each frame set"
    for point in points:
        assert point.match_seconds is not None
        assert 2 * SECONDS <= point.match_seconds < point.encode_seconds

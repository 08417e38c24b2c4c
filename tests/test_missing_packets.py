"""Cameras that are missing, frame sets out of order, times given twice: told, and the others go on."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coding import encode, luma_psnr, make_array

from mvcodec.array import Position, Viewpoint
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.frame_store import FrameStore
from mvcodec.decoding.stand_in import fill_absent
from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.frames import DecodedSet, DisparityMap, Picture
from mvcodec.stream import Packet, TrackKind
from mvcodec.synthesis.synthesizers import SYNTHESIZERS, make_synthesizer

ARRAY = make_array()
LATE: Position = (0, 1)


@pytest.fixture(scope="module")
def coded() -> list[list[Packet]]:
    """12 frame sets, keyframes at 0, 4 and 8."""
    return encode(ARRAY, 12, gop=4)


def _decoded(packets: Iterable[Packet]) -> tuple[list[DecodedSet], list[str]]:
    """The decoded sets and what was told."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with Decoder() as decoder:
            found = [decoded for packet in packets for decoded in decoder.push(packet)]
            found += decoder.flush()
    return found, [str(warning.message) for warning in caught]


def _without(coded: list[list[Packet]], camera: Position, frames: Iterable[int]) -> list[Packet]:
    gone = set(frames)
    return [p for packets in coded for p in packets if not (p.track.camera == camera and p.index in gone)]


def _flat(coded: list[list[Packet]]) -> list[Packet]:
    return [packet for packets in coded for packet in packets]


def test_a_camera_missing_for_some_frames_is_absent_until_its_next_keyframe(
    coded: list[list[Packet]],
) -> None:
    whole, _ = _decoded(_flat(coded))
    found, told = _decoded(_without(coded, LATE, [5]))
    assert [decoded.index for decoded in found] == list(range(12))
    assert [decoded.index for decoded in found if decoded.absent] == [5, 6, 7]
    assert {decoded.absent for decoded in found} == {(), (LATE,)}
    assert told == [
        "stream: /camera/r00_c01/video at 0.500 s: found no packet, expected one for each track of a frame"
        " set; the others go on without camera r00_c01",
        "stream: camera r00_c01 is back at 0.800 s",
    ]
    for decoded, expected in zip(found, whole, strict=True):
        for camera in set(ARRAY.real) - set(decoded.absent):
            np.testing.assert_array_equal(decoded.pictures[camera], expected.pictures[camera])


def test_one_missing_map_makes_its_camera_absent(coded: list[list[Packet]]) -> None:
    packets = [p for p in _flat(coded) if not (p.track.kind is TrackKind.DISPARITY and p.index == 11)]
    found, told = _decoded(packets)
    assert [decoded.index for decoded in found] == list(range(11)), "no camera is left in the last one"
    assert len(told) == len(ARRAY.real)
    packets = [p for p in _flat(coded) if not (p.index == 11 and p.track == coded[0][-1].track)]
    found, _ = _decoded(packets)
    assert found[-1].absent == ((1, 1),)


def test_a_camera_that_starts_late_comes_in_at_a_keyframe(coded: list[list[Packet]]) -> None:
    found, told = _decoded(_without(coded, LATE, range(3)))
    assert [decoded.index for decoded in found if decoded.absent] == [0, 1, 2, 3], "frame 3 builds on frame 2"
    assert len(found) == 12
    assert [("without camera" in text, "is back at 0.400 s" in text) for text in told] == [
        (True, False),
        (False, True),
    ]


def test_packets_given_twice_are_dropped(coded: list[list[Packet]]) -> None:
    whole, _ = _decoded(_flat(coded))
    for packets, count in (
        (_flat(coded[:3] + coded[2:]), 1),
        ([*_flat(coded)[:30], *_flat(coded)[29:]], 1),
    ):
        found, told = _decoded(packets)
        assert [decoded.index for decoded in found] == list(range(12))
        assert len(told) == count
        for decoded, expected in zip(found, whole, strict=True):
            np.testing.assert_array_equal(decoded.pictures[1, 1], expected.pictures[1, 1])


def test_frame_sets_out_of_order_are_told_and_what_builds_on_them_is_left_out(
    coded: list[list[Packet]],
) -> None:
    found, told = _decoded(_flat([*coded[:5], coded[6], coded[5], *coded[7:]]))
    assert [decoded.index for decoded in found] == [0, 1, 2, 3, 4, 8, 9, 10, 11]
    assert any("found frame 5 after frame 6" in text for text in told)
    assert sum("builds on one that is missing" in text for text in told) == len(ARRAY.real)


def test_a_time_given_twice_is_told(coded: list[list[Packet]]) -> None:
    packets = [
        replace(packet, time_ns=500_000_000) if packet.index == 6 else packet for packet in _flat(coded)
    ]
    found, told = _decoded(packets)
    assert [decoded.index for decoded in found] == list(range(12))
    assert told == [
        "stream: frame 6 at 0.500 s: found a time not after that of frame 5, expected times that increase"
    ]


def test_a_file_with_a_missing_packet_decodes_by_number_too(
    coded: list[list[Packet]], tmp_path: Path
) -> None:
    path = tmp_path / "gap.mcap"
    with McapWriter(path) as writer:
        for packets in coded:
            writer.push([p for p in packets if not (p.track.camera == LATE and p.index in (5, 11))])
    with pytest.warns(MvCodecWarning, match="without camera r00_c01"):
        _check_ranges(path)


def _check_ranges(path: Path) -> None:
    for start, stop in ((0, 12), (5, 6), (5, 8), (4, 9), (11, 12)):
        with Decoder.open(path, slice(start, stop)) as decoder:
            assert [decoded.index for decoded in decoder] == list(range(start, stop))
    store = FrameStore(path)
    for number in (5, 4, 11, 6, 0):
        stored = store.fetch(number)
        assert stored.damage is None
        assert stored.decoded is not None
        assert stored.decoded.index == number
    store.close()


@pytest.mark.parametrize("name", SYNTHESIZERS)
def test_virtual_views_use_the_cameras_that_are_there(coded: list[list[Packet]], name: str) -> None:
    found, _ = _decoded(_without(coded[:4], LATE, [1]))
    view = make_synthesizer(name).render(found[1], Viewpoint(0.5, 0.5))
    assert view.pixels.shape == (64, 96, 3)
    assert view.pixels.std() > 10


def _plane(camera: Position) -> tuple[Picture, DisparityMap]:
    """A textured wall at 6 px, seen from a camera of a 2 x 2 array."""
    pattern = np.random.default_rng(5).integers(0, 255, (100, 140, 3), np.uint8)
    top, left = 10 + 6 * camera[0], 10 + 6 * camera[1]
    values_px = np.full((64, 96), 6, np.float32)
    return pattern[top : top + 64, left : left + 96], DisparityMap(values_px, np.ones((64, 96), np.bool_))


@pytest.mark.parametrize("absent", ARRAY.real)
def test_a_stand_in_shows_what_the_missing_camera_would_have_seen(absent: Position) -> None:
    views = {camera: _plane(camera) for camera in ARRAY.real}
    there = {camera: view for camera, view in views.items() if camera != absent}
    pictures, maps = fill_absent(
        ARRAY, {c: picture for c, (picture, _) in there.items()}, {c: m for c, (_, m) in there.items()}
    )
    assert sorted(pictures) == list(ARRAY.real)
    known = maps[absent].valid
    assert known.mean() > 0.9, "the others see nearly all of it"
    np.testing.assert_array_equal(pictures[absent][known], views[absent][0][known])
    np.testing.assert_allclose(maps[absent].values_px, 6)


def test_a_stand_in_resembles_the_picture(coded: list[list[Packet]]) -> None:
    whole, _ = _decoded(coded[0])
    views = {camera: _plane(camera) for camera in ((0, 0),)}
    pictures, _ = fill_absent(ARRAY, {(0, 0): views[0, 0][0]}, {(0, 0): views[0, 0][1]})
    assert luma_psnr(pictures[1, 0][:50], _plane((1, 0))[0][:50]) > 40
    assert set(pictures) == set(whole[0].pictures)


def test_an_unknown_policy_is_refused() -> None:
    with pytest.raises(SettingError, match="on_error: found never, expected skip or stop"):
        Decoder(on_error="never")  # type: ignore[arg-type]

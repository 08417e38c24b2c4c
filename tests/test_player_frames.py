"""Any frame of a file, whole, damaged or cut off, is found by its number, within a bounded cache."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from player_files import FRAMES, GOP, damage, encode

from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.frame_store import MIN_CACHED, FrameStore
from mvcodec.decoding.frame_table import read_frame_table
from mvcodec.errors import StreamError
from mvcodec.frames import DecodedSet

pytest_plugins = ("player_fixtures",)


@pytest.fixture(scope="module")
def decoded(file: Path) -> list[DecodedSet]:
    with Decoder.open(file) as decoder:
        return list(decoder)


def assert_same(found: DecodedSet | None, expected: DecodedSet) -> None:
    assert found is not None
    assert found.index == expected.index
    for camera, picture in expected.pictures.items():
        np.testing.assert_array_equal(found.pictures[camera], picture)
        np.testing.assert_array_equal(
            found.disparities[camera].values_px, expected.disparities[camera].values_px
        )


def test_the_table_has_every_frame_and_keyframe(file: Path) -> None:
    table = read_frame_table(file)
    assert table.count == FRAMES
    assert table.keyframes == tuple(range(0, FRAMES, GOP))
    assert [table.keyframe_before(frame) for frame in (0, 3, 4, 11)] == [0, 0, 4, 8]
    assert [table.keyframe_after(frame) for frame in (0, 3, 4, 11)] == [4, 4, 8, 12]
    assert table.cut_off is None


@pytest.mark.parametrize("cache_bytes", [0, 1 << 30])
def test_frames_in_any_order_are_those_of_the_decoder(
    file: Path, decoded: list[DecodedSet], cache_bytes: int
) -> None:
    store = FrameStore(file, cache_bytes)
    numbers = [*range(FRAMES), *reversed(range(FRAMES)), *random.Random(5).choices(range(FRAMES), k=12)]
    for number in numbers:
        stored = store.fetch(number)
        assert stored.damage is None
        assert_same(stored.decoded, decoded[number])
    store.close()


def test_the_cache_is_bounded_and_used(file: Path) -> None:
    store = FrameStore(file, cache_bytes=0)
    kept = [store.fetch(number).decoded for number in range(FRAMES)]
    again = [store.fetch(FRAMES - 1 - number).decoded for number in range(MIN_CACHED)]
    assert [a is b for a, b in zip(again, reversed(kept), strict=False)] == [True] * MIN_CACHED
    assert store.fetch(0).decoded is not kept[0]
    store.close()


def test_damage_is_reported_and_passed_over(file: Path, decoded: list[DecodedSet], tmp_path: Path) -> None:
    store = FrameStore(damage(file, tmp_path / "damaged.mcap", gop=1))
    for number in [*range(FRAMES), *reversed(range(FRAMES))]:
        stored = store.fetch(number)
        if number // GOP == 1:
            assert stored.damage is not None
            assert (stored.damage.first, stored.damage.end) == (GOP, 2 * GOP)
            assert "damage" in stored.damage.message
            assert_same(stored.decoded, decoded[GOP - 1])
        else:
            assert stored.damage is None
            assert_same(stored.decoded, decoded[number])
    assert len(store.damages) == 1
    store.close()


def test_damage_at_the_start_shows_the_first_whole_frame(
    file: Path, decoded: list[DecodedSet], tmp_path: Path
) -> None:
    store = FrameStore(encode(file.parent / "original", tmp_path / "spoiled.mcap", spoiled=[0, GOP + 2]))
    for number, shown in ((0, GOP), (GOP + 1, GOP + 1), (GOP + 3, GOP + 1), (1, GOP)):
        stored = store.fetch(number)
        assert (stored.damage is None) == (number == shown)
        assert_same(stored.decoded, decoded[shown])
    assert [damage.first for damage in store.damages] == [0, GOP + 2]
    store.close()


def test_a_file_without_one_whole_frame_has_none_to_show(file: Path, tmp_path: Path) -> None:
    spoiled = encode(file.parent / "original", tmp_path / "all.mcap", spoiled=range(FRAMES))
    store = FrameStore(spoiled)
    assert store.fetch(5).decoded is None
    store.close()


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_a_file_cut_off_plays_up_to_the_cut(
    file: Path, decoded: list[DecodedSet], tmp_path: Path, share: float
) -> None:
    data = file.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(share * len(data))])
    store = FrameStore(cut)
    assert store.table.cut_off is not None
    assert "cut off" in store.table.cut_off
    count = store.table.count
    assert 0 < count < FRAMES
    for number in (count - 1, 0, count // 2):
        assert_same(store.fetch(number).decoded, decoded[number])
    store.close()


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(b"no such thing" * 50)
    with pytest.raises(StreamError):
        FrameStore(other)

"""Whole files are decoded a frame set ahead: what comes out, and when an error does, is as without."""

from __future__ import annotations

import io
import warnings
from dataclasses import replace

import numpy as np
import pytest
from coding import encode, encoded_file, make_array, pushed
from damage import chunk_ends

from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import MvCodecWarning, StreamError
from mvcodec.frames import DecodedSet
from mvcodec.stream import Packet

ARRAY = make_array(48, 32, rows=1, cols=2)
COUNT, GOP = 9, 4
THREADS = (1, 2, 4)


@pytest.fixture(scope="module")
def coded() -> list[list[Packet]]:
    return encode(ARRAY, COUNT, gop=GOP)


def _file(coded: list[list[Packet]]) -> io.BytesIO:
    file = io.BytesIO()
    with McapWriter(file) as writer:
        for packets in coded:
            writer.push(packets)
    return io.BytesIO(file.getvalue())


def _same(found: list[DecodedSet], expected: list[DecodedSet]) -> None:
    assert [(each.index, each.absent) for each in found] == [(each.index, each.absent) for each in expected]
    for one, other in zip(found, expected, strict=True):
        for camera in ARRAY.real:
            np.testing.assert_array_equal(one.pictures[camera], other.pictures[camera])
            np.testing.assert_array_equal(
                one.disparities[camera].values_px, other.disparities[camera].values_px
            )


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("start", [0, 3, 4, 7, 8])
def test_what_comes_out_is_what_packets_one_by_one_give(
    coded: list[list[Packet]], threads: int, start: int
) -> None:
    expected = pushed(packet for packets in coded for packet in packets)
    with Decoder.open(_file(coded), slice(start, None), threads=threads) as decoder:
        _same(list(decoder), expected[start:])
        _same(list(decoder), expected[start:])


def _until_error(file: io.BytesIO, threads: int) -> tuple[list[DecodedSet], str]:
    """What comes out before an error, and what that says."""
    found: list[DecodedSet] = []
    try:
        with Decoder.open(file, threads=threads) as decoder:
            for decoded in decoder:
                found.append(decoded)
    except StreamError as error:
        return found, str(error)
    return found, ""


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("place", [0, 2, 5, 8])
def test_an_error_comes_after_all_frame_sets_before_it(
    coded: list[list[Packet]], threads: int, place: int
) -> None:
    last = coded[place][-1]
    broken = [*coded[:place], [*coded[place][:-1], replace(last, data=b"noise" * 20)], *coded[place + 1 :]]
    found, told = _until_error(_file(broken), threads)
    assert [decoded.index for decoded in found] == list(range(place))
    assert f"{last.track.topic} at {place / 10:.3f} s" in told


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("place", [2, 3, 8])
def test_so_it_does_where_packets_are_missing_too(
    coded: list[list[Packet]], threads: int, place: int
) -> None:
    kept = [*coded[place][:-2], replace(coded[place][-2], data=b"noise" * 20)]
    found, told = _until_error(_file([*coded[:place], kept, *coded[place + 1 :]]), threads)
    assert [decoded.index for decoded in found] == list(range(place))
    assert f"{kept[-1].track.topic} at {place / 10:.3f} s" in told


@pytest.mark.parametrize("threads", THREADS)
def test_damage_of_the_file_is_told_after_what_was_begun(threads: int) -> None:
    content = bytearray(encoded_file(ARRAY, COUNT, gop=GOP))
    content[chunk_ends(bytes(content))[-1] - 20] ^= 0xFF
    found, told = _until_error(io.BytesIO(bytes(content)), threads)
    assert told
    assert 0 < len(found) < COUNT
    expected, as_told = _until_error(io.BytesIO(bytes(content)), 1)
    assert told == as_told
    _same(found, expected)


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("place", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 2])
def test_a_missing_packet_costs_its_camera_alone(
    coded: list[list[Packet]], threads: int, place: int, count: int
) -> None:
    behind = place + count
    gone = [*coded[:place], *(packets[:-1] for packets in coded[place:behind]), *coded[behind:]]
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        expected = pushed(packet for packets in gone for packet in packets)
    with Decoder.open(_file(gone), threads=threads) as decoder, pytest.warns(MvCodecWarning, match="go on"):
        _same(list(decoder), expected)

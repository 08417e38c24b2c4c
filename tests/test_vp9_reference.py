"""VP9 with predictions from outside: what the decoder gives, bit by bit, and each libvpx that there is."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_arrays import photograph

from mvcodec.errors import MissingReference, SettingError, StreamError
from mvcodec.video import libvpx
from mvcodec.video.access_unit import Colour
from mvcodec.video.codec import Planes
from mvcodec.video.colour import to_planes
from mvcodec.video.vp9_reference import (
    ReferenceSettings,
    ReferenceUnit,
    ReferenceUnits,
    Vp9ReferenceDecoder,
    Vp9ReferenceEncoder,
)

WIDTH, HEIGHT, FRAMES = 96, 64, 5


def picture(index: int, name: str = "coffee") -> Planes:
    """A moving cut-out of a photograph."""
    top, left = 40 + index, 60 + 2 * index
    return to_planes(photograph(name)[top : top + HEIGHT, left : left + WIDTH])


def nearly(planes: Planes) -> Planes:
    """A prediction: the picture without its details."""
    y, u, v = (plane & np.uint8(0xF0) for plane in (planes.y, planes.u, planes.v))
    return Planes(y, u, v)


def coded(references: int = 1, quantizer: int = 30, gop: int = 3) -> list[bytes]:
    encoder = Vp9ReferenceEncoder(ReferenceSettings(WIDTH, HEIGHT, quantizer, references))
    units = []
    for index in range(FRAMES):
        units.append(encoder.push(picture(index), predictions(index, references), index % gop == 0))
    return units


def predictions(index: int, references: int = 1) -> list[Planes]:
    return [nearly(picture(index)), picture(index, "chelsea")][:references]


def decoded(units: list[bytes], references: int = 1, gop: int = 3, first: int = 0) -> list[Planes]:
    decoder = Vp9ReferenceDecoder((WIDTH, HEIGHT))
    return [
        decoder.push(unit, predictions(index, references), index % gop == 0, f"unit {index}")
        for index, unit in enumerate(units, first)
    ]


def psnr(a: Planes, b: Planes) -> float:
    return float(10 * np.log10(255**2 / np.mean((a.y.astype(float) - b.y) ** 2)))


@pytest.mark.parametrize("references", [1, 2])
def test_round_trip_gets_nearer_with_more_bits(references: int) -> None:
    quality, bits = [], []
    for quantizer in (8, 30, 55):
        units = coded(references, quantizer)
        found = decoded(units, references)
        quality.append(min(psnr(found[index], picture(index)) for index in range(FRAMES)))
        bits.append(sum(map(len, units)))
    assert quality[0] > 40
    assert quality == sorted(quality, reverse=True)
    assert bits == sorted(bits, reverse=True)


def test_a_good_prediction_costs_next_to_nothing() -> None:
    sizes = []
    for exact in (True, False):
        encoder = Vp9ReferenceEncoder(ReferenceSettings(WIDTH, HEIGHT, 20))
        prediction = (
            picture(0)
            if exact
            else Planes(*(np.full_like(p, 128) for p in (picture(0).y, picture(0).u, picture(0).v)))
        )
        sizes.append(len(encoder.push(picture(0), [prediction], keyframe=True)))
    assert sizes[0] < sizes[1] / 10


@pytest.mark.parametrize("references", [1, 2])
def test_every_keyframe_is_a_place_to_begin(references: int) -> None:
    units = coded(references)
    whole, late = decoded(units, references), decoded(units[3:], references, first=3)
    for one, other in zip(whole[3:], late, strict=True):
        np.testing.assert_array_equal(one.y, other.y)
        np.testing.assert_array_equal(one.v, other.v)


def test_a_keyframe_for_another_number_of_predictions_is_refused() -> None:
    unit = coded()[0]
    with pytest.raises(StreamError, match="1 frames in front of a keyframe of 2 predictions"):
        Vp9ReferenceDecoder((WIDTH, HEIGHT)).push(unit, predictions(0, 2), True, "x")


def test_another_prediction_is_told_before_a_wrong_picture_comes_of_it() -> None:
    decoder = Vp9ReferenceDecoder((WIDTH, HEIGHT))
    with pytest.raises(MissingReference, match="x: found a prediction that is not the encoder's"):
        decoder.push(coded()[0], [picture(0, "chelsea")], True, "x")


def test_units_say_what_they_are_without_being_decoded() -> None:
    reader = ReferenceUnits()
    facts = [reader.push(unit) for unit in coded()]
    assert [each.keyframe for each in facts] == [True, False, False, True, False]
    assert facts[0].sizes == ((WIDTH, HEIGHT),)
    assert facts[0].sequences[0].colour == Colour(False, 1, 1, 1)
    assert all(each.missing is None and each.broken == () for each in facts)
    assert ReferenceUnits().push(coded()[1]).missing == "a picture before the first keyframe"
    unit = ReferenceUnit.parse(coded()[0])
    assert unit.to_bytes() == coded()[0]


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_damage_is_one_error_and_a_keyframe_heals_it(data: st.DataObject) -> None:
    units = coded()
    victim = bytearray(units[1])
    for _ in range(data.draw(st.integers(1, 4))):
        victim[data.draw(st.integers(0, len(victim) - 1))] ^= data.draw(st.integers(1, 255))
    decoder = Vp9ReferenceDecoder((WIDTH, HEIGHT))
    decoder.push(units[0], predictions(0), True, "unit 0")
    with suppress(StreamError):
        assert decoder.push(bytes(victim), predictions(1), False, "unit 1").y.shape == (HEIGHT, WIDTH)
    again = decoder.push(units[3], predictions(3), True, "unit 3")
    np.testing.assert_array_equal(again.y, decoded(units)[3].y)


@pytest.mark.parametrize(
    "unit",
    [b"", b"\x01", b"1234", b"1234\x03abc", b"1234\x00", b"1234\x01\xff\xff\x00", b"1234\x01\x00\x00\x82"],
)
def test_what_is_no_unit_is_refused(unit: bytes) -> None:
    decoder = Vp9ReferenceDecoder((WIDTH, HEIGHT))
    with pytest.raises(StreamError, match="x: found"):
        decoder.push(unit, predictions(0), True, "x")


def test_a_picture_of_another_size_is_refused_before_it_takes_memory() -> None:
    with pytest.raises(StreamError, match="a picture of another size"):
        Vp9ReferenceDecoder((WIDTH + 8, HEIGHT)).push(coded()[0], predictions(0), True, "x")


def test_pictures_without_their_keyframe_are_refused() -> None:
    with pytest.raises(StreamError, match="builds on one that is missing"):
        Vp9ReferenceDecoder((WIDTH, HEIGHT)).push(coded()[1], predictions(1), False, "x")


def test_settings_outside_their_range_are_told() -> None:
    with pytest.raises(SettingError, match=r"ReferenceSettings.quantizer: found 64, expected 0..63"):
        ReferenceSettings(WIDTH, HEIGHT, 64)


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from mvcodec.video import libvpx
from mvcodec.video.access_unit import Colour
libvpx.places = lambda: iter([{library!r}])
import test_vp9_reference as t
from zlib import crc32
found = t.decoded(t.coded(2, 40), 2)
assert min(t.psnr(a, t.picture(i)) for i, a in enumerate(found)) > 25
given = [bytes.fromhex(line) for line in sys.stdin.read().split()]
planes = [plane for one in t.decoded(given, 2) for plane in (one.y, one.u, one.v)]
print(libvpx.version(), *(crc32(plane.tobytes()) for plane in planes))
"""


def places() -> list[str]:
    """The library in PyAV's wheel, and the system's."""
    return [str(path) for path in libvpx.places()]


@pytest.mark.parametrize("path", places() or [None])
def test_each_libvpx_here_takes_our_structures_and_gives_our_pictures(path: str | None) -> None:
    """PyAV's wheel has 1.16; Debian's libvpx7 is 1.12. Each decodes the others' units to the same bits."""
    if path is None:
        pytest.skip("no libvpx, neither in PyAV's wheel nor in the system")
    program = PROGRAM.format(tests=str(Path(__file__).parent), library=path)
    units = coded(2, 40)
    done = subprocess.run(
        [sys.executable, "-c", program],
        input="\n".join(unit.hex() for unit in units),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    version, *sums = done.stdout.split()
    assert version.startswith("v1.")
    expected = [plane for found in decoded(units, 2) for plane in (found.y, found.u, found.v)]
    assert list(map(int, sums)) == [crc32(plane.tobytes()) for plane in expected]


def test_without_libvpx_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    libvpx.library.cache_clear()
    monkeypatch.setattr(libvpx, "places", lambda: iter(["/no/such/library.so"]))
    with pytest.raises(libvpx.LibvpxMissing, match=r"libvpx: found none, .*install PyAV's wheel"):
        libvpx.library()
    monkeypatch.undo()
    libvpx.library.cache_clear()


def test_another_library_is_told_from_libvpx() -> None:
    with pytest.raises(libvpx.LibvpxMissing, match="a library without VP9"):
        libvpx.checked(ctypes.CDLL(None))

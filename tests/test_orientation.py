"""Pictures are turned as their tags say: EXIF against Pillow, display matrices against their definition."""

from __future__ import annotations

import io
import itertools
import struct

import numpy as np
import pytest
from PIL import Image, ImageOps

from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.orientation import exif_orientation, matrix_orientation
from mvcodec.capture.still_pictures import opened_still, still_facts, still_to_rgb
from mvcodec.frames import Picture

PICTURE: Picture = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
QUARTERS = [
    m
    for m in itertools.product((-1, 0, 1), repeat=4)
    if abs(m[0] * m[3] - m[1] * m[2]) == 1 and sum(map(abs, m)) == 2
]


def matrix(a: float, b: float, c: float, d: float) -> bytes:
    """A display matrix as FFmpeg has it."""
    one = 1 << 16
    return struct.pack("<9i", *(round(v * one) for v in (a, b, 0, c, d, 0, 0, 0)), 1 << 30)


@pytest.mark.parametrize("value", range(1, 9))
def test_exif_orientation_is_what_pillow_makes_of_it(value: int) -> None:
    image, target = Image.fromarray(PICTURE), io.BytesIO()
    exif = image.getexif()
    exif[0x112] = value
    image.save(target, "PNG", exif=exif)
    expected = np.array(ImageOps.exif_transpose(Image.open(target)))
    orientation = exif_orientation(value)
    np.testing.assert_array_equal(orientation.apply(PICTURE), expected)
    assert orientation.size(3, 2) == expected.shape[1::-1]


def chunks_of(png: bytes) -> list[bytes]:
    """The chunks of a PNG."""
    at, found = 8, []
    while at < len(png):
        end = at + 12 + struct.unpack_from(">I", png, at)[0]
        found.append(png[at:end])
        at = end
    return found


@pytest.mark.parametrize("behind", [False, True])
def test_tags_behind_the_pixels_of_a_png_count_as_well(behind: bool) -> None:
    image, target = Image.fromarray(PICTURE), io.BytesIO()
    exif = image.getexif()
    exif[0x112] = 6
    image.save(target, "PNG", exif=exif)
    chunks = chunks_of(target.getvalue())
    tags = [chunk for chunk in chunks if chunk[4:8] == b"eXIf"]
    others = [chunk for chunk in chunks if chunk not in tags]
    ordered = [*others[:-1], *tags, others[-1]] if behind else chunks
    with opened_still(target.getvalue()[:8] + b"".join(ordered)) as picture:
        assert still_facts(picture).size == (2, 3)
        np.testing.assert_array_equal(
            still_to_rgb(picture, b"", BitDepth("x")), exif_orientation(6).apply(PICTURE)
        )


def test_facts_of_a_png_without_tags_need_no_pixels() -> None:
    target = io.BytesIO()
    Image.fromarray(PICTURE).save(target, "PNG")
    with opened_still(target.getvalue()) as picture:
        assert still_facts(picture).size == (3, 2)
        assert picture.tile  # still waiting to be read


@pytest.mark.parametrize("quarter", QUARTERS)
def test_display_matrix_moves_every_pixel_where_it_says(quarter: tuple[int, ...]) -> None:
    a, b, c, d = quarter
    orientation = matrix_orientation(matrix(a, b, c, d))
    assert orientation is not None
    turned = orientation.apply(PICTURE)
    places = {(a * x + c * y, b * x + d * y): PICTURE[y, x] for y in range(2) for x in range(3)}
    left, top = (min(place[axis] for place in places) for axis in (0, 1))
    assert len(places) == turned.shape[0] * turned.shape[1]
    for (x, y), pixel in places.items():
        np.testing.assert_array_equal(turned[y - top, x - left], pixel)


def test_what_is_no_quarter_turn_is_not_guessed() -> None:
    assert len(QUARTERS) == 8
    assert matrix_orientation(matrix(0.7, 0.7, -0.7, 0.7)) is None
    assert matrix_orientation(matrix(2, 0, 0, 2)) is None
    assert matrix_orientation(b"short") is None
    assert not exif_orientation("3").turns
    assert not exif_orientation(9).turns

"""Pixels as cameras lay them out: planes of colours, mosaics, and pictures that say how they are turned."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.picture_files import look_at_depth, picture_size, read_picture
from mvcodec.capture.picture_messages import StillDecoder
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.errors import InputError
from mvcodec.frames import Picture

SIZE = (32, 24)


def colours() -> Picture:
    """Smooth colours inside of every range, uint8 (24, 32, 3)."""
    x, y = np.meshgrid(np.linspace(0, 1, SIZE[0]), np.linspace(0, 1, SIZE[1]))
    return np.stack([60 + 60 * x, 80 + 50 * y, 150 - 60 * x * y], axis=-1).round().astype(np.uint8)


def decoded(data: bytes, form: str, kind: Any = "raw", step: int | None = None) -> Picture:
    layout = (*SIZE, SIZE[0] if step is None else step)
    message = RecordedPicture("/a", 1, 1, 1, kind, data, form, "", layout if kind == "raw" else None, False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return StillDecoder("rec", BitDepth("rec")).decode(message)


def planes(form: str) -> list[NDArray[np.uint8]]:
    """The planes that FFmpeg makes of the colours, without padding."""
    frame = av.VideoFrame.from_ndarray(colours(), format="rgb24").reformat(format=form)
    found = []
    for number, plane in enumerate(frame.planes):
        rows = np.frombuffer(bytes(plane), np.uint8).reshape(plane.height, plane.line_size)
        pairs = 2 if number and form.startswith("nv") else 1
        found.append(rows[:, : plane.width * pairs])
    return found


@pytest.mark.parametrize(
    ("name", "form"),
    [("nv12", "nv12"), ("NV12", "nv12"), ("nv21", "nv21"), ("nv24", "nv24"), ("i420", "yuv420p")],
)
def test_planes_of_colours(name: str, form: str) -> None:
    data = b"".join(plane.tobytes() for plane in planes(form))
    assert np.abs(decoded(data, name).astype(int) - colours()).max() <= 12
    assert np.abs(decoded(data, name).astype(int) - colours()).mean() < 3


def test_rows_of_planes_may_have_padding() -> None:
    data = b"".join(np.pad(plane, ((0, 0), (0, 5))).tobytes() for plane in planes("nv12"))
    assert np.abs(decoded(data, "nv12", step=SIZE[0] + 5).astype(int) - colours()).mean() < 3
    with pytest.raises(InputError, match="found 100 bytes, expected 1152"):
        decoded(data[:100], "nv12")


@pytest.mark.parametrize("coded", [False, True])
@pytest.mark.parametrize("first", ["rggb", "bggr", "gbrg", "grbg"])
def test_mosaics_become_colours_whether_coded_or_not(first: str, coded: bool) -> None:
    channels = {"r": 0, "g": 1, "b": 2}
    mosaic = np.empty(SIZE[::-1], np.uint8)
    for place, letter in enumerate(first):
        row, col = divmod(place, 2)
        mosaic[row::2, col::2] = colours()[row::2, col::2, channels[letter]]
    data, kind = mosaic.tobytes(), "raw"
    if coded:
        data, kind = cv2.imencode(".png", mosaic)[1].tobytes(), "image"
    name = f"bayer_{first}8" + "; png compressed" * coded
    assert np.abs(decoded(data, name, kind).astype(int) - colours())[2:-2, 2:-2].mean() < 6


@pytest.mark.parametrize("tag", [1, 3, 6, 8])
@pytest.mark.parametrize("form", ["TIFF", "TIFF of 16 bits", "PNG", "JPEG", "WEBP"])
def test_every_form_is_turned_once(form: str, tag: int, tmp_path: Path) -> None:
    """Pillow turns TIFF files by itself."""
    picture = colours()
    path = tmp_path / "a"
    target = io.BytesIO()
    if form == "TIFF of 16 bits":
        _write_deep_tiff(path, picture, tag)
    else:
        exif = Image.Exif()
        exif[0x0112] = tag
        options: dict[str, Any] = {"tiffinfo": {0x0112: tag}} if form == "TIFF" else {"exif": exif}
        if form == "JPEG":
            options |= {"quality": 98, "subsampling": 0}
        elif form == "WEBP":
            options["lossless"] = True
        Image.fromarray(picture).save(target, form, **options)
        path.write_bytes(target.getvalue())
    turned = np.rot90(picture, {1: 0, 3: 2, 6: 3, 8: 1}[tag])
    assert picture_size(path) == turned.shape[1::-1]
    assert np.abs(read_picture(path).astype(int) - turned).max() <= 6


def _write_deep_tiff(path: Path, picture: Picture, tag: int) -> None:
    deep = np.ascontiguousarray(picture[..., ::-1].astype(np.uint16) * 257)
    assert cv2.imwrite(f"{path}.tif", deep, [cv2.IMWRITE_TIFF_COMPRESSION, 1])
    data = bytearray(Path(f"{path}.tif").read_bytes())
    at = int.from_bytes(data[4:8], "little")
    count = int.from_bytes(data[at : at + 2], "little")
    entries = [data[at + 2 + 12 * n : at + 14 + 12 * n] for n in range(count)]
    orientation = (0x0112).to_bytes(2, "little") + b"\3\0\1\0\0\0" + tag.to_bytes(4, "little")
    kept = [entry for entry in entries if entry[:2] != orientation[:2]]
    listed = sorted([*kept, bytearray(orientation)], key=lambda entry: int.from_bytes(entry[:2], "little"))
    data[4:8] = len(data).to_bytes(4, "little")
    data += len(listed).to_bytes(2, "little") + b"".join(listed) + bytes(4)
    path.write_bytes(data)


@pytest.mark.parametrize("bits", [10, 12, 16])
@pytest.mark.parametrize("channels", [1, 3])
def test_deep_png_files_are_scaled_by_their_depth(bits: int, channels: int, tmp_path: Path) -> None:
    """Pillow takes the upper 8 bits of deep colours: black, where the lower 10 or 12 are used."""
    top = (1 << bits) - 1
    values = np.linspace(0, top, SIZE[0] * SIZE[1] * channels).round().astype(np.uint16)
    pixels = values.reshape(SIZE[1], SIZE[0], channels)
    path = tmp_path / "a.png"
    assert cv2.imwrite(str(path), pixels[..., ::-1])
    depth = BitDepth("a")
    look_at_depth(path, depth)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        picture = read_picture(path, depth=depth)
    assert np.abs(picture - pixels * (255.0 / top)).max() <= 0.51
    assert len(told) == (bits < 16)

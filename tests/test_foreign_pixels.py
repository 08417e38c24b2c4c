"""Raw pixels in recordings of ROS 2, of every encoding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from foreign_reading import IMAGE, Read, colourful, padded
from foreign_recordings import FRAMES, both, file_of, ros_image
from numpy.typing import NDArray
from odd_recordings import at
from timed_videos import SIZE, numbered

WIDTH, HEIGHT = SIZE


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("padding", [0, 6])
@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "rgba8", "bgra8", "8UC3", "rgb16", "bgr16", "16UC3"])
def test_raw_images_of_ros_2(encoding: str, padding: int, big: bool) -> None:
    def make(number: int, camera: int) -> bytes:
        pixels: NDArray[Any] = colourful(number, camera)
        if "bgr" in encoding or "UC3" in encoding:
            pixels = pixels[..., ::-1]
        if "a" in encoding:
            pixels = np.dstack([pixels, np.full((HEIGHT, WIDTH), 255, np.uint8)])
        if "16" in encoding:
            pixels = (pixels.astype(np.uint16) * 257).astype(">u2" if big else "<u2")
        data, layout = padded(pixels, padding)
        return ros_image(data, layout, encoding, big, at(number), FRAMES[camera], "<>"[big])

    read = Read(file_of(both(IMAGE, make)), bits=16)
    read.check()
    assert read.told == ""


@pytest.mark.parametrize(("encoding", "big"), [("mono8", False), ("mono16", False), ("mono16", True)])
def test_grey_images_of_ros_2(encoding: str, big: bool) -> None:
    def make(number: int, camera: int) -> bytes:
        grey: NDArray[Any] = numbered(number, camera)[..., 0]
        if encoding == "mono16":
            grey = (grey.astype(np.uint16) << 4).astype(">u2" if big else "<u2")  # of a 12-bit camera
        data, layout = padded(grey, 4)
        return ros_image(data, layout, encoding, big, at(number), FRAMES[camera])

    for number, item in enumerate(Read(file_of(both(IMAGE, make))).sets):
        for (_, camera), picture in item.pictures.items():
            away = np.abs(picture.astype(int) - numbered(number, camera)).max()
            assert away <= 1, "scaled by 12 bits, neither black nor white"


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("first", ["rggb", "bggr", "gbrg", "grbg"])
def test_bayer_images_of_ros_2_have_their_colours(first: str, bits: int) -> None:
    colour = {"r": 200, "g": 120, "b": 40}

    def make(number: int, camera: int) -> bytes:
        cell = np.array([colour[name] for name in first], np.uint16).reshape(2, 2)
        mosaic: NDArray[Any] = np.tile(cell, (HEIGHT // 2, WIDTH // 2))
        mosaic = mosaic.astype(np.uint8) if bits == 8 else mosaic * 257
        data, layout = padded(mosaic, 2)
        return ros_image(data, layout, f"bayer_{first}{bits}", False, at(number), FRAMES[camera])

    for item in Read(file_of(both(IMAGE, make)), bits=16).sets:
        for picture in item.pictures.values():
            assert np.abs(picture[2:-2, 2:-2].astype(int) - (200, 120, 40)).max() <= 1


@pytest.mark.parametrize(
    ("encoding", "order"),
    [
        ("yuv422", "UYVY"),
        ("uyvy", "UYVY"),
        ("yuv422_yuy2", "YUYV"),
        ("yuyv", "YUYV"),
    ],
)
def test_yuv_images_of_ros_2_have_their_colours(encoding: str, order: str) -> None:
    # BT.601, limited range, of a light red: by hand, Y = 16 + 219 (0.299 R + 0.587 G + 0.114 B).
    red, green, blue = 0.9, 0.3, 0.2
    luma = 0.299 * red + 0.587 * green + 0.114 * blue
    value = {
        "Y": 16 + 219 * luma,
        "U": 128 + 224 * (blue - luma) / 1.772,
        "V": 128 + 224 * (red - luma) / 1.402,
    }

    def make(number: int, camera: int) -> bytes:
        pair = np.array([round(value[name]) for name in order], np.uint8)
        pixels = np.tile(pair, (HEIGHT, WIDTH // 2)).reshape(HEIGHT, WIDTH, 2)
        data, layout = padded(pixels, 8)
        return ros_image(data, layout, encoding, False, at(number), FRAMES[camera])

    for item in Read(file_of(both(IMAGE, make))).sets:
        for picture in item.pictures.values():
            assert np.abs(picture.astype(int) - np.array([230, 76, 51])).max() <= 3

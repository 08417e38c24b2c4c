"""Pixels of raw image messages -> RGB, by their encoding's name in Foxglove's and ROS's words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import Picture

Pixels = NDArray[Any]
"""uint8 or uint16 (H, W, channels)."""


@dataclass(frozen=True, slots=True)
class RawEncoding:
    """How pixels lie in a message.

    Attributes:
        channels: values a pixel.
        convert: uint8 (rows, W, channels) -> uint8 (H, W, 3) RGB.
        deep: values have 16 bits.
        alpha: the last one says how opaque it is.
        half_rows: rows in a message for two of the picture's: colours may lie below the brightness.
    """

    channels: int
    convert: Callable[[Pixels], Picture]
    deep: bool = False
    alpha: bool = False
    half_rows: int = 2


def _order(*channels: int) -> Callable[[Pixels], Picture]:
    return lambda pixels: np.ascontiguousarray(pixels[..., channels])


def _opencv(code: int) -> Callable[[Pixels], Picture]:
    return lambda pixels: np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), code), np.uint8)


def _planar(code: int) -> Callable[[Pixels], Picture]:
    return lambda pixels: np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels[..., 0]), code), np.uint8)


def _nv24(pixels: Pixels) -> Picture:
    """Brightness, then colours of every pixel by pairs, which OpenCV lacks; with its factors."""
    height, width = pixels.shape[0] // 3, pixels.shape[1]
    luma = pixels[:height, :, 0].astype(np.float32)
    blue, red = np.moveaxis(pixels[height:].reshape(height, width, 2).astype(np.float32) - 128, -1, 0)
    bright = 1.164 * (luma - 16)
    rgb = [bright + 1.596 * red, bright - 0.813 * red - 0.391 * blue, bright + 2.018 * blue]
    return np.stack(rgb, axis=-1).round().clip(0, 255).astype(np.uint8)


def _encodings() -> dict[str, RawEncoding]:
    found = {
        "rgb": ((0, 1, 2), 3),
        "bgr": ((2, 1, 0), 3),
        "rgba": ((0, 1, 2), 4),
        "bgra": ((2, 1, 0), 4),
        "mono": ((0, 0, 0), 1),
    }
    table: dict[str, RawEncoding] = {}
    for name, (order, channels) in found.items():
        for bits in (8, 16):
            table[f"{name}{bits}"] = RawEncoding(channels, _order(*order), bits == 16, channels == 4)
    # OpenCV's types, whose order of colours is blue, green, red.
    for bits in (8, 16):
        table[f"{bits}UC1"] = table[f"mono{bits}"]
        table[f"{bits}UC3"] = table[f"bgr{bits}"]
        table[f"{bits}UC4"] = table[f"bgra{bits}"]
        for first in ("rggb", "bggr", "gbrg", "grbg"):
            code = getattr(cv2, f"COLOR_Bayer{first.upper()}2RGB")
            table[f"bayer_{first}{bits}"] = RawEncoding(1, _opencv(code), bits == 16)
    for name in ("yuv422", "uyvy"):
        table[name] = RawEncoding(2, _opencv(cv2.COLOR_YUV2RGB_UYVY))
    for name in ("yuv422_yuy2", "yuyv"):
        table[name] = RawEncoding(2, _opencv(cv2.COLOR_YUV2RGB_YUY2))
    for name, code in (
        ("nv12", cv2.COLOR_YUV2RGB_NV12),
        ("nv21", cv2.COLOR_YUV2RGB_NV21),
        ("i420", cv2.COLOR_YUV2RGB_I420),
    ):
        table[name] = RawEncoding(1, _planar(code), half_rows=3)
    table["nv24"] = RawEncoding(1, _nv24, half_rows=6)
    return table


RAW_ENCODINGS = _encodings()
"""By name. YUV is taken as BT.601, limited range, as OpenCV does."""


_SPELLINGS = {name.casefold(): name for name in RAW_ENCODINGS}


def find_encoding(name: str) -> RawEncoding | None:
    """The encoding of a name, in capitals or not; None where it is unknown."""
    known = _SPELLINGS.get(name.strip().casefold())
    return None if known is None else RAW_ENCODINGS[known]

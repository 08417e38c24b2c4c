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
        convert: uint8 (H, W, channels) -> uint8 (H, W, 3) RGB.
        deep: values have 16 bits.
        alpha: the last one says how opaque it is.
    """

    channels: int
    convert: Callable[[Pixels], Picture]
    deep: bool = False
    alpha: bool = False


def _order(*channels: int) -> Callable[[Pixels], Picture]:
    return lambda pixels: np.ascontiguousarray(pixels[..., channels])


def _opencv(code: int) -> Callable[[Pixels], Picture]:
    return lambda pixels: np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), code), np.uint8)


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
    return table


RAW_ENCODINGS = _encodings()
"""By name. YUV is taken as BT.601, limited range, as OpenCV does."""

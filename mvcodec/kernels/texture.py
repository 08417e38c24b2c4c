"""Filtered look-up of textures and light maps."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_TAPS = 8
"""Samples along the longer axis of a footprint, at most."""


class Paint(NamedTuple):
    """How P shapes look.

    Attributes:
        texels: uint8 (N, 3), all levels of all textures, row by row.
        levels: int64 (T, L, 3), offset into `texels`, width and height of each level of each of T
            textures; level l + 1 is half as large. Levels that a texture lacks repeat its last.
        texture: int64 (P,), the texture of each shape.
        windows: float64 (P, 4), (u0, v0, du, dv): place (u, v) on the shape is
            ``(u0 + u * du, v0 + v * dv)`` in sizes of the texture, which is repeated as in a mirror.
        tints: float64 (P, 3), factors on the channels.
        light: float32 (M, 3), light maps of all shapes, row by row: factors on the channels.
        light_maps: int64 (P, 3), offset into `light`, width and height.
    """

    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    texture: NDArray[np.int64]
    windows: NDArray[np.float64]
    tints: NDArray[np.float64]
    light: NDArray[np.float32]
    light_maps: NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def filtered(
    texels: NDArray[np.uint8],
    levels: NDArray[np.int64],
    texture: int,
    u: float,
    v: float,
    ux: float,
    uy: float,
    vx: float,
    vy: float,
) -> tuple[float, float, float]:
    """A texture at (u, v), filtered over a footprint: trilinear, several taps along its longer axis.

    Args:
        texels, levels, texture: as in Paint.
        u, v: place in sizes of the texture.
        ux, uy, vx, vy: change of u and v along the two sides of the footprint.

    Returns:
        Red, green, blue, 0..255.
    """
    # Single elements are read throughout: a view of an array costs more than the look-up itself.
    wide, high = levels[texture, 0, 1], levels[texture, 0, 2]
    x_u, x_v, y_u, y_v = ux * wide, vx * high, uy * wide, vy * high
    x_length, y_length = math.sqrt(x_u * x_u + x_v * x_v), math.sqrt(y_u * y_u + y_v * y_v)
    major = max(x_length, y_length, 1e-9)
    minor = abs(x_u * y_v - x_v * y_u) / major
    taps = int(min(max(major / max(minor, 1.0) + 0.5, 1.0), MAX_TAPS))
    size = max(major / taps, minor)
    level = 0.0 if size <= 1.0 else min(math.log2(size), levels.shape[1] - 1.0)
    along_u, along_v = (ux, vx) if x_length >= y_length else (uy, vy)
    red = green = blue = 0.0
    for tap in range(taps):
        offset = (tap + 0.5) / taps - 0.5
        r, g, b = _between_levels(texels, levels, texture, level, u + offset * along_u, v + offset * along_v)
        red, green, blue = red + r, green + g, blue + b
    return red / taps, green / taps, blue / taps


@njit(cache=True, nogil=True, error_model="numpy")
def _between_levels(
    texels: NDArray[np.uint8], levels: NDArray[np.int64], texture: int, level: float, u: float, v: float
) -> tuple[float, float, float]:
    """Trilinear: linear between the two levels around `level`, bilinear in each."""
    low = int(level)
    share = level - low
    r, g, b = _bilinear(texels, levels, texture, low, u, v)
    if share > 0.0:
        r2, g2, b2 = _bilinear(texels, levels, texture, low + 1, u, v)
        r, g, b = r + (r2 - r) * share, g + (g2 - g) * share, b + (b2 - b) * share
    return r, g, b


@njit(cache=True, nogil=True, error_model="numpy")
def _bilinear(
    texels: NDArray[np.uint8], levels: NDArray[np.int64], texture: int, level: int, u: float, v: float
) -> tuple[float, float, float]:
    """One level at (u, v) in sizes of the texture, repeated as in a mirror."""
    start, width, height = levels[texture, level, 0], levels[texture, level, 1], levels[texture, level, 2]
    x, y = u * width - 0.5, v * height - 0.5
    left, top = math.floor(x), math.floor(y)
    right_share, low_share = x - left, y - top
    x0, x1 = _mirrored(left, width), _mirrored(left + 1, width)
    y0, y1 = start + _mirrored(top, height) * width, start + _mirrored(top + 1, height) * width
    a = (1.0 - right_share) * (1.0 - low_share)
    b = right_share * (1.0 - low_share)
    c = (1.0 - right_share) * low_share
    d = right_share * low_share
    p, q, r, s = y0 + x0, y0 + x1, y1 + x0, y1 + x1
    return (
        a * texels[p, 0] + b * texels[q, 0] + c * texels[r, 0] + d * texels[s, 0],
        a * texels[p, 1] + b * texels[q, 1] + c * texels[r, 1] + d * texels[s, 1],
        a * texels[p, 2] + b * texels[q, 2] + c * texels[r, 2] + d * texels[s, 2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _mirrored(index: int, size: int) -> int:
    if 0 <= index < size:
        return index
    index %= 2 * size
    return index if index < size else 2 * size - 1 - index


@njit(cache=True, nogil=True, error_model="numpy")
def light_at(
    light: NDArray[np.float32], light_maps: NDArray[np.int64], number: int, closed: bool, u: float, v: float
) -> tuple[float, float, float]:
    """The factors on red, green, blue at (u, v) in 0..1 of a shape's light map (see Paint).

    Bilinear; clamped at the ends, or closed in u.
    """
    start, width, height = light_maps[number, 0], light_maps[number, 1], light_maps[number, 2]
    x = u * width - 0.5
    y = min(max(v * height - 0.5, 0.0), height - 1.0)
    if not closed:
        x = min(max(x, 0.0), width - 1.0)
    left, top = math.floor(x), int(y)
    right_share, low_share = x - left, y - top
    if closed:
        left, right = left % width, (left + 1) % width
    else:
        right = min(left + 1, width - 1)
    y0, y1 = start + top * width, start + min(top + 1, height - 1) * width
    p, q, r, s = y0 + left, y0 + right, y1 + left, y1 + right
    a = (1.0 - right_share) * (1.0 - low_share)
    b = right_share * (1.0 - low_share)
    c = (1.0 - right_share) * low_share
    d = right_share * low_share
    return (
        a * light[p, 0] + b * light[q, 0] + c * light[r, 0] + d * light[s, 0],
        a * light[p, 1] + b * light[q, 1] + c * light[r, 1] + d * light[s, 1],
        a * light[p, 2] + b * light[q, 2] + c * light[r, 2] + d * light[s, 2],
    )

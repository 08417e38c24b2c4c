"""RGB <-> planar 4:2:0 Y'CbCr in float32, whose every step is exact in a NumPy twin; see video/colour.py.

Chroma is sited as H.264 assumes where a stream says nothing: on the even columns, between two rows.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Plane = NDArray[np.uint8]
Row = NDArray[np.float32]


@njit(cache=True, nogil=True)
def _store(value: np.float32) -> np.uint8:
    return np.uint8(min(max(value, np.float32(0.0)), np.float32(255.0)) + np.float32(0.5))


@njit(cache=True, nogil=True)
def rgb_to_yuv420(rgb: Plane, matrix: NDArray[np.float32], y: Plane, u: Plane, v: Plane) -> None:
    """Convert uint8 (H, W, 3) RGB, H and W even, into planes (H, W), (H/2, W/2), (H/2, W/2).

    `matrix` is float32 (3, 4): rows Y, Cb, Cr; columns R, G, B, offset.
    """
    height, width = y.shape
    cb = np.empty(width + 6, np.float32)
    cr = np.empty(width + 6, np.float32)
    for j in range(height // 2):
        for row in (2 * j, 2 * j + 1):
            line, out = rgb[row], y[row]
            for x in range(width):
                red, green, blue = np.float32(line[x, 0]), np.float32(line[x, 1]), np.float32(line[x, 2])
                out[x] = _store(
                    matrix[0, 0] * red + matrix[0, 1] * green + matrix[0, 2] * blue + matrix[0, 3]
                )
        top, bottom = rgb[2 * j], rgb[2 * j + 1]
        for x in range(width):
            red = np.float32(0.5) * (np.float32(top[x, 0]) + np.float32(bottom[x, 0]))
            green = np.float32(0.5) * (np.float32(top[x, 1]) + np.float32(bottom[x, 1]))
            blue = np.float32(0.5) * (np.float32(top[x, 2]) + np.float32(bottom[x, 2]))
            cb[x + 3] = matrix[1, 0] * red + matrix[1, 1] * green + matrix[1, 2] * blue + matrix[1, 3]
            cr[x + 3] = matrix[2, 0] * red + matrix[2, 1] * green + matrix[2, 2] * blue + matrix[2, 3]
        _halve(cb, u[j])
        _halve(cr, v[j])


@njit(cache=True, nogil=True)
def _halve(line: Row, out: Plane) -> None:
    """Half-band filter (-1 0 9 16 9 0 -1)/32 at the even columns; `line` has 3 places of margin."""
    line[:3] = line[3]
    line[-3:] = line[-4]
    for i in range(out.shape[0]):
        x = 2 * i + 3
        out[i] = _store(
            np.float32(0.5) * line[x]
            + np.float32(0.28125) * (line[x - 1] + line[x + 1])
            - np.float32(0.03125) * (line[x - 3] + line[x + 3])
        )


@njit(cache=True, nogil=True)
def _double(near: Plane, far: Plane, half: Row, out: Row) -> None:
    """One luma row of chroma minus 128: rows 3:1, columns (-1 9 9 -1)/16 between the samples."""
    count = near.shape[0]
    for i in range(count):
        half[i + 1] = (
            np.float32(0.75) * np.float32(near[i]) + np.float32(0.25) * np.float32(far[i]) - np.float32(128.0)
        )
    half[0] = half[1]
    half[count + 1 :] = half[count]
    for i in range(count):
        out[2 * i] = half[i + 1]
        out[2 * i + 1] = np.float32(0.5625) * (half[i + 1] + half[i + 2]) - np.float32(0.0625) * (
            half[i] + half[i + 3]
        )


@njit(cache=True, nogil=True)
def yuv420_to_rgb(y: Plane, u: Plane, v: Plane, matrix: NDArray[np.float32], rgb: Plane) -> None:
    """Convert planes (H, W), (H/2, W/2), (H/2, W/2) into uint8 RGB of the size of `rgb` (cropped).

    `matrix` is float32 (6,): gain and offset of Y; then Cr to R, Cb to G, Cr to G, Cb to B.
    """
    height, width = rgb.shape[0], rgb.shape[1]
    gain, offset, red_cr, green_cb, green_cr, blue_cb = matrix
    half = np.empty(u.shape[1] + 3, np.float32)
    cb = np.empty(y.shape[1], np.float32)
    cr = np.empty(y.shape[1], np.float32)
    last = u.shape[0] - 1
    for row in range(height):
        near = row // 2
        far = min(max(near - 1 + 2 * (row % 2), 0), last)
        _double(u[near], u[far], half, cb)
        _double(v[near], v[far], half, cr)
        line, out = y[row], rgb[row]
        for x in range(width):
            luma = gain * np.float32(line[x]) + offset
            out[x, 0] = _store(luma + red_cr * cr[x])
            out[x, 1] = _store(luma + green_cb * cb[x] + green_cr * cr[x])
            out[x, 2] = _store(luma + blue_cb * cb[x])

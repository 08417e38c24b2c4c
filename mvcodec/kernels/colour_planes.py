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
def _byte(value: np.float32) -> np.uint8:
    # By way of 32 bits: only that is vectorised.
    return np.uint8(np.int32(min(max(value, np.float32(0.0)), np.float32(255.0)) + np.float32(0.5)))


@njit(cache=True, nogil=True)
def rgb_to_yuv420(channels: Plane, matrix: NDArray[np.float32], y: Plane, u: Plane, v: Plane) -> None:
    """Convert R, G and B, uint8 (3, H, W), H and W even, into planes (H, W), (H/2, W/2), (H/2, W/2).

    `matrix` is float32 (3, 4): rows Y, Cb, Cr; columns R, G, B, offset.
    """
    height, width = y.shape
    chroma = np.empty(width, np.float32)
    even, odd = np.empty(width // 2, np.float32), np.empty(width // 2 + 3, np.float32)
    for j in range(height // 2):
        top, bottom = channels[:, 2 * j], channels[:, 2 * j + 1]
        _luma_row(top, matrix[0], y[2 * j])
        _luma_row(bottom, matrix[0], y[2 * j + 1])
        _chroma_row(top, bottom, matrix[1], chroma)
        _halve(chroma, even, odd, u[j])
        _chroma_row(top, bottom, matrix[2], chroma)
        _halve(chroma, even, odd, v[j])


@njit(cache=True, nogil=True)
def _luma_row(channels: Plane, m: Row, out: Plane) -> None:
    red, green, blue = channels
    for x in range(out.shape[0]):
        value = m[0] * np.float32(red[x]) + m[1] * np.float32(green[x]) + m[2] * np.float32(blue[x]) + m[3]
        out[x] = _byte(value)


@njit(cache=True, nogil=True)
def _chroma_row(top: Plane, bottom: Plane, m: Row, out: Row) -> None:
    """The mean of two rows, Cb or Cr."""
    for x in range(out.shape[0]):
        red = np.float32(0.5) * (np.float32(top[0, x]) + np.float32(bottom[0, x]))
        green = np.float32(0.5) * (np.float32(top[1, x]) + np.float32(bottom[1, x]))
        blue = np.float32(0.5) * (np.float32(top[2, x]) + np.float32(bottom[2, x]))
        out[x] = m[0] * red + m[1] * green + m[2] * blue + m[3]


@njit(cache=True, nogil=True)
def _halve(line: Row, even: Row, odd: Row, out: Plane) -> None:
    """Half-band filter (-1 0 9 16 9 0 -1)/32 at the even columns; the ends are repeated.

    `even` and `odd` are room for as many numbers as come out, and for 3 more. Taken apart first, columns lie
    side by side in memory, as vector instructions want them.
    """
    count = out.shape[0]
    for i in range(count):
        even[i], odd[i + 2] = line[2 * i], line[2 * i + 1]
    odd[0] = odd[1] = line[0]
    odd[count + 2] = line[2 * count - 1]
    for i in range(count):
        out[i] = _byte(
            np.float32(0.5) * even[i]
            + np.float32(0.28125) * (odd[i + 1] + odd[i + 2])
            - np.float32(0.03125) * (odd[i] + odd[i + 3])
        )


@njit(cache=True, nogil=True)
def _double(near: Plane, far: Plane, half: Row, odd: Row, out: Row) -> None:
    """One luma row of chroma minus 128: rows 3:1, columns (-1 9 9 -1)/16 between the samples.

    `half` and `odd` are room for 3 numbers more than there are samples, and for as many.
    """
    count = near.shape[0]
    for i in range(count):
        half[i + 1] = (
            np.float32(0.75) * np.float32(near[i]) + np.float32(0.25) * np.float32(far[i]) - np.float32(128.0)
        )
    half[0] = half[1]
    half[count + 1 :] = half[count]
    for i in range(count):
        odd[i] = np.float32(0.5625) * (half[i + 1] + half[i + 2]) - np.float32(0.0625) * (
            half[i] + half[i + 3]
        )
    for i in range(count):  # the only loop that does not go through memory in order
        out[2 * i] = half[i + 1]
        out[2 * i + 1] = odd[i]


@njit(cache=True, nogil=True)
def yuv420_to_rgb(y: Plane, u: Plane, v: Plane, matrix: NDArray[np.float32], rgb: Plane) -> None:
    """Convert planes (H, W), (H/2, W/2), (H/2, W/2) into uint8 RGB of the size of `rgb` (cropped).

    `matrix` is float32 (6,): gain and offset of Y; then Cr to R, Cb to G, Cr to G, Cb to B.
    """
    height, width = rgb.shape[0], rgb.shape[1]
    gain, offset, red_cr, green_cb, green_cr, blue_cb = matrix
    half, odd = np.empty(u.shape[1] + 3, np.float32), np.empty(u.shape[1], np.float32)
    cb, cr = np.empty(y.shape[1], np.float32), np.empty(y.shape[1], np.float32)
    red, green, blue = np.empty(width, np.uint8), np.empty(width, np.uint8), np.empty(width, np.uint8)
    last = u.shape[0] - 1
    for row in range(height):
        near = row // 2
        far = min(max(near - 1 + 2 * (row % 2), 0), last)
        _double(u[near], u[far], half, odd, cb)
        _double(v[near], v[far], half, odd, cr)
        line, out = y[row], rgb[row].ravel()
        # Channels are put together last: only then is the rest compiled to vector instructions.
        for x in range(width):
            luma = gain * np.float32(line[x]) + offset
            red[x] = _byte(luma + red_cr * cr[x])
            green[x] = _byte(luma + green_cb * cb[x] + green_cr * cr[x])
            blue[x] = _byte(luma + blue_cb * cb[x])
        for x in range(width):
            out[3 * x], out[3 * x + 1], out[3 * x + 2] = red[x], green[x], blue[x]

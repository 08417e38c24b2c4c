"""RGB pictures <-> the codec's planes: the one place where colour is converted.

BT.709 matrix, limited range (luma 16..235, chroma 16..240), chroma on the even columns and
between rows, as players assume of a stream tagged like ours. Odd sizes are padded by repeating the
last row and column, and cropped again.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import Picture
from mvcodec.video.codec import Plane, Planes

KR, KB = 0.2126, 0.0722
"""BT.709's weights of red and blue in luma (ITU-R BT.709-6, table 3)."""

LUMA_SPAN, CHROMA_SPAN, LUMA_BLACK, CHROMA_ZERO = 219.0, 224.0, 16.0, 128.0


def even_size(width: int, height: int) -> tuple[int, int]:
    """Width and height as coded: the next even ones."""
    return width + width % 2, height + height % 2


def pad_to_even(plane: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """uint8 (H, W, ...) with the last row and column repeated where their count is odd."""
    height, width = plane.shape[:2]
    if height % 2 == 0 and width % 2 == 0:
        return np.ascontiguousarray(plane)
    margins = [(0, height % 2), (0, width % 2)] + [(0, 0)] * (plane.ndim - 2)
    return np.pad(plane, margins, mode="edge")


def forward_matrix() -> NDArray[np.float32]:
    """float32 (3, 4): rows Y, Cb, Cr; columns R, G, B, offset."""
    luma = np.array([KR, 1 - KR - KB, KB])
    cb = (np.array([0.0, 0.0, 1.0]) - luma) / (2 * (1 - KB))
    cr = (np.array([1.0, 0.0, 0.0]) - luma) / (2 * (1 - KR))
    rows = np.stack([luma * LUMA_SPAN, cb * CHROMA_SPAN, cr * CHROMA_SPAN]) / 255
    offsets = np.array([[LUMA_BLACK], [CHROMA_ZERO], [CHROMA_ZERO]])
    return np.hstack([rows, offsets]).astype(np.float32)


def inverse_matrix() -> NDArray[np.float32]:
    """float32 (6,): gain and offset of Y; then Cr to R, Cb to G, Cr to G, Cb to B."""
    gain, chroma, kg = 255 / LUMA_SPAN, 255 / CHROMA_SPAN, 1 - KR - KB
    red_cr, blue_cb = 2 * (1 - KR) * chroma, 2 * (1 - KB) * chroma
    values = [gain, -gain * LUMA_BLACK, red_cr, -blue_cb * KB / kg, -red_cr * KR / kg, blue_cb]
    return np.array(values, np.float32)


_FORWARD, _INVERSE = forward_matrix(), inverse_matrix()


def to_planes(picture: Picture) -> Planes:
    """Convert uint8 (H, W, 3) RGB into planes of the next even size."""
    from mvcodec.kernels.colour_planes import rgb_to_yuv420

    rgb = pad_to_even(picture)
    height, width = rgb.shape[:2]
    y = np.empty((height, width), np.uint8)
    u = np.empty((height // 2, width // 2), np.uint8)
    v = np.empty_like(u)
    channels = np.empty((3, height, width), np.uint8)
    cv2.split(rgb, list(channels))
    rgb_to_yuv420(channels, _FORWARD, y, u, v)
    return Planes(y, u, v)


def to_picture(planes: Planes, width: int, height: int) -> Picture:
    """Convert planes into uint8 (height, width, 3) RGB, cropping what was padded."""
    from mvcodec.kernels.colour_planes import yuv420_to_rgb

    rgb = np.empty((height, width, 3), np.uint8)
    yuv420_to_rgb(planes.y, planes.u, planes.v, _INVERSE, rgb)
    return rgb


def grey_planes(luma: Plane) -> Planes:
    """Planes of the next even size that carry `luma`, uint8 (H, W), as it is, and no colour."""
    y = pad_to_even(luma)
    chroma = np.full((y.shape[0] // 2, y.shape[1] // 2), int(CHROMA_ZERO), np.uint8)
    return Planes(y, chroma, chroma)

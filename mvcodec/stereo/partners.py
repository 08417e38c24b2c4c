"""Which real cameras are beside which, and where in a camera's picture none of those sees anything."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import FloatMap, Mask


def _around(array: CameraArray, camera: Position, *, diagonal: bool) -> list[Position]:
    row, col = array.real_rows.index(camera[0]), array.real_cols.index(camera[1])
    found = []
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            beside = (down == 0) != (across == 0) or (diagonal and down != 0 and across != 0)
            if beside and 0 <= row + down < len(array.real_rows) and 0 <= col + across < len(array.real_cols):
                found.append((array.real_rows[row + down], array.real_cols[col + across]))
    return found


def partners(array: CameraArray, camera: Position) -> list[Position]:
    """The real cameras beside, above and below a camera."""
    return _around(array, camera, diagonal=False)


def neighbours(array: CameraArray, camera: Position) -> list[Position]:
    """The partners of a camera and those across the corners of its cells."""
    return _around(array, camera, diagonal=True)


def steps(array: CameraArray, camera: Position, others: list[Position]) -> NDArray[np.float32]:
    """float32 (P, 2): what a pixel moves (left, up) for each px of disparity, from camera to each other."""
    return np.array([array.shift_per_disparity(camera, Viewpoint(*other)) for other in others], np.float32)


def unseen_border(array: CameraArray, camera: Position, range_px: tuple[float, float]) -> Mask:
    """bool (H, W): where the nearest disparity leaves every partner's picture."""
    return outside(array, camera, np.full((array.height, array.width), range_px[1], np.float32))


def outside(array: CameraArray, camera: Position, disparity: FloatMap) -> Mask:
    """bool (H, W): where a pixel of this disparity leaves every partner's picture."""
    unseen = np.ones((array.height, array.width), np.bool_)
    x, y = np.arange(array.width)[None], np.arange(array.height)[:, None]
    for by_x, by_y in steps(array, camera, partners(array, camera)):
        there_x, there_y = x - by_x * disparity, y - by_y * disparity
        unseen &= (there_x < 0) | (there_x >= array.width) | (there_y < 0) | (there_y >= array.height)
    return unseen

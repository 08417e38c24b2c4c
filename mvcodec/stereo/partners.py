"""Which real cameras are beside which, and where in a camera's picture none of those sees anything."""

from __future__ import annotations

import math

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
    shifts = [array.shift_per_disparity(camera, Viewpoint(*other)) for other in others]
    return np.array(shifts, np.float32).reshape(-1, 2)


def unseen_border(array: CameraArray, camera: Position, range_px: tuple[float, float]) -> Mask:
    """bool (H, W): where the nearest disparity leaves every partner's picture."""
    height, width = array.height, array.width
    unseen = np.ones((height, width), np.bool_)
    for by_x, by_y in steps(array, camera, partners(array, camera)):
        left, up = float(by_x) * range_px[1], float(by_y) * range_px[1]
        # Columns with 0 <= x - left < width, and rows likewise.
        columns = slice(max(math.ceil(left), 0), max(math.ceil(width + left), 0))
        rows = slice(max(math.ceil(up), 0), max(math.ceil(height + up), 0))
        unseen[rows, columns] = False
    return unseen


def outside(array: CameraArray, camera: Position, disparity: FloatMap) -> Mask:
    """bool (H, W): where a pixel of this disparity leaves every partner's picture."""
    from mvcodec.kernels.table import kernel

    found: Mask = kernel("completion.unseen")(disparity, steps(array, camera, partners(array, camera)))
    return found

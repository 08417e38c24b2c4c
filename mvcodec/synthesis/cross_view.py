"""Real cameras' pictures with less coding noise: the other cameras see the same surfaces.

Each camera is coded by itself, so what coding spoils in one is nearly independent of what it spoils in
another. The others' pictures, moved to a camera's place by its own disparity map, are a second opinion of
each pixel. With own error e and a mean squared difference D between both, their best mean gives the second
one e / D of the weight, as in a Wiener filter. e is what the stream's header says, D is measured around each
pixel: where the second opinion is bad, D is large and the picture stays as it is.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DecodedSet, Picture
from mvcodec.synthesis.fetch_sources import Sources
from mvcodec.workers import run_in_bands

WINDOW_PX = 9
STRENGTH = 0.5
"""How much of the coding error counts by default: errors of cameras are not quite independent."""

MOST = 0.7
"""The largest weight of the other cameras."""

TOLERANCE_PX, EDGE_TRUST, SHARPNESS = 1.5, 0.5, -0.7
"""As the defaults of `LayeredSettings`."""


def can_be_filtered(decoded: DecodedSet, camera: Position) -> bool:
    """Whether a real camera's coding error is known, and another camera is beside it."""
    known = decoded.coding_error is not None and camera not in decoded.absent
    return known and bool(_around(decoded, camera))


def filter_picture(decoded: DecodedSet, camera: Position, sources: Sources, strength: float) -> Picture:
    """A real camera's picture with less coding noise, uint8 (H, W, 3) RGB.

    Args:
        camera: `can_be_filtered`.
        sources: of `decoded`.
        strength: how much of `decoded.coding_error` counts, since errors are not quite independent; 0: the
            picture as it was decoded.
    """
    from mvcodec.kernels import view_vectors
    from mvcodec.kernels.table import kernel

    assert decoded.coding_error is not None
    array, own = decoded.array, decoded.pictures[camera]
    around = _around(decoded, camera)
    sources.prepare(around, TOLERANCE_PX)
    shifts = [array.shift_per_disparity(other, Viewpoint(*camera)) for other in around]
    weights = [1 / (sources.spread + _distance(array, camera, other)) for other in around]
    others, seen_by = np.empty_like(own), np.empty(own.shape[:2], np.uint8)
    run_in_bands(
        array.height,
        kernel("view_colour.blend"),
        np.array([array.real.index(other) for other in around]),
        sources.planes,
        np.array(shifts, np.float32),
        np.array(weights, np.float32),
        decoded.disparities[camera].values_px,
        TOLERANCE_PX,
        EDGE_TRUST,
        SHARPNESS,
        view_vectors.fetch_weights(SHARPNESS),
        others,
        seen_by,
    )
    squares, counts = _squares_around(own, others, seen_by)
    pixels: Picture = np.empty_like(own)
    error = strength * decoded.coding_error
    run_in_bands(
        array.height, kernel("camera_mixing.mix"), own, others, seen_by, squares, counts, error, MOST, pixels
    )
    return pixels


def _around(decoded: DecodedSet, camera: Position) -> tuple[Position, ...]:
    """The real cameras beside this one, at most one step away each way, that have pictures of their own."""
    array = decoded.array
    return tuple(
        other
        for other in array.real
        if other != camera
        and other not in decoded.absent
        and abs(other[0] - camera[0]) <= array.row_step
        and abs(other[1] - camera[1]) <= array.col_step
    )


def _distance(array: CameraArray, one: Position, other: Position) -> float:
    """Squared, in cells."""
    across = (one[1] - other[1]) / array.col_step if array.col_step else 0.0
    down = (one[0] - other[0]) / array.row_step if array.row_step else 0.0
    return across**2 + down**2


def _squares_around(
    own: Picture, others: Picture, seen_by: NDArray[np.uint8]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Squared differences of luma summed around each pixel, and how many pixels they are of; see `mix`."""
    luma, seen = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (own, others))
    known = np.minimum(seen_by, 1)
    difference = (cv2.absdiff(luma, seen) * known).astype(np.uint16)
    # Whole numbers below 2^24, which float32 holds: the sums don't depend on their order.
    squares, counts = (
        cv2.boxFilter(
            each, cv2.CV_32F, (WINDOW_PX, WINDOW_PX), normalize=False, borderType=cv2.BORDER_CONSTANT
        )
        for each in (difference * difference, known)
    )
    return np.asarray(squares, np.float32), np.asarray(counts, np.float32)

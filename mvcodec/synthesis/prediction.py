"""The picture that predicts another one: rendered from decoded planes and maps, the same bits everywhere.

Encoder and decoder both call this; FORMAT.md ("Predicted pictures") says what comes out, for other decoders.
All is whole numbers. `Layered` renders better pictures to look at; it may change, and this may not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.video.codec import Plane, Planes
from mvcodec.workers import run_all, run_in_bands

FINE = 64
"""Disparity is counted in these parts of a pixel."""

SPREAD = 205
"""1024ths of a squared cell; a camera at distance b counts 1 / (SPREAD + 1024 b^2)."""

IntMap = NDArray[np.int32]


def fine_disparities(codes: Plane, range_px: tuple[float, float]) -> IntMap:
    """Code values of a map as whole 64ths of a pixel: floor(64 (lo + c (hi - lo) / 255) + 1/2)."""
    low, high = range_px
    table = np.floor(FINE * (low + np.arange(256) * (high - low) / 255) + 0.5).astype(np.int32)
    return table[codes]


@dataclass(frozen=True, eq=False)
class PredictionSource:
    """A decoded camera (or view) that predictions are made from.

    Attributes:
        place: where it stands.
        planes: as decoded, even sizes.
        disparity: int32 (H, W) of the planes' size, 64ths of a pixel.
    """

    place: Position
    planes: Planes
    disparity: IntMap

    @cached_property
    def ready(self) -> tuple[IntMap, IntMap, IntMap]:
        """Luma, chroma and disparity as `mvcodec.kernels.prediction_planes` prepares them."""
        from mvcodec.kernels.prediction_planes import BORDER, pair_chroma, pair_luma, widen_map
        from mvcodec.kernels.view_planes import reserve

        luma, chroma, own = (
            reserve((height + 2 * BORDER, width + 2 * BORDER), np.dtype(np.int32))
            for height, width in (self.planes.y.shape, self.planes.u.shape, self.disparity.shape)
        )
        pair_luma(self.planes.y, luma)
        pair_chroma(self.planes.u, self.planes.v, chroma)
        widen_map(self.disparity, own)
        return luma, chroma, own


def full_map(codes: Plane, luma: Plane, range_px: tuple[float, float], scale: int) -> IntMap:
    """A decoded map at the size of its picture's planes, 64ths of a pixel.

    Args:
        codes: uint8, the map's luma as decoded.
        luma: uint8 (H, W), the picture's as decoded.
        scale: the header's `disparity_scale`.
    """
    from mvcodec.kernels.prediction_depth import enlarge

    height, width = luma.shape
    small = fine_disparities(codes, range_px)
    if scale == 1:
        return small
    found = np.empty((height, width), np.int32)
    enlarge(np.ascontiguousarray(small[: height // 2, : width // 2]), luma, found)
    return found


def predicted_disparity(
    array: CameraArray,
    maps: Mapping[Position, IntMap],
    place: Position,
    range_px: tuple[float, float],
) -> IntMap:
    """Disparity at a place from the maps of cameras around it: moved there, put to the vote, filled."""
    from mvcodec.kernels.prediction_depth import MARGIN, fill, splat, vote

    cameras = sorted(maps)
    height, width = next(iter(maps.values())).shape
    moved = np.empty((len(cameras), height + 2, width + 2 * MARGIN), np.int32)
    shifts = zip(*(_shift(array, camera, place) for camera in cameras), strict=True)
    run_all(splat, [maps[camera] for camera in cameras], *shifts, moved)
    voted, found = np.empty((height, width), np.float32), np.empty((height, width), np.int32)
    run_in_bands(height, vote, moved, _weights(array, cameras, place), voted)
    lowest = fine_disparities(np.zeros((1, 1), np.uint8), range_px)
    run_in_bands(height, fill, cv2.medianBlur(voted, 3), int(lowest[0, 0]), found)
    return found


def predict(
    array: CameraArray,
    sources: Sequence[PredictionSource],
    place: Position,
    disparity: IntMap,
) -> Planes:
    """The planes of a place, predicted from the sources that see each pixel.

    Args:
        disparity: int32 (H, W) at the place, see `predicted_disparity`; or the place's own decoded map.
    """
    from mvcodec.kernels.prediction_colour import predict as predict_rows

    ordered = sorted(sources, key=lambda source: source.place)
    places = [source.place for source in ordered]
    shifts = np.array([_shift(array, camera, place) for camera in places], np.int32)
    weights = _weights(array, places, place)
    height, width = disparity.shape
    y = np.empty((height, width), np.uint8)
    chroma = np.empty((2, height // 2, width // 2), np.uint8)
    ready = [source.ready for source in ordered]  # held until all is done: the kernel knows addresses alone
    run_in_bands(height // 2, predict_rows, addresses(ready), shifts, weights, disparity, y, chroma)
    return Planes(y, chroma[0], chroma[1])


def addresses(ready: Sequence[tuple[IntMap, ...]]) -> NDArray[np.int64]:
    """Where planes with a border have their first pixels: int64 (N, 3) of N sources' `ready`."""
    from mvcodec.kernels.prediction_planes import BORDER

    return np.array([[plane[BORDER:, BORDER:].ctypes.data for plane in each] for each in ready], np.int64)


def _shift(array: CameraArray, camera: Position, place: Position) -> tuple[int, int]:
    """What a pixel moves (left, up) from a camera to a place, 65536ths of a pixel for each of disparity."""
    right, down = array.shift_per_disparity(camera, Viewpoint(*place))
    return int(np.floor(65536 * right + 0.5)), int(np.floor(65536 * down + 0.5))


def _weights(array: CameraArray, cameras: Sequence[Position], place: Position) -> NDArray[np.int64]:
    def weight(camera: Position) -> int:
        across = (place[1] - camera[1]) / array.col_step if array.col_step else 0.0
        down = (place[0] - camera[0]) / array.row_step if array.row_step else 0.0
        return (1 << 20) // (SPREAD + int(1024 * (across * across + down * down) + 0.5))

    return np.array([max(weight(camera), 1) for camera in cameras], np.int64)

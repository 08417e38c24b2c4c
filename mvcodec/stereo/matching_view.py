"""A picture made ready for matching: planes, census and what lies between its pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import FloatMap, Picture
from mvcodec.workers import run_all


@dataclass(frozen=True, slots=True, eq=False)
class MatchingView:
    """What matching needs of a picture.

    Attributes:
        planes: float32 (3, H, W), RGB, grey levels at the brightness of the other cameras.
        grey: float32 (H, W), the same in luma.
        census: uint64 (H, W), see `mvcodec.kernels.census`.
        across, down: float32 (2, 3, H, W), least and greatest value within half a pixel along the baselines
            (`semiglobal.sampling_interval`); None where the array has no such baseline.
    """

    planes: NDArray[np.float32]
    grey: FloatMap
    census: NDArray[np.uint64]
    across: NDArray[np.float32] | None
    down: NDArray[np.float32] | None


def prepare_views(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    gains: Mapping[Position, NDArray[np.float32]],
) -> dict[Position, MatchingView]:
    """The real cameras' pictures, side by side.

    Args:
        gains: float32 (3,) of each camera, what its R, G and B are multiplied by.
    """
    views = run_all(lambda camera: _prepare(array, pictures[camera], gains[camera]), array.real)
    return dict(zip(array.real, views, strict=True))


def _prepare(array: CameraArray, picture: Picture, gain: NDArray[np.float32]) -> MatchingView:
    from mvcodec.kernels import census, semiglobal

    planes = np.ascontiguousarray(picture.transpose(2, 0, 1)).astype(np.float32)
    grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)
    level = grey.astype(np.float32)
    if np.any(gain != 1):
        planes *= gain[:, None, None]
        level = np.asarray(cv2.cvtColor(planes.transpose(1, 2, 0), cv2.COLOR_RGB2GRAY), np.float32)
    return MatchingView(
        planes,
        level,
        census.census_transform(grey, 4, 3),
        semiglobal.sampling_interval(planes, 1, 0) if array.col_step else None,
        semiglobal.sampling_interval(planes, 0, 1) if array.row_step else None,
    )

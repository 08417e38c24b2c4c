"""The pictures of an array made ready for matching: planes, census and what lies between pixels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import Picture
from mvcodec.stereo.joint_settings import JointSettings
from mvcodec.stereo.partners import partners, steps
from mvcodec.workers import run_all

NOISE_LEVELS = 2.0
"""Grey levels over two pixels that are no detail."""


@dataclass(frozen=True, slots=True, eq=False)
class MatchingViews:
    """What matching needs of the pictures of N cameras. Rows of all planes stand side by side in memory.

    All but `grey` have columns beyond both ends of a row: W'' of them, see `matching_costs.joint_costs`.

    Attributes:
        cameras: in the order of the arrays.
        planes: uint8 (N, H, C, W''), RGB at equal brightness, or luma alone.
        grey: uint8 (N, H, W), the same in luma.
        census: uint8 (N, H, B, W''), see `mvcodec.kernels.census.census_rows`.
        bounds: uint8 (2, N, H, 2, C, W''), least and greatest value within half a pixel along rows and along
            columns (`matching_costs.sampling_interval`), of the cameras that are partners so.
        blind: uint8 (N, 2, H, W''), what matches along rows and along columns cost more (`blindness`).
    """

    cameras: Sequence[Position]
    planes: NDArray[np.uint8]
    grey: NDArray[np.uint8]
    census: NDArray[np.uint8]
    bounds: NDArray[np.uint8]
    blind: NDArray[np.uint8]

    def grey_of(self, camera: Position) -> NDArray[np.uint8]:
        """uint8 (H, W)."""
        return np.asarray(self.grey[self.cameras.index(camera)])


def _evened(picture: Picture, gains: NDArray[np.float32]) -> Picture:
    if np.all(gains == 1):
        return picture
    return np.asarray(np.rint(picture * gains).clip(0, 255), np.uint8)


def equal_grey(picture: Picture, gains: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Luma of a picture whose R, G and B are multiplied by their gains, uint8 (H, W)."""
    return np.asarray(cv2.cvtColor(_evened(picture, gains), cv2.COLOR_RGB2GRAY), np.uint8)


def blindness(grey: NDArray[np.uint8], radii: tuple[int, int], cost: int) -> NDArray[np.uint8]:
    """How much dearer a match along rows, and one along columns, is than it seems.

    An edge that runs along the baseline matches at every disparity. Such a match says nothing, and must not
    outvote the partner across the edge.

    Args:
        grey: uint8 (H, W).
        radii: half the size of the window that counts, px along rows and along columns.
        cost: where there is no detail in the one direction at all, while there is in the other.

    Returns:
        uint8 (2, H, W): up to `cost`, the less slopes square up to along the one direction than along the
        other.
    """
    window = 2 * radii[0] + 1, 2 * radii[1] + 1
    framed = cv2.copyMakeBorder(grey, 1, 1, 1, 1, cv2.BORDER_REFLECT_101)
    beside, above = framed[1:-1], framed[:, 1:-1]
    slopes = cv2.absdiff(beside[:, 2:], beside[:, :-2]), cv2.absdiff(above[2:], above[:-2])
    squares = [cv2.sqrBoxFilter(slope, cv2.CV_32F, window) + np.float32(NOISE_LEVELS**2) for slope in slopes]
    found = np.empty((2, *grey.shape), np.uint8)
    for own, other, out in zip(squares, squares[::-1], found, strict=True):
        cv2.convertScaleAbs(np.maximum(1 - cv2.divide(own, other), 0), out, cost)
    return found


def prepare_views(
    array: CameraArray,
    pictures: Mapping[Position, Picture],
    gains: Mapping[Position, NDArray[np.float32]],
    cameras: Sequence[Position],
    census_radii: tuple[int, int],
    blind_cost: int,
    *,
    colours: bool = True,
) -> MatchingViews:
    """The real cameras' pictures, side by side.

    Args:
        gains: float32 (3,) of each camera, what its R, G and B are multiplied by.
        cameras: the ones to be matched.
        census_radii: of the census's window, px along rows and along columns.
        blind_cost: see `blindness`.
        colours: whether colours are compared, else luma alone.
    """
    from mvcodec.kernels.byte_vectors import LANES
    from mvcodec.kernels.table import kernel

    count, height, width = len(array.real), array.height, array.width
    channels = 3 if colours else 1
    radius_x, radius_y = census_radii
    words = -(-((2 * radius_x + 1) * (2 * radius_y + 1) - 1) // 8)
    padded, inside = LANES * (2 - -width // LANES), slice(LANES, LANES + width)
    found = MatchingViews(
        array.real,
        np.empty((count, height, channels, padded), np.uint8),
        np.empty((count, height, width), np.uint8),
        np.empty((count, height, words, padded), np.uint8),
        np.empty((2, count, height, 2, channels, padded), np.uint8),
        np.zeros((count, 2, height, padded), np.uint8),
    )
    beside = {(camera[0] == other[0], other) for camera in cameras for other in partners(array, camera)}

    def prepare(number: int) -> None:
        camera = array.real[number]
        picture = _evened(pictures[camera], gains[camera])
        grey = found.grey[number]
        cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY, grey)
        planes = np.ascontiguousarray(picture.transpose(0, 2, 1)) if colours else grey[:, None]
        found.planes[number][..., inside] = planes
        bits = np.empty((height, words, width), np.uint8)
        kernel("census.census_rows")(grey, radius_x, radius_y, bits)
        found.census[number][..., inside] = bits
        bounds = np.empty((height, 2, channels, width), np.uint8)
        for side, along_rows in enumerate((True, False)):
            if (along_rows, camera) in beside:
                kernel("matching_costs.sampling_interval")(planes, along_rows, bounds)
                found.bounds[side, number][..., inside] = bounds
        if blind_cost and len(array.real_rows) > 1 and len(array.real_cols) > 1:
            found.blind[number][..., inside] = blindness(grey, census_radii, blind_cost)

    run_all(prepare, range(count))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class CameraPartners:
    """A camera among the others of `MatchingViews`, in the form of `matching_costs.joint_costs`.

    Attributes:
        camera, partners: their numbers; int64 (P,).
        across: bool (P,), whether a partner stands in the camera's row.
        steps: float32 (P, 2), see `partners.steps`.
    """

    camera: int
    partners: NDArray[np.int64]
    across: NDArray[np.bool_]
    steps: NDArray[np.float32]

    @classmethod
    def of(cls, array: CameraArray, camera: Position) -> CameraPartners:
        """The partners beside, above and below a camera."""
        beside = partners(array, camera)
        return cls(
            array.real.index(camera),
            np.array([array.real.index(other) for other in beside]),
            np.array([other[0] == camera[0] for other in beside]),
            steps(array, camera, beside),
        )


def comparison(
    array: CameraArray, those: CameraPartners, views: MatchingViews, low: int, settings: JointSettings
) -> Callable[[NDArray[np.int64], NDArray[np.uint8]], None]:
    """What writes the costs of a camera; see places and volume of `matching_costs.joint_costs`.

    Args:
        low: disparity of level 0, px.
    """
    from mvcodec.kernels.table import kernel

    def compare(places: NDArray[np.int64], volume: NDArray[np.uint8]) -> None:
        kernel("matching_costs.joint_costs")(
            those.camera,
            those.partners,
            views.planes,
            views.census,
            those.across,
            views.bounds,
            views.blind[those.camera],
            array.width,
            those.steps,
            low,
            settings.colour_limit,
            settings.bit_cost,
            settings.most_bits,
            settings.lone_cost,
            settings.outside_cost,
            places,
            volume,
        )

    return compare

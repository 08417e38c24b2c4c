"""Pictures of a rig's cameras -> pictures of the rectified array, by maps that are made once."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.capture.source import ArraySource
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FrameSet, Mask, Picture
from mvcodec.rigs.rig import Lens, Rectified, Rig, RigCamera

INTERPOLATIONS = {"cubic": cv2.INTER_CUBIC, "lanczos": cv2.INTER_LANCZOS4}
DEFAULT_INTERPOLATION = "lanczos"

SHARPENING = 0.06
"""Interpolation between pixels takes some of the finest detail, in rectified pictures and again in views made
from them. That much of each pixel's difference from its neighbours is given back, by docs/measurements.md."""

_WHOLE_PX = 1 / 64
"""OpenCV interpolates at 32nds of a pixel: maps that are so near to whole ones take nothing."""

_WIDEST_SLOPE, _SLOPES = 4.0, 2000

Vectors = NDArray[np.float64]


def project(lens: Lens, rays: Vectors) -> Vectors:
    """(N, 2): the pixels of directions (N, 3) in the camera's axes, by OpenCV.

    Far away for what is behind the camera, or so far aside that the lens's polynomial turns back.
    """
    zero = np.zeros(3)
    coefficients = np.array(lens.coefficients)
    aside = np.hypot(rays[:, 0], rays[:, 1]) < widest_slope(lens) * rays[:, 2]
    there = np.where(((rays[:, 2] > 1e-3) & aside)[:, None], rays, (1e3, 1e3, 1.0))[:, None]
    if lens.model == "fisheye":
        pixels, _ = cv2.fisheye.projectPoints(there, zero, zero, lens.matrix, coefficients)
    else:
        pixels, _ = cv2.projectPoints(there, zero, zero, lens.matrix, coefficients)
    return np.asarray(pixels, np.float64).reshape(-1, 2)


def widest_slope(lens: Lens) -> float:
    """The slope of a ray up to which the lens shows rays that are farther aside farther aside."""
    slopes = np.linspace(0, _WIDEST_SLOPE, _SLOPES)
    if lens.model == "fisheye":
        slopes = np.tan(np.linspace(0, np.arctan(1e3), _SLOPES))
        angle = np.arctan(slopes)
        square = angle * angle
        k1, k2, k3, k4 = lens.coefficients
        shown = angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))
    else:
        k1, k2, _, _, k3, k4, k5, k6 = (*lens.coefficients, *[0.0] * 4)[:8]
        square = slopes * slopes
        over, under = (
            1 + square * (a + square * (b + square * c)) for a, b, c in ((k1, k2, k3), (k4, k5, k6))
        )
        shown = slopes * over / under
    falls = np.nonzero(np.diff(shown) <= 0)[0]
    return float(slopes[falls[0]]) if len(falls) else 1e3


def source_places(camera: RigCamera, at: Position, view: Rectified, pixels: Vectors) -> Vectors:
    """(N, 2): where a camera's picture shows the pixels (N, 2) of its rectified one.

    A camera that stands beside its place on the grid shows things moved, the nearer the more. That is
    made up for at the typical inverse depth, and left as it is elsewhere.
    """
    slopes = (pixels - view.centre_px) / view.focal_px
    beside = camera.place - (at[1], at[0] * view.rho, 0.0)
    rays = np.column_stack([slopes, np.ones(len(slopes))]) - beside * view.typical_w
    return project(camera.lens, rays @ camera.turn.T)


def rectifying_maps(
    camera: RigCamera, at: Position, view: Rectified
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """float32 (H, W) each: x and y in the camera's picture of every pixel of the rectified one."""
    y, x = np.mgrid[: view.height, : view.width]
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
    found = source_places(camera, at, view, pixels).astype(np.float32)
    return found[:, 0].reshape(x.shape), found[:, 1].reshape(x.shape)


class Rectifier:
    """Rectifies pictures of a rig.

    Args:
        rig: its calibration.
        interpolation: one of INTERPOLATIONS.
        match_colours: apply the rig's gains and offsets.

    Raises:
        SettingError: no such interpolation.
    """

    def __init__(
        self, rig: Rig, interpolation: str = DEFAULT_INTERPOLATION, *, match_colours: bool = True
    ) -> None:
        if interpolation not in INTERPOLATIONS:
            raise SettingError("interpolation", interpolation, " | ".join(INTERPOLATIONS))
        self.rig, self._flag = rig, INTERPOLATIONS[interpolation]
        self._maps = {at: rectifying_maps(camera, at, rig.rectified) for at, camera in rig.cameras.items()}
        self._between = {at: any(_between_pixels(each) for each in maps) for at, maps in self._maps.items()}
        self._tables = {at: _table(camera) if match_colours else None for at, camera in rig.cameras.items()}

    def picture(self, at: Position, picture: Picture) -> Picture:
        """uint8 (H, W, 3) RGB of camera `at`, rectified; black where the camera sees nothing."""
        table = self._tables[at]
        if table is not None:
            picture = np.asarray(cv2.LUT(picture, table), np.uint8)
        if self._between[at]:
            kernel = np.array([-SHARPENING / 2, 1 + SHARPENING, -SHARPENING / 2])
            picture = np.asarray(cv2.sepFilter2D(picture, -1, kernel, kernel), np.uint8)
        x, y = self._maps[at]
        return np.asarray(cv2.remap(picture, x, y, self._flag, borderMode=cv2.BORDER_CONSTANT), np.uint8)

    def valid(self, at: Position) -> Mask:
        """bool (H, W): where the rectified picture of camera `at` shows what the camera saw."""
        width, height = self.rig.source_size
        x, y = self._maps[at]
        return np.asarray((x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1))


def _between_pixels(places: NDArray[np.float32]) -> bool:
    return bool(np.abs(places - np.rint(places)).max() > _WHOLE_PX)


def _table(camera: RigCamera) -> Picture | None:
    """uint8 (1, 256, 3): what each value of a channel becomes; None where all stay."""
    if np.allclose(camera.gain, 1, atol=1e-4) and np.allclose(camera.offset, 0, atol=1e-2):
        return None
    values = np.arange(256)[:, None] * camera.gain + camera.offset
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)[None]


class RectifiedSource:
    """An ArraySource whose pictures are rectified as they are read.

    Args:
        source: the input as the cameras saw it.
        rectifier: of its rig.

    Raises:
        SettingError: the rig is another one's.
    """

    def __init__(self, source: ArraySource, rectifier: Rectifier) -> None:
        self.array = rectifier.rig.array(source.array)
        self.name, self.frame_count = source.name, source.frame_count
        self.first_frame, self.listed_real = source.first_frame, source.listed_real
        # Maps belong to the pictures as they were.
        self.has_given = False
        self._source, self._rectifier = source, rectifier

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        """See ArraySource."""
        for frame_set in self._source.frame_sets(frames, views):
            yield rectified(frame_set, self._rectifier)

    def truth(self, view: Position, frame: int) -> DisparityMap | None:
        """See ArraySource: nobody knows it of a rig's pictures."""
        del view, frame
        return None


def rectified(frame_set: FrameSet, rectifier: Rectifier) -> FrameSet:
    """A frame set with rectified pictures."""
    pictures = {at: rectifier.picture(at, picture) for at, picture in frame_set.pictures.items()}
    return FrameSet(frame_set.index, frame_set.time_ns, pictures)

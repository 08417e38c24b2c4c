"""A scene of textured planes that face the cameras, rendered exactly at whole shifts for any grid.

Each plane is an opaque rectangle with a random texture of its own; the farthest covers everything. A plane
of disparity d (px of one cell) is seen `d * b_col` px to the left and `rho * d * b_row` px up of where the
upper left camera sees it; disparities are chosen so that these are whole numbers at every place used.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.frames import DecodedSet, DisparityMap, FloatMap, Mask, Picture

MARGIN = 200


@dataclass(frozen=True)
class Plane:
    """A rectangle (top, left, bottom, right) in the upper left camera's picture, at a disparity (px)."""

    disparity_px: int
    box: tuple[int, int, int, int]


@dataclass(frozen=True)
class PlaneScene:
    """Planes, farthest first, before a background of `background_px`."""

    array: CameraArray
    background_px: int
    planes: tuple[Plane, ...] = ()
    seed: int = 0
    textures: list[Picture] = field(default_factory=list)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        shape = (self.array.height + 2 * MARGIN, self.array.width + 2 * MARGIN, 3)
        self.textures.extend(rng.integers(1, 256, shape, dtype=np.uint8) for _ in range(1 + len(self.planes)))

    def render(self, viewpoint: Viewpoint) -> tuple[Picture, FloatMap]:
        """The exact picture and disparity at a viewpoint."""
        height, width = self.array.height, self.array.width
        per_col, per_row = self.array.shift_per_disparity((0, 0), viewpoint)
        everywhere = Plane(self.background_px, (-MARGIN, -MARGIN, height + MARGIN, width + MARGIN))
        picture = np.zeros((height, width, 3), np.uint8)
        disparity = np.zeros((height, width), np.float32)
        for texture, plane in zip(self.textures, (everywhere, *self.planes), strict=True):
            right, down = per_col * plane.disparity_px, per_row * plane.disparity_px
            assert right == round(right)
            assert down == round(down)
            y, x = np.mgrid[:height, :width]
            y, x = y + round(down), x + round(right)
            top, left, bottom, end = plane.box
            inside = (y >= top) & (y < bottom) & (x >= left) & (x < end)
            picture[inside] = texture[y[inside] + MARGIN, x[inside] + MARGIN]
            disparity[inside] = plane.disparity_px
        return picture, disparity

    def decoded(self) -> DecodedSet:
        """The real cameras' pictures with exact maps, every pixel valid."""
        views = {camera: self.render(Viewpoint(*camera)) for camera in self.array.real}
        every = np.ones((self.array.height, self.array.width), np.bool_)
        depths = [self.background_px, *(plane.disparity_px for plane in self.planes)]
        return DecodedSet(
            self.array,
            index=0,
            time_ns=0,
            pictures={camera: picture for camera, (picture, _) in views.items()},
            disparities={camera: DisparityMap(disparity, every) for camera, (_, disparity) in views.items()},
            disparity_range_px=(min(depths) - 1, max(depths) + 1),
        )

    def seen_from(self, viewpoint: Viewpoint, camera: tuple[int, int]) -> Mask:
        """bool (H, W): which pixels at `viewpoint` show a point that `camera` sees too."""
        _, here = self.render(viewpoint)
        _, there = self.render(Viewpoint(*camera))
        per_col, per_row = self.array.shift_per_disparity(camera, viewpoint)
        y, x = np.mgrid[: here.shape[0], : here.shape[1]]
        x_there = np.rint(x + per_col * here).astype(int)
        y_there = np.rint(y + per_row * here).astype(int)
        inside = (x_there >= 0) & (x_there < here.shape[1]) & (y_there >= 0) & (y_there < here.shape[0])
        same = there[y_there.clip(0, here.shape[0] - 1), x_there.clip(0, here.shape[1] - 1)] == here
        return np.asarray(inside & same, np.bool_)


def grid(
    rows: int, cols: int, width: int, height: int, *, step: int = 1, rho: float = 1.0, row_step: int = 0
) -> CameraArray:
    """A dense grid of rows x cols with a real camera every `step` columns and `row_step` (or `step`) rows."""
    return CameraArray(
        rows,
        cols,
        width,
        height,
        15.0,
        tuple(range(0, rows, row_step or step)),
        tuple(range(0, cols, step)),
        Calibration.nominal(width, height),
        rho=rho,
    )

"""A scene of two flat textured planes, seen by any array, with its exact disparity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.frames import FloatMap, FrameSet, Picture


def linear_or_grid(
    rows: int, cols: int, width: int, height: int, *, rho: float = 1.0, name: str = "planes"
) -> CameraArray:
    """An array whose cameras are all real."""
    return CameraArray(
        rows,
        cols,
        width,
        height,
        fps=15.0,
        real_rows=tuple(range(rows)),
        real_cols=tuple(range(cols)),
        calibration=Calibration.nominal(width, height),
        rho=rho,
        name=name,
    )


def texture(height: int, width: int, seed: int) -> NDArray[np.float64]:
    """Smooth noise: detail of a few pixels, so that it survives being moved by parts of a pixel."""
    import cv2

    noise = np.random.default_rng(seed).uniform(0, 255, (height, width, 3))
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.2)
    return np.clip((smooth - 127) * 3 + 127, 0, 255).astype(np.float64)


class Planes:
    """A near square before a far plane, parallel to the cameras.

    Args:
        array: who looks.
        far_px, near_px: their disparities between neighbouring cameras.
        seed: of the textures.
    """

    def __init__(self, array: CameraArray, far_px: float, near_px: float, seed: int = 0) -> None:
        self.array, self.far_px, self.near_px = array, far_px, near_px
        reach = int(max(abs(far_px), abs(near_px)) * max(array.rows, array.cols) * max(array.rho, 1)) + 4
        self._reach = reach
        height, width = array.height + 2 * reach, array.width + 2 * reach
        self._far, self._near = texture(height, width, seed), texture(height, width, seed + 1)
        self._left, self._right = array.width // 3, 2 * array.width // 3
        self._top, self._bottom = array.height // 4, 3 * array.height // 4

    def picture(self, position: Position) -> Picture:
        """What the camera there sees, uint8 (H, W, 3)."""
        near = self._shown(self._near, self.near_px, position)
        seen = np.where(
            self._is_near(position)[..., None], near, self._shown(self._far, self.far_px, position)
        )
        return np.rint(seen).clip(0, 255).astype(np.uint8)

    def disparity_px(self, position: Position) -> FloatMap:
        """Exact, float32 (H, W), between neighbouring cameras."""
        return np.where(self._is_near(position), self.near_px, self.far_px).astype(np.float32)

    def pictures(self) -> dict[Position, Picture]:
        return {position: self.picture(position) for position in self.array.real}

    def frame_set(self) -> FrameSet:
        return FrameSet(0, 0, self.pictures())

    def _shift(self, disparity_px: float, position: Position) -> tuple[float, float]:
        """A point at (x, y) of camera (0, 0) is seen at (x - shift_x, y - shift_y)."""
        return position[1] * disparity_px, position[0] * disparity_px * self.array.cell_rho

    def _shown(
        self, plane: NDArray[np.float64], disparity_px: float, position: Position
    ) -> NDArray[np.float64]:
        import cv2

        shift_x, shift_y = self._shift(disparity_px, position)
        x = np.arange(self.array.width, dtype=np.float32) + np.float32(shift_x + self._reach)
        y = np.arange(self.array.height, dtype=np.float32) + np.float32(shift_y + self._reach)
        grid_x, grid_y = np.meshgrid(x, y)
        return np.asarray(cv2.remap(plane, grid_x, grid_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT))

    def _is_near(self, position: Position) -> NDArray[np.bool_]:
        shift_x, shift_y = self._shift(self.near_px, position)
        x = np.arange(self.array.width)[None] + shift_x
        y = np.arange(self.array.height)[:, None] + shift_y
        return (x >= self._left) & (x < self._right) & (y >= self._top) & (y < self._bottom)

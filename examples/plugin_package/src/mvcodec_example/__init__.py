"""A matcher and a synthesizer for mvcodec, as small as they can be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import mvcodec


@dataclass(frozen=True)
class Blocks:
    """One disparity for each block of pixels: the shift with the least sum of absolute differences."""

    size: int = mvcodec.setting(8, "side of a block, px", low=2, high=64)

    def match_pair(
        self, left: mvcodec.Picture, right: mvcodec.Picture, range_px: tuple[float, float]
    ) -> tuple[mvcodec.DisparityMap, mvcodec.DisparityMap]:
        """The maps of a horizontal pair: pixel x of the left picture is at ``x - d`` in the right one."""
        return self._map(left, right, range_px, 1), self._map(right, left, range_px, -1)

    def _map(
        self, own: mvcodec.Picture, other: mvcodec.Picture, range_px: tuple[float, float], side: int
    ) -> mvcodec.DisparityMap:
        shifts = np.arange(np.floor(range_px[0]), np.ceil(range_px[1]) + 1).astype(int)
        costs = [self._block_sums(np.abs(own.astype(int) - np.roll(other, side * d, axis=1))) for d in shifts]
        best = shifts[np.argmin(costs, axis=0)].astype(np.float32)
        values = best.repeat(self.size, 0).repeat(self.size, 1)[: own.shape[0], : own.shape[1]]
        return mvcodec.DisparityMap(values, np.ones(values.shape, np.bool_))

    def _block_sums(self, difference: np.ndarray) -> np.ndarray:
        height, width = (-(-side // self.size) for side in difference.shape[:2])
        padded = np.zeros((height * self.size, width * self.size))
        padded[: difference.shape[0], : difference.shape[1]] = difference.sum(axis=2)
        return padded.reshape(height, self.size, width, self.size).sum(axis=(1, 3))


class Nearest:
    """The picture and the map of the nearest real camera."""

    def render(self, decoded: mvcodec.DecodedSet, viewpoint: mvcodec.Viewpoint) -> mvcodec.RenderedView:
        """The view from a place on the plane of the cameras."""
        decoded.array.check_viewpoint(viewpoint)
        camera = min(
            decoded.array.real, key=lambda at: (at[0] - viewpoint.row) ** 2 + (at[1] - viewpoint.col) ** 2
        )
        pixels = decoded.pictures[camera]
        seen_by = np.ones(pixels.shape[:2], np.uint8)
        return mvcodec.RenderedView(viewpoint, pixels, decoded.disparities[camera].values_px, seen_by)

"""How well the rows and columns of cameras' pictures agree, before and after they are rectified."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.rigs.features import Tracks
from mvcodec.rigs.rig import Lens, Rig

Vectors = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Spread:
    """Of absolute residuals, px; None where there are none.

    Attributes:
        median, p95: half of them, and 95 % of them, are smaller.
    """

    median: float | None
    p95: float | None

    @classmethod
    def of(cls, residuals: Vectors) -> Spread:
        """Of any residuals."""
        if not residuals.size:
            return cls(None, None)
        median, p95 = np.percentile(np.abs(residuals), [50, 95])
        return cls(float(median), float(p95))

    def text(self) -> str:
        """For people."""
        return "none" if self.median is None else f"{self.median:.2f} px (95 %: {self.p95:.2f})"


@dataclass(frozen=True, slots=True)
class Residuals:
    """Of one array.

    Attributes:
        rows: how far apart in rows two cameras beside each other show the same point.
        columns: the same in columns, of two cameras above each other.
        model: how far off all observations of a point are from one disparity for all cameras.
    """

    rows: Spread
    columns: Spread
    model: Spread


def rays(lens: Lens, pixels: Vectors) -> Vectors:
    """(N, 2): slopes of the rays in the camera's axes of pixels (N, 2), by OpenCV."""
    points = pixels[:, None]
    coefficients = np.array(lens.coefficients)
    if lens.model == "fisheye":
        found = cv2.fisheye.undistortPoints(points, lens.matrix, coefficients)
    else:
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)
        found = cv2.undistortPoints(points, lens.matrix, coefficients, criteria=criteria)
    return np.asarray(found, np.float64).reshape(-1, 2)


def rectified_tracks(rig: Rig, tracks: Tracks) -> Tracks:
    """The points where the rectified pictures show them."""
    view = rig.rectified
    xy = np.zeros_like(tracks.xy_px)
    for number, at in enumerate(tracks.cameras):
        camera = rig.cameras[at]
        seen = tracks.seen[:, number]
        if not seen.any():
            continue
        slopes = rays(camera.lens, tracks.xy_px[seen, number])
        turned = np.column_stack([slopes, np.ones(len(slopes))]) @ camera.turn
        beside = (camera.place - (at[1], at[0] * view.rho, 0.0)) * view.typical_w
        straight = turned[:, :2] / turned[:, 2:] * (1 - beside[2]) + beside[:2]
        xy[seen, number] = straight * view.focal_px + view.centre_px
    return Tracks(tracks.cameras, xy, tracks.seen, tracks.frame)


def residuals_of(tracks: Tracks, rho: float = 1.0) -> Residuals:
    """The residuals of points in pictures that are, or ought to be, rectified."""
    rows, columns = [np.empty(0)], [np.empty(0)]
    for first, one in enumerate(tracks.cameras):
        for second, other in enumerate(tracks.cameras):
            both = tracks.seen[:, first] & tracks.seen[:, second]
            apart = tracks.xy_px[both, first] - tracks.xy_px[both, second]
            if one[0] == other[0] and one[1] < other[1]:
                rows.append(apart[:, 1])
            if one[1] == other[1] and one[0] < other[0]:
                columns.append(apart[:, 0])
    residual, _ = disparities(tracks, rho)
    return Residuals(
        Spread.of(np.concatenate(rows)), Spread.of(np.concatenate(columns)), Spread.of(residual[tracks.seen])
    )


def disparities(tracks: Tracks, rho: float = 1.0) -> tuple[Vectors, Vectors]:
    """(T, N, 2) residuals, px, and (T,) disparities of a grid step, px, that explain the points best."""
    grid = np.array([(col, row * rho) for row, col in tracks.cameras], np.float64)
    weights = tracks.seen[..., None] / tracks.seen.sum(axis=1)[:, None, None]

    def centred(values: Vectors) -> Vectors:
        return np.asarray((values - (values * weights).sum(axis=1, keepdims=True)) * tracks.seen[..., None])

    leans = centred(np.broadcast_to(grid, tracks.xy_px.shape))
    places = centred(tracks.xy_px)
    disparity = -(places * leans).sum(axis=(1, 2)) / np.maximum((leans**2).sum(axis=(1, 2)), 1e-12)
    return places + leans * disparity[:, None, None], disparity

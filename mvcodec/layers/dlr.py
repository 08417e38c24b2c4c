"""Depth Layer Refinement of our own: a disparity map cleaned by layers and the edges of its picture.

Of chapter 5 of the thesis it keeps the idea: depth changes at edges of the picture only, layers are cleaned
by erosion, grow back to those edges, and what lies beyond is dropped. Its steps are others (the thesis's are
in `mvcodec.layers.dlr_thesis`): no DILS split, no convex hulls, no composition. The map is cut where it jumps
and eroded there, since a matching window blurs it by half its size; what remains, the cores, grows back along
the way of least distance and change of colour, carrying its slope on, since most surfaces are slanted; in
each mean-shift segment only the run of disparities that prevails stays, and fills the rest of the segment.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.layers.dils_split import runs
from mvcodec.layers.picture_segments import Segments, split_picture
from mvcodec.settings import check_settings, setting

_MEDIAN_SIZE = 5
_RIDGE = 0.1
"""Of the variance of positions in a full window."""


@dataclass(frozen=True, slots=True)
class DlrSettings:
    """Settings of DLR.

    Raises:
        SettingError: a setting is outside its range.
    """

    jump_px: float = setting(1.5, "neighbours that differ by more lie in different layers, px", low=1e-3)
    erosion_px: int = setting(
        7,
        "how far cores keep from the borders of their layer; a third of the matching window",
        low=0,
        high=100,
    )
    overlap_px: int = setting(
        3, "how far they keep from pixels that a nearer one hides from the partner", low=0, high=100
    )
    slope_window: int = setting(
        25,
        "side of the window in which a core's slope is measured, px",
        choices=range(3, 202, 2),
        expected="an odd number 3..201",
    )
    least_share: float = setting(
        0.03, "disparities that fewer of a segment's pixels have end its layer", low=0, high=0.999
    )

    def __post_init__(self) -> None:
        check_settings(self, "DlrSettings.")


def refine(
    picture: Picture,
    disparity: DisparityMap,
    *,
    partner_is_right: bool = True,
    settings: DlrSettings | None = None,
) -> DisparityMap:
    """Refine the map of a picture.

    Made for maps of fixed windows, which are blurred. Maps with sharp contours (sgbm, adcensus) lose more
    there than they gain in smooth regions.

    Args:
        picture: uint8 (H, W, 3) RGB, the camera's.
        disparity: of the camera; invalid pixels have no say.
        partner_is_right: whether the partner sees this camera's pixel x at ``x - d`` (else at ``x + d``). Of
            two pixels that land on one place there, the farther is taken to be mismatched (the
            uniqueness that single matching rests on, Di Stefano et al. 2004).

    Returns:
        The refined map; valid where the value is the pixel's own, smoothed, not one that grew there.
    """
    settings = settings or DlrSettings()
    values = disparity.values_px
    hidden = _hidden(values, 1 if partner_is_right else -1)
    cores = disparity.valid & _far_from(~_jumps(values, settings.jump_px), settings.erosion_px)
    cores &= _far_from(~hidden, settings.overlap_px)
    if not cores.any():
        return disparity
    segments = split_picture(picture)
    grown = _grow_planes(values, cores, segments, settings.slope_window)
    kept = _prevailing(grown, segments, settings.least_share)
    refined = _fill_segments(grown, kept, segments).clip(values.min(), values.max())
    smooth = np.asarray(cv2.medianBlur(refined, _MEDIAN_SIZE), np.float32)
    return DisparityMap(smooth, cores & kept)


def _jumps(values: FloatMap, jump_px: float) -> Mask:
    """Pixels beside a border between layers."""
    jumps = np.zeros(values.shape, np.bool_)
    across = np.abs(np.diff(values, axis=1)) > jump_px
    down = np.abs(np.diff(values, axis=0)) > jump_px
    jumps[:, 1:] |= across
    jumps[:, :-1] |= across
    jumps[1:] |= down
    jumps[:-1] |= down
    return jumps


def _hidden(values: FloatMap, sign: int) -> Mask:
    """Pixels that land outside the partner's picture, or within 1 px of one nearer by more than 1 px."""
    height, width = values.shape
    levels = np.rint(values).astype(np.int64)
    targets = (np.arange(width) - sign * levels).clip(-1, width) + 2
    rows = np.arange(height)[:, None]
    nearest = np.full((height, width + 4), np.iinfo(np.int64).min)
    np.maximum.at(nearest, (rows, targets), levels)
    around = np.maximum(nearest, np.maximum(np.roll(nearest, 1, axis=1), np.roll(nearest, -1, axis=1)))
    outside = (targets < 2) | (targets > width + 1)
    return np.asarray(outside | (around[rows, targets] > levels + 1))


def _far_from(free: Mask, distance_px: int) -> Mask:
    """`free` eroded by a disc."""
    size = 2 * distance_px + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.erode(free.astype(np.uint8), disc) > 0)


def _grow_planes(values: FloatMap, cores: Mask, segments: Segments, window: int) -> FloatMap:
    """Smooth the cores, and carry the plane of the nearest core pixel on to the others.

    The nearest is the one with the least distance plus change of colour on the way.
    """
    from mvcodec.kernels.growth import nearest_seeds  # Numba is slow to import

    heights, slopes_x, slopes_y = _local_planes(values, cores, window)
    nearest = nearest_seeds(cores, 1 + segments.row_edges, 1 + segments.column_edges)
    rows, columns = np.divmod(nearest, values.shape[1])
    step_y = np.arange(values.shape[0])[:, None] - rows
    step_x = np.arange(values.shape[1])[None] - columns
    grown = heights[rows, columns] + slopes_x[rows, columns] * step_x + slopes_y[rows, columns] * step_y
    return grown.astype(np.float32)


def _local_planes(
    values: FloatMap, cores: Mask, window: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Least-squares planes around each core pixel: height there, slope in x, slope in y.

    Only pixels of the same connected core count, so that no plane spans two layers.
    """
    planes = np.zeros((3, *values.shape), np.float64)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(cores.astype(np.uint8), connectivity=4)
    for core in range(1, count):
        left, top, width, height = (int(side) for side in boxes[core][:4])
        part = np.s_[top : top + height, left : left + width]
        members = labels[part] == core
        fitted = _fit_planes(values[part].astype(np.float64), members.astype(np.float64), window)
        for plane, fit in zip(planes, fitted, strict=True):
            plane[part][members] = fit[members]
    return planes[0], planes[1], planes[2]


def _fit_planes(
    values: NDArray[np.float64], weights: NDArray[np.float64], window: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    height, width = values.shape
    y, x = (axis.astype(np.float64) for axis in np.mgrid[:height, :width])

    def mean(plane: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = cv2.boxFilter(
            plane, cv2.CV_64F, (window, window), normalize=False, borderType=cv2.BORDER_CONSTANT
        )
        return np.asarray(sums, np.float64)

    total = np.maximum(mean(weights), 1)
    mean_x, mean_y, mean_v = (mean(weights * q) / total for q in (x, y, values))
    xx, yy, xy, xv, yv = (
        mean(weights * a * b) / total - mean_a * mean_b
        for a, b, mean_a, mean_b in (
            (x, x, mean_x, mean_x),
            (y, y, mean_y, mean_y),
            (x, y, mean_x, mean_y),
            (x, values, mean_x, mean_v),
            (y, values, mean_y, mean_v),
        )
    )
    # A ridge: thin cores say little about the slope across them.
    ridge = _RIDGE * (window * window - 1) / 12
    xx, yy = xx + ridge, yy + ridge
    determinant = xx * yy - xy * xy
    slope_x, slope_y = (xv * yy - yv * xy) / determinant, (yv * xx - xv * xy) / determinant
    return mean_v + slope_x * (x - mean_x) + slope_y * (y - mean_y), slope_x, slope_y


def _prevailing(values: FloatMap, segments: Segments, least_share: float) -> Mask:
    """Pixels of the layer that most of their segment lies in.

    The layers are the runs of frequent disparities of equations 4.8 - 4.10, of one segment's histogram.
    """
    levels = np.rint(values).astype(np.int64)
    levels -= levels.min()
    count = int(levels.max()) + 1
    cells = np.bincount(
        (segments.labels.astype(np.int64) * count + levels).ravel(), minlength=segments.count * count
    )
    histograms = cells.reshape(segments.count, count)
    prevails = np.zeros(histograms.shape, np.bool_)
    for histogram, chosen in zip(histograms, prevails, strict=True):
        layers = runs(histogram > least_share * histogram.sum())
        first, last = max(layers, key=lambda layer: int(histogram[layer[0] : layer[1] + 1].sum()))
        chosen[first : last + 1] = True
    return prevails[segments.labels, levels]


def _fill_segments(values: FloatMap, kept: Mask, segments: Segments) -> FloatMap:
    """Replace what was not kept by the nearest kept value of the same segment."""
    from mvcodec.kernels.growth import nearest_seeds

    labels = segments.labels
    row_costs, column_costs = np.ones((2, *labels.shape), np.float32)
    row_costs[:, 1:][labels[:, 1:] != labels[:, :-1]] = np.inf
    column_costs[1:][labels[1:] != labels[:-1]] = np.inf
    nearest = nearest_seeds(kept, row_costs, column_costs)
    return np.where(nearest >= 0, values.ravel()[nearest], values)

"""Disparity at a view: the maps of its cameras moved there, put to the vote, cleaned and filled."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap
from mvcodec.synthesis.cell_cameras import CellCameras
from mvcodec.workers import run_all, run_in_bands


@dataclass(frozen=True, slots=True)
class Ballot:
    """How the vote is held; the fields are those of `LayeredSettings`."""

    tolerance_px: float
    ratio: float
    contrast: float
    denial: float
    reach_px: float
    speck_area_px: int = 1


def view_disparity(
    maps: NDArray[np.float32],
    lumas: NDArray[np.int16],
    seen: CellCameras,
    ballot: Ballot,
    background_px: float,
) -> FloatMap:
    """Disparity of every pixel of a view.

    Args:
        maps: float32 (R, H, W), px, of every real camera.
        lumas: int16 (R, H + 4, W + 4, 2), see `mvcodec.kernels.view_planes`; not looked at where nothing may
            be denied.
        background_px: disparity of rows of which no camera knows anything.

    Returns:
        float32 (H, W), px, known everywhere.
    """
    from mvcodec.kernels.table import kernel
    from mvcodec.kernels.view_depth import MARGIN

    _, height, width = maps.shape
    moved = np.empty((len(seen.places), height + 2, width + 2 * MARGIN), np.float32)

    def move(place: int, shift: NDArray[np.float32], out: FloatMap) -> None:
        kernel("view_depth.splat")(maps[place], shift[0], shift[1], ballot.reach_px, out)

    run_all(move, seen.places, seen.shifts, moved)
    voted = np.empty((height, width), np.float32)
    run_in_bands(
        height,
        kernel("view_depth.vote"),
        moved,
        seen.places,
        maps,
        lumas,
        seen.shifts,
        seen.weights,
        ballot.tolerance_px,
        ballot.contrast,
        ballot.ratio,
        ballot.denial,
        voted,
    )
    cleaned = np.empty((height, width), np.float32)
    smooth = np.empty((height, width), np.float32) if ballot.speck_area_px > 1 else cleaned

    def clean(first: int, last: int) -> None:
        above, below = max(first - 1, 0), min(last + 1, height)  # the median asks one row beyond the band
        cleaned[first:last] = cv2.medianBlur(voted[above:below], 3)[first - above : last - above]
        kernel("view_depth.restore_thin")(voted, ballot.tolerance_px, cleaned, first, last)
        kernel("view_depth.fill_background")(cleaned, background_px, first, last)
        if smooth is not cleaned:
            smooth[first:last] = cleaned[first:last]

    run_in_bands(height, clean)
    if smooth is cleaned:
        return cleaned
    pieces = cleaned, ballot.tolerance_px, 1, ballot.speck_area_px, smooth
    run_in_bands(height, kernel("specks.smooth_over"), *pieces)
    return smooth

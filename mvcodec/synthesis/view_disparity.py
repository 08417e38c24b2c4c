"""Disparity at a view: the maps of its cameras moved there, put to the vote, cleaned and filled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap
from mvcodec.synthesis.cell_cameras import CellCameras
from mvcodec.workers import run_in_bands


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
    extents: NDArray[np.float32],
    lumas: NDArray[np.int16],
    seen: CellCameras,
    ballot: Ballot,
    background_px: float,
) -> FloatMap:
    """Disparity of every pixel of a view; arguments as in `make_rows`.

    Returns:
        float32 (H, W), px, known everywhere.
    """
    from mvcodec.kernels.table import kernel

    height = maps.shape[1]
    found = np.empty(maps.shape[1:], np.float32)
    smooth = np.empty_like(found) if ballot.speck_area_px > 1 else found

    def make(first: int, last: int) -> None:
        make_rows(maps, extents, lumas, seen, ballot, background_px, found, first, last)
        if smooth is not found:
            smooth[first:last] = found[first:last]

    run_in_bands(height, make)
    if smooth is not found:
        pieces = found, ballot.tolerance_px, 1, ballot.speck_area_px, smooth
        run_in_bands(height, kernel("specks.smooth_over"), *pieces)
    return smooth


def make_rows(
    maps: NDArray[np.float32],
    extents: NDArray[np.float32],
    lumas: NDArray[np.int16],
    seen: CellCameras,
    ballot: Ballot,
    background_px: float,
    out: FloatMap,
    first: int,
    last: int,
) -> None:
    """Disparity of rows first..last-1 of a view, specks not yet looked for.

    Args:
        maps: float32 (R, H, W), px, of every real camera.
        extents: float32 (R, 2), px, the least and the greatest disparity of each map.
        lumas: int16 (R, H + 4, W + 4, 2), see `mvcodec.kernels.view_planes`; not looked at where nothing may
            be denied.
        background_px: disparity of rows of which no camera knows anything.
        out: float32 (H, W), px, rows first..last-1 overwritten, known everywhere.
    """
    from mvcodec.kernels.table import kernel

    kernel("view_sweep.disparity_rows")(
        seen.places,
        maps,
        extents,
        lumas,
        seen.shifts,
        seen.weights,
        ballot.reach_px,
        ballot.tolerance_px,
        ballot.contrast,
        ballot.ratio,
        ballot.denial,
        background_px,
        out,
        first,
        last,
    )

"""A focus: what a wide lens would see, an average of views around the viewpoint."""

from __future__ import annotations

from collections.abc import Sequence

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.frames import DecodedSet, Picture, RenderedView
from mvcodec.output.light_field import refocus

LENS_VIEWS = 4
"""Views each way; more would take a viewer's patience."""

LENS_CELLS = 0.3
"""The lens's width, as a share of a cell: the farther apart its views, the more they show as ghosts."""


def lens_around(array: CameraArray, viewpoint: Viewpoint) -> tuple[Viewpoint, ...]:
    """The viewpoints of a lens, kept within the array."""
    rows = _spread(array.real_rows, viewpoint.row, array.rows)
    return tuple(
        Viewpoint(row, col) for row in rows for col in _spread(array.real_cols, viewpoint.col, array.cols)
    )


def through_lens(
    decoded: DecodedSet, views: Sequence[RenderedView], viewpoint: Viewpoint, focus_px: float
) -> Picture:
    """The views' average, moved so that points of one disparity lie still.

    Args:
        decoded: the frame set that the views are of.
        views: those from `lens_around`.
        focus_px: that disparity, px of the frame set between neighbouring real cameras.
    """
    array = decoded.array
    return refocus(array, views, viewpoint, focus_px / array.baseline_steps)


def _spread(real: Sequence[int], place: float, count: int) -> list[float]:
    if len(real) == 1:
        return [place]
    width = LENS_CELLS * (real[1] - real[0])
    shares = ((number + 0.5) / LENS_VIEWS - 0.5 for number in range(LENS_VIEWS))
    return [min(max(place + share * width, 0.0), count - 1.0) for share in shares]

"""Multi-Level View Synthesis: any view of a cell by synthesis of one pair at a time (thesis chapter 6).

Level 1 renders the rows of the real cameras from left-right pairs, level 2 their columns from upper-lower
pairs, level 3 the middle from two pictures of level 1 or of level 2. Disparity is carried to the virtual
view with its picture, so level 3 needs no matching of its own. An upper-lower pair is a left-right pair
after transposition, with shifts of rho px for each px of disparity.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Cell, Position, Viewpoint
from mvcodec.frames import DecodedSet, DisparityMap, Mask, Picture, RenderedView


class Route(StrEnum):
    """How level 3 reaches the middle of a cell."""

    UPPER_LOWER = "ul"
    """From level 1's pictures, synthesised as upper-lower pairs."""
    LEFT_RIGHT = "lr"
    """From level 2's pictures, synthesised as left-right pairs."""


ROUTE_HELP = "to the middle of a cell: ul from two pictures of its rows, lr from two of its columns"


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A picture with its map, a real camera's or a synthesised one.

    Attributes:
        pixels: uint8 (H, W, 3) RGB.
        disparity: at this view; of a synthesised one not valid where a hole was left.
        seen_by: uint8 (H, W), how many real cameras contributed; 0 = filled.
    """

    pixels: Picture
    disparity: DisparityMap
    seen_by: NDArray[np.uint8]


class PairSynthesizer(Protocol):
    """Renders a view between two rectified ones. Needs a map with the left one only."""

    def synthesize_pair(self, left: View, right: View, beta: float, px_per_disparity: float) -> View:
        """The view at `beta` on the line from `left` (0) to `right` (1).

        Args:
            left, right: a horizontal pair: pixel x of the left one is at ``x - px_per_disparity * d`` in
                the right one.
            beta: 0..1.
            px_per_disparity: px between the two pictures for each px of disparity.
        """
        ...


def level(array: CameraArray, viewpoint: Viewpoint) -> int:
    """The level of MLVS that renders a viewpoint: 1, 2 or 3; 0 for a real camera's place.

    Raises:
        SettingError: the viewpoint lies outside the span of the real cameras.
    """
    array.check_viewpoint(viewpoint)
    on_row, on_col = viewpoint.row in array.real_rows, viewpoint.col in array.real_cols
    if on_row and on_col:
        return 0
    return 1 if on_row else 2 if on_col else 3


def render(
    decoded: DecodedSet, viewpoint: Viewpoint, pairs: PairSynthesizer, route: Route = Route.UPPER_LOWER
) -> RenderedView:
    """The view from `viewpoint`, by `pairs` at every level.

    Raises:
        SettingError: the viewpoint lies outside the span of the real cameras.
    """
    cell = decoded.array.cell_at(viewpoint)
    match level(decoded.array, viewpoint):
        case 0:
            view = _camera(decoded, (int(viewpoint.row), int(viewpoint.col)))
        case 1:
            view = _on_row(decoded, cell, int(viewpoint.row), viewpoint.col, pairs)
        case 2:
            view = _on_col(decoded, cell, int(viewpoint.col), viewpoint.row, pairs)
        case _:
            view = _in_middle(decoded, cell, viewpoint, pairs, route)
    return RenderedView(viewpoint, view.pixels, view.disparity.values_px, view.seen_by)


def _camera(decoded: DecodedSet, position: Position) -> View:
    pixels = decoded.pictures[position]
    return View(pixels, decoded.disparities[position], np.ones(pixels.shape[:2], np.uint8))


def _on_row(decoded: DecodedSet, cell: Cell, row: int, col: float, pairs: PairSynthesizer) -> View:
    left, right = _camera(decoded, (row, cell.left)), _camera(decoded, (row, cell.right))
    return pairs.synthesize_pair(left, right, _share(col, cell.left, cell.right), 1.0)


def _on_col(decoded: DecodedSet, cell: Cell, col: int, row: float, pairs: PairSynthesizer) -> View:
    upper, lower = _camera(decoded, (cell.top, col)), _camera(decoded, (cell.bottom, col))
    return _upper_lower(upper, lower, _share(row, cell.top, cell.bottom), decoded.array.cell_rho, pairs)


def _in_middle(
    decoded: DecodedSet, cell: Cell, viewpoint: Viewpoint, pairs: PairSynthesizer, route: Route
) -> View:
    row, col = viewpoint.row, viewpoint.col
    if route is Route.UPPER_LOWER:
        upper = _on_row(decoded, cell, cell.top, col, pairs)
        lower = _on_row(decoded, cell, cell.bottom, col, pairs)
        return _upper_lower(upper, lower, _share(row, cell.top, cell.bottom), decoded.array.cell_rho, pairs)
    left = _on_col(decoded, cell, cell.left, row, pairs)
    right = _on_col(decoded, cell, cell.right, row, pairs)
    return pairs.synthesize_pair(left, right, _share(col, cell.left, cell.right), 1.0)


def _upper_lower(upper: View, lower: View, beta: float, rho: float, pairs: PairSynthesizer) -> View:
    return _transposed(pairs.synthesize_pair(_transposed(upper), _transposed(lower), beta, rho))


def _share(place: float, first: int, last: int) -> float:
    return (place - first) / (last - first)


def _transposed(view: View) -> View:
    # cv2.transpose takes a quarter of the time of copying NumPy's transposed view (960 x 640 pictures).
    disparity = DisparityMap(
        np.asarray(cv2.transpose(view.disparity.values_px), np.float32),
        _transposed_mask(view.disparity.valid),
    )
    return View(
        np.asarray(cv2.transpose(view.pixels), np.uint8),
        disparity,
        np.asarray(cv2.transpose(view.seen_by), np.uint8),
    )


def _transposed_mask(mask: Mask) -> Mask:
    return np.asarray(cv2.transpose(np.ascontiguousarray(mask).view(np.uint8))).view(np.bool_)

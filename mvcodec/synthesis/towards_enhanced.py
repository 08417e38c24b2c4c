"""Views near to enhanced ones: the nearer a viewpoint comes, the more of its picture is theirs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import replace

import cv2
import numpy as np

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DecodedSet, FinishedView, FloatMap, RenderedView
from mvcodec.synthesis.cell_cameras import real_view
from mvcodec.synthesis.synthesizer import Synthesizer

TOLERANCE_PX = 1.5
"""A view sees what a pixel shows where its own disparity differs by less than this."""


def shares(views: Collection[Position], viewpoint: Viewpoint) -> dict[Position, float]:
    """How much of a viewpoint's picture each view may be: 1 on its place, 0 from one step of the grid on.

    Where views stand around the viewpoint on all sides, their shares add up to 1.
    """
    found = {}
    for row, col in views:
        down, across = abs(viewpoint.row - row), abs(viewpoint.col - col)
        if down < 1 and across < 1:
            found[row, col] = (1 - down) * (1 - across)
    return found


def views_near(array: CameraArray, viewpoints: Iterable[Viewpoint]) -> frozenset[Position]:
    """Places of the grid where a view would have a share in the picture of one of these viewpoints."""
    found: set[Position] = set()
    for viewpoint in viewpoints:
        top, left = math.floor(viewpoint.row), math.floor(viewpoint.col)
        around = [(row, col) for row in (top, top + 1) for col in (left, left + 1)]
        found.update(view for view, share in shares(around, viewpoint).items() if share > 0)
    return frozenset(view for view in found if view[0] < array.rows and view[1] < array.cols)


class TowardsEnhanced:
    """A synthesizer beside the enhanced views of what it renders; without such views it is the inner one.

    Args:
        inner: renders from the real cameras.
    """

    def __init__(self, inner: Synthesizer) -> None:
        self._inner = inner

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """See `Synthesizer.render`. On an enhanced view's place it is that view, exactly."""
        if viewpoint.position in decoded.enhanced:
            found = real_view(decoded, viewpoint)
            assert found is not None
            return found
        view = self._inner.render(decoded, viewpoint)
        near = shares(decoded.enhanced, viewpoint)
        return _blended(decoded, view, near) if near else view


def _blended(decoded: DecodedSet, view: RenderedView, near: dict[Position, float]) -> RenderedView:
    left = max(1 - sum(near.values()), 0.0)
    # A pixel that none of the views sees stays as it was, however little is left for it.
    weights = np.full(view.disparity_px.shape, max(left, 1e-3), np.float32)
    total = view.pixels.astype(np.float32) * weights[..., None]
    for place, share in near.items():
        pixels, seen = _moved(decoded.array, decoded.enhanced[place], place, view)
        seen *= np.float32(share)
        total += pixels * seen[..., None]
        weights += seen
    total /= weights[..., None]
    return replace(view, pixels=np.clip(np.rint(total), 0, 255).astype(np.uint8))


def _moved(
    array: CameraArray, found: FinishedView, place: Position, view: RenderedView
) -> tuple[FloatMap, FloatMap]:
    """An enhanced view's colours at another viewpoint, float32 (H, W, 3), and where it sees them, 0 or 1."""
    across, down = array.shift_per_disparity(place, view.viewpoint)
    height, width = view.disparity_px.shape
    x = np.arange(width, dtype=np.float32) + np.float32(across) * view.disparity_px
    y = np.arange(height, dtype=np.float32)[:, None] + np.float32(down) * view.disparity_px
    pixels = cv2.remap(found.pixels, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    surface = cv2.remap(
        found.disparity_px, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=np.inf
    )
    seen = np.abs(surface - view.disparity_px) < TOLERANCE_PX
    return pixels.astype(np.float32), seen.astype(np.float32)

"""Drafts, for playing and dragging where whole pictures take too long, and when to use them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from mvcodec.array import CameraArray
from mvcodec.frames import DecodedSet, DisparityMap, FinishedView, FloatMap, Picture, RenderedView


@dataclass(frozen=True, slots=True)
class Level:
    """How a picture is made.

    Attributes:
        scale: of its sides.
        quick: by the quick synthesizer instead of the chosen one.
        cost: of drawing it, about, as a share of a whole picture's.
    """

    scale: float
    quick: bool
    cost: float


WHOLE = Level(1.0, quick=False, cost=1.0)
SMALLER = (WHOLE, Level(0.75, quick=False, cost=0.6), Level(0.5, quick=False, cost=0.3))
"""Levels of a synthesizer that has no quick one beside it."""

QUICKER = (
    WHOLE,
    Level(1.0, quick=True, cost=0.55),
    Level(0.75, quick=True, cost=0.35),
    Level(0.5, quick=True, cost=0.2),
)
"""Levels of one that has; the costs are those on shop_v4."""

BUDGET_S = 0.062
"""For making a picture: 15 a second, with time to hand it over. It is drawn while the next one is made."""

MARGIN = 0.85
"""Share of the budget that a better level may cost: without room, the level would change all the time."""

WINDOW = 4
"""Pictures that are averaged before the level may change."""


class Pace:
    """Chooses the level of pictures from what they cost, so that motion stays smooth.

    Args:
        levels: from the best to the cheapest.
    """

    def __init__(self, levels: Sequence[Level]) -> None:
        self._levels = levels
        self._place = 0
        self._waits_s: deque[float] = deque(maxlen=WINDOW)
        self._drawings_s: deque[float] = deque(maxlen=WINDOW)

    @property
    def level(self) -> Level:
        """The one to make pictures at."""
        return self._levels[self._place]

    def note(self, cost_s: float, drawing_s: float, allowed_s: float) -> None:
        """Learn what a picture of the present level cost.

        Args:
            cost_s: seconds from its request to its being sent.
            drawing_s: those of them that depend on the level; the others wait for the frame set.
            allowed_s: seconds from one frame to the next, if nothing but frames changes the picture.
        """
        self._waits_s.append(max(0.0, cost_s - drawing_s))
        self._drawings_s.append(drawing_s)
        if len(self._waits_s) < WINDOW:
            return
        wait_s, budget_s = sum(self._waits_s) / WINDOW, max(BUDGET_S, allowed_s)
        whole_s = sum(self._drawings_s) / WINDOW / self.level.cost
        for place, level in enumerate(self._levels):
            if wait_s + whole_s * level.cost <= (budget_s if place >= self._place else MARGIN * budget_s):
                break
        self._place = place
        self._waits_s.clear()
        self._drawings_s.clear()


def shrink(decoded: DecodedSet, scale: float) -> DecodedSet:
    """The frame set with pictures of `scale` times the size; disparities are px of the smaller pictures."""
    if scale == 1:
        return decoded
    array = _shrunk_array(decoded.array, scale)
    size = array.width, array.height
    low, high = decoded.disparity_range_px
    return replace(
        decoded,
        array=array,
        pictures={camera: _shrunk_picture(picture, size) for camera, picture in decoded.pictures.items()},
        disparities={camera: _shrunk_map(item, size, scale) for camera, item in decoded.disparities.items()},
        enhanced={view: _shrunk_view(item, size, scale) for view, item in decoded.enhanced.items()},
        disparity_range_px=(low * scale, high * scale),
    )


def in_full_px(view: RenderedView, scale: float) -> RenderedView:
    """A view of a shrunken frame set, its disparity in px of the whole pictures."""
    return view if scale == 1 else replace(view, disparity_px=view.disparity_px / np.float32(scale))


def _shrunk_array(array: CameraArray, scale: float) -> CameraArray:
    width, height = max(1, round(array.width * scale)), max(1, round(array.height * scale))
    given, hint = array.calibration, array.disparity_per_step_px
    across, down = width / array.width, height / array.height
    calibration = replace(
        given,
        fx_px=given.fx_px * across,
        fy_px=given.fy_px * down,
        cx_px=(given.cx_px + 0.5) * across - 0.5,
        cy_px=(given.cy_px + 0.5) * down - 0.5,
        d_inf_px_per_step=given.d_inf_px_per_step * across,
    )
    return replace(
        array,
        width=width,
        height=height,
        calibration=calibration,
        disparity_per_step_px=hint and (hint[0] * scale, hint[1] * scale),
    )


def _shrunk_picture(picture: Picture, size: tuple[int, int]) -> Picture:
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_LINEAR), np.uint8)


def _shrunk_map(disparity: DisparityMap, size: tuple[int, int], scale: float) -> DisparityMap:
    valid = cv2.resize(disparity.valid.view(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    return DisparityMap(_shrunk_values(disparity.values_px, size, scale), valid.astype(np.bool_))


def _shrunk_view(view: FinishedView, size: tuple[int, int], scale: float) -> FinishedView:
    return FinishedView(_shrunk_picture(view.pixels, size), _shrunk_values(view.disparity_px, size, scale))


def _shrunk_values(values_px: FloatMap, size: tuple[int, int], scale: float) -> FloatMap:
    # Nearest, since a mean of two surfaces lies on neither.
    small = cv2.resize(values_px, size, interpolation=cv2.INTER_NEAREST)
    return np.asarray(small, np.float32) * np.float32(scale)

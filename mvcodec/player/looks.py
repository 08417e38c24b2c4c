"""What the page can show: one table of looks, each a choice of viewpoints and a way to compose them.

A look gives a picture and its legend; the page draws the legend as text and colours beside the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.frames import DecodedSet, Picture, RenderedView
from mvcodec.output import stereoscopic
from mvcodec.player import overlays

Legend = dict[str, Any]
"""Plain JSON values; see `overlays`."""


Place = Callable[[CameraArray, Viewpoint, float], tuple[Viewpoint, ...]]
Compose = Callable[[DecodedSet, Sequence[RenderedView]], tuple[Picture, Legend]]


@dataclass(frozen=True, slots=True)
class Look:
    """One way of showing a frame set.

    Attributes:
        place: (array, viewpoint, eye distance in grid steps) -> the viewpoints to render.
        compose: the decoded set and those views -> picture and legend.
        stereo: whether the eye distance matters.
    """

    place: Place
    compose: Compose
    stereo: bool = False


def _one(_array: CameraArray, viewpoint: Viewpoint, _eye_steps: float) -> tuple[Viewpoint, ...]:
    return (viewpoint,)


def _plain(_decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, Legend]:
    return views[0].pixels, {}


def _anaglyph(_decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, Legend]:
    return stereoscopic.anaglyph(views[0].pixels, views[1].pixels), _eyes(views)


def _side_by_side(_decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, Legend]:
    return np.hstack([view.pixels for view in views]), _eyes(views)


def _mosaic(_decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, Legend]:
    return stereoscopic.nine([view.pixels for view in views]), _eyes(views)


def _eyes(views: Sequence[RenderedView]) -> Legend:
    """Where the eyes are, in words."""
    first, last = views[0].viewpoint.col, views[-1].viewpoint.col
    if first == last:
        return {"kind": "text", "text": "No distance between the eyes: this array has one column, or it is 0"}
    between = (last - first) / (len(views) - 1)
    what = "Left and right eye" if len(views) == 2 else f"{len(views)} views"
    return {"kind": "text", "text": f"{what} at columns {first:.2f} to {last:.2f}, {between:.2f} apart"}


LOOKS: dict[str, Look] = {
    "picture": Look(_one, _plain),
    "disparity": Look(_one, overlays.disparity),
    "layers": Look(_one, overlays.layers),
    "provenance": Look(_one, overlays.provenance),
    "difference": Look(_one, overlays.disagreement),
    "anaglyph": Look(stereoscopic.two_eyes, _anaglyph, stereo=True),
    "side-by-side": Look(stereoscopic.two_eyes, _side_by_side, stereo=True),
    "mosaic": Look(stereoscopic.nine_places, _mosaic, stereo=True),
}

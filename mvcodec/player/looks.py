"""What the page can show: what of a view (looks), and one view or several side by side (eyes).

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

Look = Callable[[DecodedSet, RenderedView], tuple[Picture, Legend]]


def _plain(_decoded: DecodedSet, view: RenderedView) -> tuple[Picture, Legend]:
    return view.pixels, {}


COMPARING = "difference"
"""The look that needs an original; without one it shows the picture (see `overlays.difference`)."""

EXACT = ("disagreement", COMPARING)
"""Looks that pictures of cameras are compared in."""

LOOKS: dict[str, Look] = {
    "picture": _plain,
    "disparity": overlays.disparity,
    "layers": overlays.layers,
    "provenance": overlays.provenance,
    "disagreement": overlays.disagreement,
    COMPARING: _plain,
}

Place = Callable[[CameraArray, Viewpoint, float], tuple[Viewpoint, ...]]
Combine = Callable[[Sequence[Picture]], Picture]


@dataclass(frozen=True, slots=True)
class Eyes:
    """How many views are shown, and how.

    Attributes:
        place: (array, viewpoint, eye distance in grid steps) -> the viewpoints to render.
        combine: their pictures -> one.
    """

    place: Place
    combine: Combine


def _one_place(_array: CameraArray, viewpoint: Viewpoint, _eye_steps: float) -> tuple[Viewpoint, ...]:
    return (viewpoint,)


ONE = "one"
EYES: dict[str, Eyes] = {
    ONE: Eyes(_one_place, lambda pictures: pictures[0]),
    "side by side": Eyes(stereoscopic.two_eyes, np.hstack),
    "anaglyph": Eyes(stereoscopic.two_eyes, lambda pictures: stereoscopic.anaglyph(*pictures)),
    "nine": Eyes(stereoscopic.nine_places, stereoscopic.nine),
}

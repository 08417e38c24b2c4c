"""Pictures that explain a rendered view, each with a legend of plain JSON values.

A legend is ``{"kind": "scale", "text", "low", "high", "colours"}``, ``{"kind": "classes", "text", "items":
[{"colour", "text", "share"}]}`` or ``{"kind": "text", "text"}``; colours as ``#rrggbb``, shares 0..1.
"""

from __future__ import annotations

import colorsys
import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import DecodedSet, DisparityMap, Picture, RenderedView
from mvcodec.layers.dils_split import split_levels
from mvcodec.synthesis.cell_cameras import find_cameras

DIFFERENCE_GAIN = 4
DISAGREEMENT_GAIN = 12
SPREAD = 0.4
"""Squared cells; see `find_cameras`."""

SAME_SURFACE_PX = 1.5
SCALE_COLOURS = 17
MAX_LEGEND_ITEMS = 9
TINT = 0.62
"""Share of the class's colour where a picture is tinted; the rest is its luma, so that objects stay known."""

OCCLUDED = (70, 70, 76)

# Okabe and Ito's colours, which people with colour-blindness tell apart; by number of cameras, 0 = filled.
PROVENANCE = ((213, 94, 0), (230, 159, 0), (86, 180, 233), (0, 158, 115), (0, 114, 178))

Palette = NDArray[np.uint8]
"""uint8 (N, 3), RGB."""


def disparity(decoded: DecodedSet, view: RenderedView) -> tuple[Picture, dict[str, Any]]:
    """The view's disparity in colours: blue is far, red is near."""
    low, high = decoded.disparity_range_px
    codes = np.clip((view.disparity_px - low) * (255 / (high - low)), 0, 255).astype(np.uint8)
    colours = _turbo()
    stops = colours[np.linspace(0, 255, SCALE_COLOURS).round().astype(int)]
    return colours[codes], {
        "kind": "scale",
        "text": "Disparity, px between neighbouring real cameras",
        "low": round(low, 2),
        "high": round(high, 2),
        "colours": [_hex(colour) for colour in stops],
    }


def layers(_decoded: DecodedSet, view: RenderedView) -> tuple[Picture, dict[str, Any]]:
    """The view's depth layers (thesis 4.3.2), a colour each, over its luma."""
    # The thesis's own split joins real scenes into one or two layers, which shows nothing.
    stack = split_levels(DisparityMap(view.disparity_px, view.seen_by > 0))
    count = len(stack.bounds_px)
    colours = np.array([OCCLUDED, *(_layer_colour(i, count) for i in range(count))], np.uint8)
    names = [
        "in no layer, or filled",
        *(f"{low} px" if low == high else f"{low} to {high} px" for low, high in stack.bounds_px),
    ]
    text = f"Depth layers: {count}" + (", the largest:" if count >= MAX_LEGEND_ITEMS else "")
    return _tinted(view.pixels, stack.labels, colours), _classes(text, stack.labels, colours, names)


def provenance(decoded: DecodedSet, view: RenderedView) -> tuple[Picture, dict[str, Any]]:
    """How many real cameras saw each pixel, over the view's luma."""
    most = len(PROVENANCE) - 1
    seen = np.minimum(view.seen_by, most)
    colours = np.array(PROVENANCE, np.uint8)
    names = ["filled, no camera", "1 camera", *(f"{count} cameras" for count in range(2, most + 1))]
    shown = 1 + min(most, max(len(cell.cameras) for cell in decoded.array.cells))
    legend = _classes("Seen by", seen, colours[:shown], names[:shown])
    return _tinted(view.pixels, seen, colours), legend


def difference(view: RenderedView, original: Picture) -> tuple[Picture, dict[str, Any]]:
    """The largest difference of the three channels from what a camera saw from there; of the same size."""
    error = cv2.absdiff(view.pixels, original).max(axis=2)
    return _grey(error, DIFFERENCE_GAIN, "Difference to the original, levels")


def disagreement(decoded: DecodedSet, view: RenderedView) -> tuple[Picture, dict[str, Any]]:
    """How much the cameras that see a point differ there: the deviation of their luma, warped to the view."""
    near = find_cameras(decoded, view.viewpoint, SPREAD)
    rows, cols = np.indices(view.disparity_px.shape, np.float32)
    total, mean, squares = (np.zeros(view.disparity_px.shape, np.float32) for _ in range(3))
    for camera, shift, weight in zip(near.cameras, near.shifts, near.weights, strict=True):
        x, y = cols + shift[0] * view.disparity_px, rows + shift[1] * view.disparity_px
        luma = cv2.cvtColor(decoded.pictures[camera], cv2.COLOR_RGB2GRAY).astype(np.float32)
        warped = cv2.remap(luma, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        surface = cv2.remap(
            decoded.disparities[camera].values_px, x, y, cv2.INTER_NEAREST, borderValue=math.inf
        )
        share = np.where(np.abs(surface - view.disparity_px) <= SAME_SURFACE_PX, weight, np.float32(0))
        total += share
        mean += share * warped
        squares += share * warped**2
    known = np.maximum(total, np.float32(1e-6))
    deviation = np.sqrt(np.maximum(squares / known - (mean / known) ** 2, 0))
    return _grey(deviation, DISAGREEMENT_GAIN, "Disagreement of the cameras that see a point, levels")


def _grey(levels: NDArray[Any], gain: int, text: str) -> tuple[Picture, dict[str, Any]]:
    grey = cv2.convertScaleAbs(levels, alpha=gain)
    return np.repeat(grey[..., None], 3, axis=2), {
        "kind": "scale",
        "text": text,
        "low": 0,
        "high": 255 // gain,
        "colours": ["#000000", "#ffffff"],
    }


@cache
def _turbo() -> Palette:
    ramp = np.arange(256, dtype=np.uint8)[:, None]
    colours: Palette = np.ascontiguousarray(cv2.applyColorMap(ramp, cv2.COLORMAP_TURBO)[:, 0, ::-1])
    return colours


def _layer_colour(number: int, count: int) -> tuple[int, int, int]:
    """Violet for the farthest layer, through the rainbow to red, light and dark by turns."""
    hue = 0.75 * (1 - number / max(count - 1, 1))
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.72, 1.0 if number % 2 else 0.78)
    return round(255 * red), round(255 * green), round(255 * blue)


def _tinted(picture: Picture, labels: NDArray[Any], colours: Palette) -> Picture:
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    tint: Picture = np.asarray(
        cv2.addWeighted(colours[labels], TINT, np.repeat(grey[..., None], 3, axis=2), 1 - TINT, 0), np.uint8
    )
    return tint


def _classes(text: str, labels: NDArray[Any], colours: Palette, names: Sequence[str]) -> dict[str, Any]:
    """The legend of labels; the largest classes, in their own order, where there are many."""
    counts = np.bincount(labels.ravel(), minlength=len(names))
    chosen = sorted(np.argsort(-counts[: len(names)], kind="stable")[:MAX_LEGEND_ITEMS].tolist())
    items = [
        {
            "colour": _hex(colours[number]),
            "text": names[number],
            "share": round(float(counts[number] / labels.size), 4),
        }
        for number in chosen
    ]
    return {"kind": "classes", "text": text, "items": items}


def _hex(colour: NDArray[np.uint8]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*(int(channel) for channel in colour))

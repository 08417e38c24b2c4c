"""Pictures that explain a rendered view, each with a legend of plain JSON values.

A legend is ``{"kind": "scale", "text", "low", "high", "colours"}``, ``{"kind": "classes", "text", "items":
[{"colour", "text", "share"}]}`` or ``{"kind": "text", "text"}``; colours as ``#rrggbb``, shares 0..1.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.frames import DecodedSet, DisparityMap, Picture, RenderedView
from mvcodec.layers.dils_split import split_levels

DIFFERENCE_GAIN = 4
SCALE_COLOURS = 17
MAX_LEGEND_ITEMS = 9
TINT = 0.62
"""Share of the class's colour where a picture is tinted; the rest is its luma, so that objects stay known."""

OCCLUDED = (70, 70, 76)

# Okabe and Ito's colours, which people with colour-blindness tell apart; by number of cameras, 0 = filled.
PROVENANCE = ((213, 94, 0), (230, 159, 0), (86, 180, 233), (0, 158, 115), (0, 114, 178))

Palette = NDArray[np.uint8]
"""uint8 (N, 3), RGB."""


def disparity(decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, dict[str, Any]]:
    """The view's disparity in colours: blue is far, red is near."""
    low, high = decoded.disparity_range_px
    codes = np.clip((views[0].disparity_px - low) * (255 / (high - low)), 0, 255).astype(np.uint8)
    colours = _turbo()
    stops = colours[np.linspace(0, 255, SCALE_COLOURS).round().astype(int)]
    return colours[codes], {
        "kind": "scale",
        "text": "Disparity, px between neighbouring real cameras",
        "low": round(low, 2),
        "high": round(high, 2),
        "colours": [_hex(colour) for colour in stops],
    }


def layers(_decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, dict[str, Any]]:
    """The view's depth layers (thesis 4.3.2), a colour each, over its luma."""
    view = views[0]
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


def provenance(decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, dict[str, Any]]:
    """How many real cameras saw each pixel, over the view's luma."""
    view = views[0]
    most = len(PROVENANCE) - 1
    seen = np.minimum(view.seen_by, most)
    colours = np.array(PROVENANCE, np.uint8)
    names = ["filled, no camera", "1 camera", *(f"{count} cameras" for count in range(2, most + 1))]
    shown = 1 + min(most, max(len(cell.cameras) for cell in decoded.array.cells))
    legend = _classes("Seen by", seen, colours[:shown], names[:shown])
    return _tinted(view.pixels, seen, colours), legend


def difference(decoded: DecodedSet, views: Sequence[RenderedView]) -> tuple[Picture, dict[str, Any]]:
    """The largest difference of the three channels from the nearest real camera's picture."""
    view = views[0]
    camera = nearest_camera(decoded.array, view.viewpoint)
    error = cv2.absdiff(view.pixels, decoded.pictures[camera]).max(axis=2)
    grey = cv2.convertScaleAbs(error, alpha=DIFFERENCE_GAIN)
    return np.repeat(grey[..., None], 3, axis=2), {
        "kind": "scale",
        "text": f"Difference from the real camera at {camera[0]}, {camera[1]}, levels",
        "low": 0,
        "high": 255 // DIFFERENCE_GAIN,
        "colours": ["#000000", "#ffffff"],
    }


def nearest_camera(array: CameraArray, viewpoint: Viewpoint) -> Position:
    """The real camera at the smallest distance, in steps of the grid; the upper left one of equals."""
    return min(
        array.real, key=lambda camera: (camera[0] - viewpoint.row) ** 2 + (camera[1] - viewpoint.col) ** 2
    )


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

"""The look of figures (labelled units, colours that all can tell apart), and those of one report alone."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from mvcodec.frames import Picture

LOOK: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#d9d9d9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.markersize": 5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 3.2,
    "figure.dpi": 100,
    "savefig.dpi": 200,
    "svg.hashsalt": "mvcodec",  # the same figure gives the same file
    # TrueType: Matplotlib's own Type 3 fonts are refused by publishers.
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
}

# Of Okabe and Ito's palette (2008), as all colours of figures.
SPLIT_COLOURS = {"texture": "#0072B2", "disparity": "#E69F00", "rest": "#999999"}
SPLIT_LABELS = {"texture": "pictures", "disparity": "maps", "rest": "container, headers"}

METRICS = {"psnr_y": "Y-PSNR (dB)", "ssim": "SSIM (luma)"}

HEAT_MAP = "cividis"

Document = Mapping[str, Any]
"""What a report.json holds."""


@contextmanager
def look() -> Iterator[None]:
    """Figures made within have the look of all others."""
    with mpl.rc_context(cast("Any", LOOK)):
        yield


def svg(figure: Figure) -> bytes:
    """The figure as an SVG document."""
    return saved(figure, "svg")


def png(figure: Figure) -> bytes:
    """The figure as PNG."""
    return saved(figure, "png")


def own_curve(document: Document) -> Mapping[str, Any]:
    """mvcodec's curve in a report."""
    curve: Mapping[str, Any] = document["curves"][0]
    return curve


def split_figure(document: Document) -> Figure:
    """Where mvcodec's bits go: kbit for each frame set, stacked, one bar a QP."""
    points = own_curve(document)["points"]
    with look():
        figure = Figure(figsize=(4.6, 3.2), layout="constrained")
        axes = figure.subplots()
        places = np.arange(len(points))
        below = np.zeros(len(points))
        for part, colour in SPLIT_COLOURS.items():
            kbit = np.array([point["bits_split"][part] for point in points]) / document["frames"] / 1000
            axes.bar(places, kbit, 0.6, below, color=colour, label=SPLIT_LABELS[part])
            below += kbit
        for place, point, top in zip(places, points, below, strict=True):
            share = point["bits_split"]["disparity"] / point["bits"]
            axes.annotate(
                f"maps {share:.0%}", (place, top), (0, 3), textcoords="offset points", ha="center", fontsize=8
            )
        axes.set_xticks(places, [str(point["qp"]) for point in points])
        axes.set_xlabel("QP")
        axes.set_ylabel("kbit for each frame set")
        axes.grid(axis="x", visible=False)
        axes.margins(y=0.12)
        axes.legend()
    return figure


def heat_figure(document: Document, views: Mapping[int, NDArray[np.float64]]) -> Figure:
    """Y-PSNR over the array's places, one map a QP; the real cameras are framed.

    Args:
        views: dB by QP, float64 (rows, cols).
    """
    rows, cols = document["grid"]
    low, high = min(map(np.min, views.values())), max(map(np.max, views.values()))
    with look():
        width = max(min(2.6, 0.5 * cols + 0.7), 1.4)
        figure = Figure(
            figsize=(width * len(views) + 1.0, max(width * rows / cols, 0.6) + 0.9), layout="constrained"
        )
        panels = figure.subplots(1, len(views), squeeze=False)[0]
        for panel, (qp, values) in zip(panels, views.items(), strict=True):
            image = panel.imshow(values, cmap=HEAT_MAP, vmin=low, vmax=max(high, low + 1e-6))
            panel.set_title(f"QP {qp}", loc="left")
            panel.grid(visible=False)
            panel.spines[:].set_visible(False)
            panel.xaxis.set_major_locator(MaxNLocator(8, integer=True))
            panel.yaxis.set_major_locator(MaxNLocator(8, integer=True))
            panel.set_xlabel("column")
            for row, col in document["real"]:
                panel.add_patch(
                    Rectangle((col - 0.46, row - 0.46), 0.92, 0.92, fill=False, ec="#D55E00", lw=1.6)
                )
            if max(rows, cols) <= 5:
                _write_values(panel, values, (low + high) / 2)
        panels[0].set_ylabel("row")
        figure.colorbar(image, ax=panels.tolist(), label=METRICS["psnr_y"], shrink=0.9)
    return figure


def ssim_figure(original: Picture, maps: Mapping[int, NDArray[np.float64]]) -> Figure:
    """A view beside its SSIM maps, one a QP.

    Args:
        original: uint8 (H, W, 3) RGB.
        maps: float64 (H', W'), -1..1, by QP.
    """
    with look():
        panels_count = len(maps) + 1
        aspect = original.shape[0] / original.shape[1]
        cols = min(panels_count, 3)
        rows = -(-panels_count // cols)
        figure = Figure(figsize=(3.1 * cols + 0.8, (3.1 * aspect + 0.35) * rows), layout="constrained")
        panels = figure.subplots(rows, cols, squeeze=False).ravel()
        for panel in panels:
            panel.set_axis_off()
        panels[0].imshow(original)
        panels[0].set_title("Original", loc="left")
        for panel, (qp, values) in zip(panels[1:], maps.items(), strict=False):
            image = panel.imshow(values, cmap=HEAT_MAP, vmin=0, vmax=1)
            panel.set_title(f"QP {qp}: SSIM {values.mean():.3f}", loc="left")
        figure.colorbar(image, ax=panels.tolist(), label="SSIM (1 = alike)", shrink=0.9)
    return figure


def _write_values(panel: Axes, values: NDArray[np.float64], middle: float) -> None:
    for (row, col), value in np.ndenumerate(values):
        colour = "black" if value > middle else "white"
        panel.text(col, row, f"{value:.1f}", ha="center", va="center", fontsize=6.5, color=colour)


def saved(figure: Figure, kind: str) -> bytes:
    """The figure in a format that Matplotlib knows by this name; the same each time."""
    target = io.BytesIO()
    with look():
        metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
        figure.savefig(target, format=kind, metadata=metadata)
    return target.getvalue()

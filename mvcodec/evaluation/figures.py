"""Figures of rate-distortion reports, in one look: labelled units, colours that everyone can tell apart."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
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
}

# Okabe and Ito's palette (2008).
OURS_COLOURS = ("#D55E00", "#000000", "#E69F00", "#8C510A")
OURS_MARKERS = ("o", "P", "X", "*")
ANCHOR_STYLES = {
    "simulcast": ("#0072B2", "s"),
    "simulcast-b": ("#56B4E9", "D"),
    "pvs": ("#009E73", "^"),
    "pvs-rows": ("#CC79A7", "v"),
}
CODEC_LINES: dict[str, Any] = {"h264": "-", "hevc": (0, (5, 1.5)), "av1": (0, (1, 1.2))}
SPLIT_COLOURS = {"texture": "#0072B2", "disparity": "#E69F00", "rest": "#999999"}
SPLIT_LABELS = {"texture": "pictures", "disparity": "maps", "rest": "container, headers"}

METRICS = {"psnr_y": "Y-PSNR (dB)", "ssim": "SSIM (luma)"}
CLASSES = {"all": "All views", "virtual": "Virtual views"}

HEAT_MAP = "cividis"
OWN_ZORDER = 5

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


def rd_figure(
    documents: Sequence[Document],
    metric: str = "psnr_y",
    names: Sequence[str] = (),
    only: Sequence[str] = (),
) -> Figure:
    """Quality over rate: a row for each input, all views on the left and virtual ones on the right.

    Args:
        documents: reports; those of one input share their panels, with their anchors drawn once.
        metric: key of METRICS.
        names: of the reports, to tell apart mvcodec's curves of one input.
        only: names of the anchors to draw; all where empty.
    """
    names = names or [str(document["input"]) for document in documents]
    documents = [_with_anchors(document, only) for document in documents] if only else documents
    groups: dict[tuple[Any, ...], list[tuple[str, Document]]] = {}
    for name, document in zip(names, documents, strict=True):
        key = (document["input"], tuple(document["grid"]), document["frames"])
        groups.setdefault(key, []).append((name, document))
    with look():
        figure = Figure(figsize=(9.5, 3.9 * len(groups) + 0.6), layout="constrained")
        axes = figure.subplots(len(groups), len(CLASSES), squeeze=False)
        labels: dict[str, Line2D] = {}
        for row, members in zip(axes, groups.values(), strict=True):
            for panel, kind in zip(row, CLASSES, strict=True):
                _rd_panel(panel, members, metric, kind, labels)
            title = _input_title(members[0][1])
            row[0].set_title(f"{title}: all views" if len(groups) > 1 else CLASSES["all"], loc="left")
            row[1].set_title(f"{title}: virtual views" if len(groups) > 1 else CLASSES["virtual"], loc="left")
        lines = sorted(labels.values(), key=lambda line: -line.get_zorder())  # mvcodec's own first
        figure.legend(handles=lines, loc="outside lower center", ncols=3)
    return figure


def split_figure(document: Document) -> Figure:
    """Where mvcodec's bits go: kbit for each frame set, stacked, one bar a QP."""
    points = _ours(document)["points"]
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


def _rd_panel(
    axes: Axes, members: Sequence[tuple[str, Document]], metric: str, kind: str, labels: dict[str, Line2D]
) -> None:
    drawn: set[str] = set()
    # Anchors first, so that mvcodec's own curves lie on top.
    for number, (name, document) in enumerate(members):
        for curve in sorted(document["curves"], key=lambda curve: curve is _ours(document)):
            own = curve is _ours(document)
            label = f"{curve['label']} ({name})" if own and len(members) > 1 else curve["label"]
            points = [point for point in curve["points"] if point[metric][kind] is not None]
            if label in drawn or not points:
                continue
            drawn.add(label)
            rates = [point["kbps"] for point in points]
            values = [point[metric][kind] for point in points]
            (line,) = axes.plot(rates, values, label=label, **_style(curve, number if own else None))
            labels.setdefault(label, line)
    axes.set_xscale("log")
    axes.set_xlabel("Rate of the whole array (kbit/s)")
    axes.set_ylabel(METRICS[metric])
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda rate, _: f"{rate:,.10g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    if not drawn:
        axes.text(0.5, 0.5, "no such view", transform=axes.transAxes, ha="center", color="#666666")


def _style(curve: Mapping[str, Any], own: int | None) -> dict[str, Any]:
    line = CODEC_LINES.get(curve["codec"], "-")
    if own is not None:
        number = own % len(OURS_COLOURS)
        return {
            "color": OURS_COLOURS[number],
            "marker": OURS_MARKERS[number],
            "linestyle": line,
            "linewidth": 2.4,
            "markersize": 6.5,
            "zorder": OWN_ZORDER,
        }
    colour, marker = ANCHOR_STYLES.get(curve["anchor"], ("#666666", "."))
    return {"color": colour, "marker": marker, "linestyle": line, "markerfacecolor": "white"}


def _with_anchors(document: Document, names: Sequence[str]) -> Document:
    curves = [curve for curve in document["curves"] if curve["anchor"] is None or curve["name"] in names]
    return {**document, "curves": curves}


def _ours(document: Document) -> Mapping[str, Any]:
    curve: Mapping[str, Any] = document["curves"][0]
    return curve


def _input_title(document: Document) -> str:
    rows, cols = document["grid"]
    return f"{document['input']}, {rows} x {cols}"


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

"""The rate-distortion figure of one report or more: each input has panels, equal anchors are drawn once."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from mvcodec.evaluation.figures import METRICS, Document, look, own_curve
from mvcodec.video.codecs import CODECS

# Okabe and Ito's palette (2008).
OURS_COLOURS = ("#D55E00", "#000000", "#E69F00", "#8C510A")
OURS_MARKERS = ("o", "P", "X", "*")
ANCHOR_STYLES = {
    "simulcast": ("#0072B2", "s"),
    "simulcast-b": ("#56B4E9", "D"),
    "pvs": ("#009E73", "^"),
    "pvs-rows": ("#CC79A7", "v"),
}
ANCHOR_FACES = ("white", None, "#666666", "#d9d9d9")
"""Fill of the markers of one anchor's curves that differ between reports; None is the curve's colour."""

_LINES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)))
CODEC_LINES: dict[str, Any] = dict(zip(CODECS, itertools.cycle(_LINES), strict=False))
"""Key of CODECS -> how its curves are drawn."""

CLASSES = {"all": "all views", "virtual": "virtual views"}

OWN_ZORDER = 5

_Member = tuple[str, Document]
"""A report and its name."""


@dataclass(frozen=True, slots=True)
class _Drawn:
    """A curve as it is drawn in each panel of its input."""

    label: str
    curve: Mapping[str, Any]
    style: Mapping[str, Any]


def rd_figure(
    documents: Sequence[Document],
    metric: str = "psnr_y",
    names: Sequence[str] = (),
    only: Sequence[str] = (),
) -> Figure:
    """Quality over rate: a row for each input, all views on the left and virtual ones on the right.

    Args:
        documents: reports; those of the same pictures share their panels. An anchor that has the same
            points in several of them is drawn once, else each with the names of its reports.
        metric: key of METRICS.
        names: of the reports, different ones; to tell apart what is of one input.
        only: names of the anchors to draw; all where empty.
    """
    names = names or [str(document["input"]) for document in documents]
    groups: dict[tuple[Any, ...], list[_Member]] = {}
    for name, document in zip(names, documents, strict=True):
        groups.setdefault(_input_of(document), []).append((name, document))
    with look():
        figure = Figure(figsize=(9.5, 3.9 * len(groups) + 0.6), layout="constrained")
        axes = figure.subplots(len(groups), len(CLASSES), squeeze=False)
        legend: dict[str, Line2D] = {}
        titles = _titles(list(groups.values()))
        for row, members, (input_, details) in zip(axes, groups.values(), titles, strict=True):
            drawn = _curves(members, only)
            for panel, (kind, what) in zip(row, CLASSES.items(), strict=True):
                _draw_panel(panel, drawn, metric, kind, legend)
                title = f"{input_}: {what}{details}" if len(groups) > 1 else what.capitalize()
                panel.set_title(title, loc="left")
        lines = sorted(legend.values(), key=lambda line: -line.get_zorder())  # mvcodec's own first
        figure.legend(handles=lines, loc="outside lower center", ncols=3)
    return figure


def _input_of(document: Document) -> tuple[Any, ...]:
    """What is equal in reports of the same pictures; older ones do not have all of it."""
    pictures = document.get("pictures", document.get("path"))
    grid, size = tuple(document["grid"]), tuple(document.get("size", ()))
    frames = document.get("first_frame"), document["frames"], document.get("fps")
    return document["input"], grid, size, *frames, pictures


def _titles(groups: Sequence[Sequence[_Member]]) -> list[tuple[str, str]]:
    """(input, details) of each group, no two alike."""
    titles = []
    for members in groups:
        document = members[0][1]
        rows, cols = document["grid"]
        first, count = document.get("first_frame", 0), document["frames"]
        details = f"frames {first} to {first + count - 1}" if count > 1 else f"frame {first}"
        if "size" in document:
            details = "{} x {} px, ".format(*document["size"]) + details
        titles.append((f"{document['input']}, {rows} x {cols}", f"\n{details}"))
    return [
        (title[0], f"{title[1]} ({_listed(members)})") if titles.count(title) > 1 else title
        for title, members in zip(titles, groups, strict=True)
    ]


def _listed(members: Sequence[_Member]) -> str:
    return ", ".join(name for name, _ in members)


def _curves(members: Sequence[_Member], only: Sequence[str]) -> list[_Drawn]:
    """Anchors first, so that mvcodec's own curves lie on top."""
    variants: dict[str, dict[str, list[tuple[str, Mapping[str, Any]]]]] = {}
    for name, document in members:
        for curve in document["curves"][1:]:
            if not only or curve["name"] in only:
                points = repr([[point[key] for key in ("kbps", *METRICS)] for point in curve["points"]])
                variants.setdefault(curve["label"], {}).setdefault(points, []).append((name, curve))
    drawn = []
    for label, found in variants.items():
        for number, same in enumerate(found.values()):
            text = label if len(found) == 1 else f"{label} ({_listed(same)})"
            drawn.append(_Drawn(text, same[0][1], _anchor_style(same[0][1], number)))
    for number, (name, document) in enumerate(members):
        curve = own_curve(document)
        text = curve["label"] if len(members) == 1 else f"{curve['label']} ({name})"
        drawn.append(_Drawn(text, curve, _own_style(curve, number)))
    return drawn


def _draw_panel(
    axes: Axes, drawn: Sequence[_Drawn], metric: str, kind: str, legend: dict[str, Line2D]
) -> None:
    for one in drawn:
        points = [point for point in one.curve["points"] if point[metric][kind] is not None]
        if points:
            rates = [point["kbps"] for point in points]
            values = [point[metric][kind] for point in points]
            (line,) = axes.plot(rates, values, label=one.label, **one.style)
            legend.setdefault(one.label, line)
    axes.set_xscale("log")
    axes.set_xlabel("Rate of the whole array (kbit/s)")
    axes.set_ylabel(METRICS[metric])
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda rate, _: f"{rate:,.10g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    if not axes.lines:
        axes.text(0.5, 0.5, "no such view", transform=axes.transAxes, ha="center", color="#666666")


def _own_style(curve: Mapping[str, Any], number: int) -> dict[str, Any]:
    return {
        "color": OURS_COLOURS[number % len(OURS_COLOURS)],
        "marker": OURS_MARKERS[number % len(OURS_MARKERS)],
        "linestyle": CODEC_LINES.get(curve["codec"], "-"),
        "linewidth": 2.4,
        "markersize": 6.5,
        "zorder": OWN_ZORDER,
    }


def _anchor_style(curve: Mapping[str, Any], number: int) -> dict[str, Any]:
    colour, marker = ANCHOR_STYLES.get(curve["anchor"], ("#666666", "."))
    face = ANCHOR_FACES[number % len(ANCHOR_FACES)] or colour
    line = CODEC_LINES.get(curve["codec"], "-")
    return {"color": colour, "marker": marker, "linestyle": line, "markerfacecolor": face}

"""Writes a report: report.json, report.html, rd.png, rd.svg, views.csv."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.errors import OutputError
from mvcodec.evaluation import figures
from mvcodec.evaluation.chain import decode_view
from mvcodec.evaluation.document import make_document
from mvcodec.evaluation.metrics import SSIM_WINDOW, ssim_map
from mvcodec.evaluation.page import Shown, make_page
from mvcodec.evaluation.points import CurvePoint
from mvcodec.evaluation.rate_figure import rd_figure
from mvcodec.evaluation.study import OURS, StudyRun
from mvcodec.synthesis.synthesizers import make_synthesizer

RD_TEXT = (
    "Luma PSNR as the mean over all pictures of the class. Anchors code every view of the array and are"
    " counted without any container; mvcodec codes the real cameras, synthesises the other views, and is"
    " counted with its container."
)
HEAT_TEXT = "Mean luma PSNR of each view as mvcodec decodes or synthesises it; the coded cameras are framed."

FILES = ("report.json", "report.html", "rd.png", "rd.svg", "views.csv")


def write_report(folder: Path, run: StudyRun, points: Mapping[str, Sequence[CurvePoint]]) -> dict[str, Any]:
    """Write all files; returns what report.json holds.

    Raises:
        OutputError: the system refuses.
    """
    document = make_document(run, points)
    rate_distortion = rd_figure([document])
    shown = [
        Shown("Rate and quality", figures.svg(rate_distortion), RD_TEXT),
        Shown("Rate and structural similarity", figures.svg(rd_figure([document], "ssim")), ""),
        Shown("Where mvcodec's bits go", figures.svg(figures.split_figure(document)), ""),
        Shown(
            "Quality over the array",
            figures.svg(figures.heat_figure(document, _view_maps(run, points[OURS]))),
            HEAT_TEXT,
        ),
    ]
    if min(run.source.array.width, run.source.array.height) >= SSIM_WINDOW:
        shown.append(_worst_view(run, points[OURS]))
    contents = {
        "rd.png": figures.png(rate_distortion),
        "rd.svg": figures.svg(rate_distortion),
        "views.csv": _table_of_views(points).encode(),
        "report.html": make_page(document, shown).encode(),
        # Last: where it is, the others are.
        "report.json": (json.dumps(document, indent=1) + "\n").encode(),
    }
    for name, data in contents.items():
        _write(folder / name, data)
    return document


def _view_maps(run: StudyRun, points: Sequence[CurvePoint]) -> dict[int, NDArray[np.float64]]:
    array = run.source.array
    maps = {}
    for point in points:
        values = np.zeros((array.rows, array.cols))
        for view in point.quality.views:
            values[view.position] = view.psnr_y
        maps[point.qp] = values
    return maps


def _worst_view(run: StudyRun, points: Sequence[CurvePoint]) -> Shown:
    view = worst_view(points)
    number = len(run.chosen) // 2
    synthesizer = make_synthesizer(run.study.synthesizer)
    maps: dict[int, NDArray[np.float64]] = {}
    for point in points:
        assert point.file is not None
        file = run.store.folder / point.file
        original, picture = decode_view(run.source, run.chosen, number, file, synthesizer, view)
        maps[point.qp] = ssim_map(original, picture)
    frame = run.source.first_frame + run.chosen[number]
    text = (
        f"View ({view[0]}, {view[1]}), the one of the lowest mean PSNR over all QPs, in frame {frame}."
        " Dark is where it differs most from the original."
    )
    return Shown("The worst view", figures.png(figures.ssim_figure(original, maps)), text)


def worst_view(points: Sequence[CurvePoint]) -> Position:
    """The view whose PSNR is lowest in the mean over a curve's points."""
    views: dict[Position, list[float]] = {}
    for point in points:
        for view in point.quality.views:
            views.setdefault(view.position, []).append(view.psnr_y)
    return min(views, key=lambda view: fmean(views[view]))


def _table_of_views(points: Mapping[str, Sequence[CurvePoint]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["curve", "qp", "row", "col", "kind", "psnr_y_db", "ssim"])
    for name, curve in points.items():
        for point in curve:
            for view in point.quality.views:
                kind = "real" if view.real else "virtual"
                figures_ = f"{view.psnr_y:.4f}", f"{view.ssim:.6f}"
                writer.writerow([name, point.qp, *view.position, kind, *figures_])
    return text.getvalue()


def _write(path: Path, data: bytes) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        raise OutputError(path, error.strerror or error) from None

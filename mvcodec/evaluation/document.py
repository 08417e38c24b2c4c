"""`report.json`: the measured curves, their distances, and what they were measured with."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from mvcodec.evaluation.bd import (
    CurveDelta,
    RatePoint,
    anchor_lead,
    compare_curves,
    curve_warnings,
)
from mvcodec.evaluation.fingerprint import measuring_versions
from mvcodec.evaluation.points import CurvePoint
from mvcodec.evaluation.study import Curve, StudyRun
from mvcodec.stream import view_name

LIBRARIES = ("bjontegaard", "matplotlib", "scipy")
"""What turns points into a report."""

KINDS = ("all", "virtual")


def make_document(run: StudyRun, points: Mapping[str, Sequence[CurvePoint]]) -> dict[str, Any]:
    """The whole of report.json, as plain JSON values."""
    source, array, curves = run.source, run.source.array, run.study.curves
    ours, anchors = curves[0], [curve for curve in curves if curve.anchor is not None]
    deltas = {curve.name: _delta(points[curve.name], points[ours.name]) for curve in anchors}
    warnings = _repetitions(run)
    for curve in curves:
        by_kind = (_rate_points(points[curve.name], kind) for kind in KINDS)
        texts = dict.fromkeys(text for found in by_kind if found for text in curve_warnings(found))
        warnings += [f"{curve.label}: {text}" for text in texts]
    return {
        "input": array.name or source.name,
        "path": source.name,
        "pictures": run.facts.pictures,
        "grid": [array.rows, array.cols],
        "size": [array.width, array.height],
        "fps": array.fps,
        "real": [list(camera) for camera in array.real],
        "frames": len(run.chosen),
        "first_frame": source.first_frame + run.chosen.start,
        "curves": [_curve(run, curve, points[curve.name]) for curve in curves],
        "bd_rate": deltas,
        "repeated_pictures": [
            [{"view": list(view), "frame": frame} for view, frame in group] for group in run.facts.repeated
        ],
        "warnings": warnings,
        "settings": {
            "qp": list(run.study.qps),
            "anchors": list(run.study.anchors),
            "anchor_codecs": list(run.study.anchor_codecs),
            "jobs": run.study.jobs,
        },
        "versions": versions(),
    }


def every_warning(document: Mapping[str, Any]) -> list[str]:
    """What a reader of a report must know, a line each: of the input, of curves, of BD figures."""
    labels = {curve["name"]: curve["label"] for curve in document["curves"]}
    return [
        *document["warnings"],
        *(
            f"BD figures against {labels[name]}: {'; '.join(delta['warnings'])}"
            for name, delta in document["bd_rate"].items()
            if delta["warnings"]
        ),
    ]


def versions() -> dict[str, str]:
    """Versions of what a report is made with."""
    return {**measuring_versions(), **{name: importlib.metadata.version(name) for name in LIBRARIES}}


def _curve(run: StudyRun, curve: Curve, points: Sequence[CurvePoint]) -> dict[str, Any]:
    return {
        "name": curve.name,
        "label": curve.label,
        "codec": curve.codec,
        "anchor": None if curve.anchor is None else curve.anchor.name,
        "options": dict(run.options(curve, curve.qps[0])),
        "points": [point.to_json() for point in points],
        "versions": _distinct(dict(point.versions) for point in points),
    }


def _distinct(found: Iterable[dict[str, str]]) -> list[dict[str, str]]:
    return [dict(items) for items in dict.fromkeys(tuple(sorted(versions.items())) for versions in found)]


def _delta(anchor: Sequence[CurvePoint], ours: Sequence[CurvePoint]) -> dict[str, Any]:
    """One entry of bd_rate: percent by class of views, and what they rest on."""
    by_kind = {kind: (_rate_points(anchor, kind), _rate_points(ours, kind)) for kind in KINDS}
    found = {
        kind: compare_curves(*pair) if pair[1] else CurveDelta(None, None, None, ())
        for kind, pair in by_kind.items()
    }
    lead = anchor_lead(*by_kind["all"])
    overlap, virtual = found["all"].overlap_db, found["virtual"].overlap_db
    return {
        "all": found["all"].rate_percent,
        "virtual": found["virtual"].rate_percent,
        "overlap_db": None if overlap is None else list(overlap),
        "virtual_overlap_db": None if virtual is None else list(virtual),
        "bd_psnr_db": {kind: found[kind].psnr_db for kind in KINDS},
        "overtaken": None if lead.overtaking is None else asdict(lead.overtaking),
        "anchor_ahead_kbps": [list(rates) for rates in lead.ranges_kbps],
        "warnings": [f"{kind} views: {text}" for kind in KINDS for text in found[kind].warnings],
    }


def _rate_points(points: Sequence[CurvePoint], kind: str) -> list[RatePoint]:
    pairs = [(point.kbps, point.quality.psnr_y.to_json()[kind]) for point in points]
    return [(rate, decibel) for rate, decibel in pairs if decibel is not None]


def _repetitions(run: StudyRun) -> list[str]:
    groups = run.facts.repeated
    if not groups:
        return []
    places = [f"{view_name(view)} frame {frame}" for view, frame in groups[0]]
    extra = sum(len(group) - 1 for group in groups)
    return [
        f"{extra} pictures of the input repeat others (such as {' = '.join(places[:3])}):"
        " a pseudo-video sequence gets them for nothing"
    ]

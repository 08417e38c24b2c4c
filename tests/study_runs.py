"""A small study on a small array: two points a curve, simulcast as its anchor."""

from __future__ import annotations

from pathlib import Path

from small_arrays import write_array

from mvcodec.capture import open_input
from mvcodec.encoding.encoder import EncoderConfig
from mvcodec.evaluation.fingerprint import examine
from mvcodec.evaluation.points import PointStore
from mvcodec.evaluation.study import Study, StudyRun


def study_run(folder: Path, span: tuple[float, float] | None, matcher: str = "joint") -> StudyRun:
    """A run with an array and points of its own in the folder; `span` is the disparity range, px."""
    source = open_input([write_array(folder / "array", frames=2)])
    settings = EncoderConfig(preset="ultrafast", disparity_range_px=span, matcher=matcher)
    study = Study((30, 40), settings, "linear", ("simulcast",), ("h264",))
    facts = examine(source, range(2))
    return StudyRun(study, source, range(2), facts, PointStore(folder / "p"), lambda _: None)

"""``mvcodec evaluate``: rate and distortion of an array against stock codecs, as a report."""

from __future__ import annotations

import argparse
import re
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mvcodec.capture import ArraySource, open_input, resolve_frames
from mvcodec.cli.arguments import add_frames, add_output_options, add_synthesizer, codec_name, positive_int
from mvcodec.cli.cluster_options import add_cluster, place
from mvcodec.cli.coding_options import (
    add_coding,
    add_input,
    check_exact_range,
    checked_config,
    find_range,
    with_keyframe_ratio,
)
from mvcodec.cli.layer_options import add_layer, layer_settings
from mvcodec.cli.paths import check_folder_target
from mvcodec.cli.progress import progress
from mvcodec.cluster.connection import connected
from mvcodec.cluster.places import Place
from mvcodec.errors import MvCodecWarning, OutputError, require_packages
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.video.codecs import ANCHOR_CODECS, CODECS
from mvcodec.workers import thread_count

if TYPE_CHECKING:
    from mvcodec.evaluation.points import CurvePoint
    from mvcodec.evaluation.study import Study, StudyRun

EXTRA = "evaluate"
PACKAGES = ("bjontegaard", "matplotlib")
DEFAULT_QPS = (22, 27, 32, 37)
POINTS = "points"
"""The folder of measured points, inside of the report's."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``evaluate``."""
    add_input(parser, "an array folder, or R*C videos in row order with --grid; or its URL", place)
    parser.add_argument(
        "--output",
        type=Path,
        required=True,
        metavar="REPORT",
        help="a folder for the report alone; points that it holds already are not measured again",
    )
    parser.add_argument(
        "--qp", type=_whole_numbers, metavar="N,N..", help="of the pictures (default: 22,27,32,37)"
    )
    parser.add_argument(
        "--anchors",
        type=_names,
        metavar="NAME,..",
        help="some of simulcast, pvs (default: both; simulcast without B-frames is always there)",
    )
    parser.add_argument(
        "--anchor-codecs",
        type=_codecs,
        metavar="NAME,..",
        help=f"codecs of the anchors, some of {', '.join(CODECS)} (default: {', '.join(ANCHOR_CODECS)})",
    )
    add_coding(parser)
    add_layer(parser)
    add_synthesizer(parser)
    parser.add_argument(
        "--jobs",
        type=positive_int,
        metavar="N",
        help="anchors coded side by side (default: as many as --threads)",
    )
    add_cluster(parser)
    add_frames(parser, "frames of the input to evaluate")
    add_output_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Measure what is not measured yet, and write the report."""
    require_packages(PACKAGES, EXTRA)
    output: Path = arguments.output
    if output.exists() and not output.is_dir():
        raise OutputError(output, "it is a file; a report is a folder")
    from mvcodec.evaluation.report import FILES

    names = "|".join(map(re.escape, (*FILES, POINTS)))
    check_folder_target(output, names, overwrite=True)  # a report that is there is brought up to date
    with ExitStack() as stack:
        _evaluate(arguments, stack)


def _evaluate(arguments: argparse.Namespace, stack: ExitStack) -> None:
    from mvcodec.evaluation.document import every_warning
    from mvcodec.evaluation.fingerprint import examine
    from mvcodec.evaluation.points import PointStore
    from mvcodec.evaluation.report import FILES, write_report
    from mvcodec.evaluation.study import StudyRun

    output: Path = arguments.output
    source = open_input(_inputs(arguments, stack), grid=arguments.grid, real=arguments.real)
    chosen = resolve_frames(arguments.frames, source.frame_count, source.name)
    check_exact_range(arguments)
    range_px = find_range(source, chosen, arguments.disparity_range_px, exact=arguments.exact_range)
    study = _study(source, chosen, arguments, range_px)
    facts = examine(source, chosen)
    store = PointStore(output / POINTS)
    with progress("evaluate", None, quiet=arguments.quiet, unit="picture") as bar:
        measuring = StudyRun(study, source, chosen, facts, store, bar.update)
        bar.total = measuring.picture_count
        points = _measured(arguments, measuring, bar.update)
    document = write_report(output, measuring, points)
    for text in every_warning(document):
        warnings.warn(text, MvCodecWarning, stacklevel=2)
    if not arguments.quiet:
        print(table(document))
        print(f"\nIn {output}: {', '.join(FILES)}")


def _inputs(arguments: argparse.Namespace, stack: ExitStack) -> list[Path]:
    """The inputs on this machine; those behind addresses are fetched, for workers to do the same."""
    return [
        stack.enter_context(Place(item).fetched()) if isinstance(item, str) else item
        for item in arguments.input
    ]


def _measured(
    arguments: argparse.Namespace, run: StudyRun, on_pictures: Callable[[int], object]
) -> dict[str, list[CurvePoint]]:
    """The points, measured in this process or by a cluster's workers."""
    if arguments.cluster is None:
        return run.measure()
    from mvcodec.cluster.cluster_study import measure_on_cluster, opening_of

    opening = opening_of(arguments.input, arguments.grid, arguments.real)
    with connected(arguments.cluster, arguments.retries) as client:
        return measure_on_cluster(client, run, opening, arguments.retries, on_pictures)


def table(document: dict[str, Any]) -> str:
    """mvcodec's points, then its distance to each anchor, for people."""
    ours = document["curves"][0]
    head = f"{'QP':>3} {'kbit/s':>10} {'Y-PSNR dB all':>14} {'virtual':>8} {'worst':>7} {'maps':>5}"
    lines = [f"{ours['label']:28} {head}"]
    for point in ours["points"]:
        psnr, share = point["psnr_y"], point["bits_split"]["disparity"] / point["bits"]
        virtual = _cell(psnr["virtual"], "8.2f")
        lines.append(
            f"{'':28} {point['qp']:3} {point['kbps']:10.1f} {psnr['all']:14.2f} {virtual}"
            f" {psnr['worst']:7.2f} {share:5.0%}"
        )
    lines.append(f"\n{'against':28} {'BD-rate all':>12} {'virtual':>9}  quality in common")
    labels = {curve["name"]: curve["label"] for curve in document["curves"]}
    for name, delta in document["bd_rate"].items():
        overlap = delta["overlap_db"]
        common = "none" if overlap is None else f"{overlap[0]:.2f} to {overlap[1]:.2f} dB"
        percent = f"{_cell(delta['all'], '+10.1f')} % {_cell(delta['virtual'], '+7.1f')} %"
        lines.append(f"{labels[name]:28} {percent}  {common}")
    return "\n".join(lines)


def _study(
    source: ArraySource, chosen: range, arguments: argparse.Namespace, range_px: tuple[float, float]
) -> Study:
    from mvcodec.evaluation.anchors import ANCHORS
    from mvcodec.evaluation.study import Study, translate_qps

    make_synthesizer(arguments.synthesizer)  # a wrong name is told before anything is measured
    layer = layer_settings(arguments)
    config = checked_config(source.array, arguments, disparity_range_px=range_px, **layer)
    config = with_keyframe_ratio(source, chosen, config)
    return Study(
        qps=arguments.qp or translate_qps(DEFAULT_QPS, "h264", arguments.codec),
        config=config,
        synthesizer=arguments.synthesizer,
        anchors=arguments.anchors or tuple(ANCHORS),
        anchor_codecs=arguments.anchor_codecs or ANCHOR_CODECS,
        jobs=arguments.jobs or thread_count(),
    )


def _whole_numbers(text: str) -> tuple[int, ...]:
    if not re.fullmatch(r"\d{1,2}(,\d{1,2})*", text):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected whole numbers such as 22,27,32,37")
    return tuple(sorted({int(number) for number in text.split(",")}))


def _names(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name for name in text.split(",") if name))
    if not names:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected names between commas")
    return names


def _codecs(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(map(codec_name, _names(text))))


def _cell(value: float | None, form: str) -> str:
    width = int(form.lstrip("+").split(".")[0])
    return f"{'-':>{width}}" if value is None else f"{value:{form}}"

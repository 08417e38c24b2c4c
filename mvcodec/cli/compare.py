"""``mvcodec compare``: a decoded array folder against its original."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path

from mvcodec.capture import open_input, resolve_frames
from mvcodec.cli.arguments import add_frames, add_output_options
from mvcodec.cli.progress import progress
from mvcodec.evaluation.compare import common_frame_count, compare
from mvcodec.evaluation.provenance import ProvenanceQuality
from mvcodec.evaluation.quality import Comparison


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``compare``."""
    parser.add_argument("original", type=Path, metavar="ORIGINAL", help="array folder")
    parser.add_argument(
        "decoded", type=Path, metavar="DECODED", help="array folder, as decode --format array writes it"
    )
    add_frames(parser, "frames to compare, out of those in both folders")
    parser.add_argument(
        "--provenance",
        type=Path,
        metavar="DIR",
        help="where decode --provenance wrote, mostly DECODED: virtual views by how many cameras saw a pixel",
    )
    add_output_options(parser, "print JSON")


def run(arguments: argparse.Namespace) -> None:
    """Compare and print."""
    original, decoded = open_input([arguments.original]), open_input([arguments.decoded])
    count = common_frame_count(original, decoded)
    total = len(resolve_frames(arguments.frames, count, decoded.name))
    with progress("compare", total, quiet=arguments.quiet) as bar:
        result = compare(
            original, decoded, arguments.frames, provenance=arguments.provenance, on_frame=bar.update
        )
    print(json.dumps(result.to_json()) if arguments.json else table(result))


def table(result: Comparison) -> str:
    """The figures for people: every view, then the means, then those by provenance."""
    lines = [f"{'view':10} {'kind':8} {'Y-PSNR dB':>9} {'SSIM':>7}"]
    for view in result.views:
        kind = "real" if view.real else "virtual"
        name = f"({view.position[0]}, {view.position[1]})"
        lines.append(f"{name:10} {kind:8} {view.psnr_y:9.2f} {view.ssim:7.4f}")
    psnr, ssim = result.psnr_y.to_json(), result.ssim.to_json()
    for kind, decibel in psnr.items():
        similarity = ssim[kind]
        figures = (
            "no such view" if decibel is None or similarity is None else f"{decibel:9.2f} {similarity:7.4f}"
        )
        lines.append(
            f"{'worst view' if kind == 'worst' else 'mean':10} {'' if kind == 'worst' else kind:8} {figures}"
        )
    if result.by_provenance is not None:
        lines += ["", *_provenance_lines(result.by_provenance)]
    return "\n".join(lines)


def _provenance_lines(by_cameras: Mapping[int, ProvenanceQuality]) -> list[str]:
    lines = [f"{'virtual views':19} {'Y-PSNR dB':>9} {'pixels':>7} {'squared error':>14}"]
    for cameras, quality in by_cameras.items():
        name = f"seen by {cameras}" if cameras else "filled"
        error = "none" if quality.error_share is None else f"{quality.error_share:.2%}"
        lines.append(f"{name:19} {quality.psnr_y:9.2f} {quality.share:7.2%} {error:>14}")
    return lines if by_cameras else ["no virtual view"]

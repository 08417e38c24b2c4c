"""``mvcodec compare``: a decoded array folder against its original."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from mvcodec.array import Position
from mvcodec.capture import ArraySource, open_input, resolve_frames
from mvcodec.cli.arguments import add_frames, add_output_options
from mvcodec.cli.paths import PICTURE_NAMES, add_overwrite, check_folder_target
from mvcodec.cli.progress import progress
from mvcodec.errors import SettingError
from mvcodec.evaluation.comparison import common_frame_count, compare
from mvcodec.evaluation.decoded_file import DecodedFile
from mvcodec.evaluation.quality import Comparison
from mvcodec.evaluation.quality_by_provenance import ProvenanceQuality
from mvcodec.frames import Picture
from mvcodec.output.pictures import write_png
from mvcodec.stream import view_name
from mvcodec.synthesis.synthesizers import DEFAULT_SYNTHESIZER, make_synthesizer

SUFFIX = ".mcap"
COLUMNS = {
    "psnr_y": ("Y-PSNR dB", 9, 2),
    "psnr_yuv": ("YUV dB", 7, 2),
    "ssim": ("SSIM", 7, 4),
    "temporal_psnr_y": ("temporal dB", 11, 2),
    "iv_psnr": ("IV-PSNR dB", 10, 2),
}
"""Title, width and decimals of each metric."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``compare``."""
    parser.add_argument("original", type=Path, metavar="ORIGINAL", help="array folder")
    parser.add_argument(
        "decoded",
        type=Path,
        metavar="DECODED",
        help="array folder, as decode --format array writes it, or an .mcap file, which is decoded meanwhile",
    )
    add_frames(parser, "frames to compare, out of those in both folders")
    parser.add_argument(
        "--provenance",
        type=Path,
        metavar="DIR",
        help="where decode --provenance wrote, mostly DECODED: virtual views by how many cameras saw a pixel",
    )
    parser.add_argument(
        "--iv-psnr",
        action="store_true",
        help="IV-PSNR as well, which takes some 17 times as long as all others",
    )
    parser.add_argument(
        "--ssim-maps",
        type=Path,
        metavar="DIR",
        help="write each view's SSIM map of the first compared frame, as DIR/rRR_cCC.png: white is alike",
    )
    add_overwrite(parser)
    add_output_options(parser, "print JSON")


def run(arguments: argparse.Namespace) -> None:
    """Compare and print."""
    if arguments.ssim_maps is not None:
        check_folder_target(arguments.ssim_maps, rf"{PICTURE_NAMES}\.png", overwrite=arguments.overwrite)
    original, decoded = open_input([arguments.original]), _open_decoded(arguments)
    count = common_frame_count(original, decoded)
    total = len(resolve_frames(arguments.frames, count, decoded.name))
    with progress("compare", total, quiet=arguments.quiet) as bar:
        result = compare(
            original,
            decoded,
            arguments.frames,
            provenance=arguments.provenance,
            immersive=arguments.iv_psnr,
            on_ssim_map=arguments.ssim_maps and partial(_write_map, arguments.ssim_maps),
            on_frame=bar.update,
        )
    print(json.dumps(result.to_json()) if arguments.json else table(result))


def _open_decoded(arguments: argparse.Namespace) -> ArraySource:
    if arguments.decoded.suffix.lower() != SUFFIX:
        return open_input([arguments.decoded])
    if arguments.provenance is not None:
        raise SettingError(
            "--provenance", f"with {arguments.decoded}", "as DECODED what decode --provenance wrote"
        )
    return DecodedFile(arguments.decoded, make_synthesizer(DEFAULT_SYNTHESIZER))


def table(result: Comparison) -> str:
    """The figures for people: every view, then the means, then those by provenance."""
    columns = [COLUMNS[metric] for metric in result.measured]
    lines = [f"{'view':10} {'kind':8}" + "".join(f" {title:>{width}}" for title, width, _ in columns)]
    for view in result.views:
        name, kind = f"({view.position[0]}, {view.position[1]})", "real" if view.real else "virtual"
        figures = [getattr(view, metric) for metric in result.measured]
        lines.append(f"{name:10} {kind:8}{_cells(figures, columns)}")
    summaries = [result.summary(metric).to_json() for metric in result.measured]
    for kind in summaries[0]:
        name = f"{'worst view':10} {'':8}" if kind == "worst" else f"{'mean':10} {kind:8}"
        lines.append(name + _cells([summary[kind] for summary in summaries], columns))
    if result.by_provenance is not None:
        lines += ["", *_provenance_lines(result.by_provenance)]
    return "\n".join(lines)


def _cells(figures: Sequence[float | None], columns: Sequence[tuple[str, int, int]]) -> str:
    cells = [
        f" {figure:{width}.{digits}f}"
        for figure, (_, width, digits) in zip(figures, columns, strict=True)
        if figure is not None
    ]
    return "".join(cells) or " no such view"


def _write_map(folder: Path, view: Position, picture: Picture) -> None:
    write_png(folder / f"{view_name(view)}.png", picture)


def _provenance_lines(by_cameras: Mapping[int, ProvenanceQuality]) -> list[str]:
    lines = [f"{'virtual views':19} {'Y-PSNR dB':>9} {'pixels':>7} {'squared error':>14}"]
    for cameras, quality in by_cameras.items():
        name = f"seen by {cameras}" if cameras else "filled"
        error = "none" if quality.error_share is None else f"{quality.error_share:.2%}"
        lines.append(f"{name:19} {quality.psnr_y:9.2f} {quality.share:7.2%} {error:>14}")
    return lines if by_cameras else ["no virtual view"]

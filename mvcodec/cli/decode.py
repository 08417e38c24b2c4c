"""``mvcodec decode``: one MCAP file in, synthesised views out."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import BinaryIO

from mvcodec.array import Viewpoint
from mvcodec.cli.arguments import add_frames, add_output_options, pair_of_sizes, view
from mvcodec.cli.progress import progress
from mvcodec.cli.view_outputs import FORMATS, ViewGrid, check_output, make_output
from mvcodec.container import McapReader
from mvcodec.decoder import Decoder
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet, Picture
from mvcodec.stream import StreamHeader
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.table import SYNTHESIZERS, make_synthesizer

STANDARD_INPUT = "-"
DEFAULT_SYNTHESIZER = "layered"
THREADS = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``decode``."""
    parser.add_argument("input", metavar="IN.mcap", help="or - for standard input")
    parser.add_argument(
        "output", type=Path, metavar="OUT", help="a folder; for --format mosaic a .mp4 or .png file"
    )
    parser.add_argument("--format", choices=FORMATS, help="default: array, or png with --view")
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--grid",
        type=pair_of_sizes,
        metavar="RxC",
        help="views over the span of the real cameras (default: the input's)",
    )
    which.add_argument(
        "--view",
        type=view,
        action="append",
        metavar="ROW,COL",
        help="one view, in steps of the input's grid; repeatable",
    )
    parser.add_argument(
        "--synthesizer",
        default=DEFAULT_SYNTHESIZER,
        metavar="NAME",
        help=f"one of {', '.join(SYNTHESIZERS)} (default: %(default)s)",
    )
    add_frames(parser, "frames of the file to decode")
    add_output_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Decode, render every view of each frame set on both cores, write."""
    synthesizer = make_synthesizer(arguments.synthesizer)
    form = arguments.format or ("png" if arguments.view else "array")
    if form == "array" and arguments.view:
        raise SettingError("--view", "with --format array", "--grid RxC, since an array folder holds a grid")
    source: Path | BinaryIO = sys.stdin.buffer
    if arguments.input != STANDARD_INPUT:
        source = Path(arguments.input)
        if source.resolve() == arguments.output.resolve():
            raise SettingError("OUT", arguments.output, "another file than IN.mcap")
    check_output(form, arguments.output)
    with Decoder.open(source, arguments.frames) as decoder:
        views = _view_grid(decoder.header, arguments)
        with (
            make_output(form, arguments.output, views) as output,
            ThreadPoolExecutor(THREADS, "render") as pool,
            progress("decode", _frame_total(source, arguments.frames), quiet=arguments.quiet) as bar,
        ):
            for decoded in decoder:
                output.push(_render(synthesizer, decoded, views.viewpoints, pool), decoded.index)
                bar.update()
                if output.complete:
                    break


def _render(
    synthesizer: Synthesizer, decoded: DecodedSet, viewpoints: Sequence[Viewpoint], pool: ThreadPoolExecutor
) -> list[Picture]:
    return list(pool.map(lambda viewpoint: synthesizer.render(decoded, viewpoint).pixels, viewpoints))


def _view_grid(header: StreamHeader, arguments: argparse.Namespace) -> ViewGrid:
    array = header.array
    if not arguments.view:
        rows, cols = arguments.grid or (array.rows, array.cols)
        return ViewGrid(array, rows, cols, array.viewpoints(rows, cols))
    viewpoints = tuple(Viewpoint(*place) for place in arguments.view)
    for viewpoint in viewpoints:
        array.check_viewpoint(viewpoint)
    return ViewGrid(array, 1, len(viewpoints), viewpoints, named_by_place=False)


def _frame_total(source: Path | BinaryIO, frames: slice | None) -> int | None:
    """How many frames the progress bar counts to; unknown where the input cannot be read twice."""
    if not isinstance(source, Path) or not sys.stderr.isatty():
        return None
    with McapReader.open(source) as reader:
        count = reader.frame_count
    return None if count is None else len(range(*(frames or slice(None)).indices(count)))

"""``mvcodec decode``: one MCAP file in, synthesised views out."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from mvcodec.array import Viewpoint
from mvcodec.cli.arguments import add_frames, add_output_options, pair_of_sizes, view
from mvcodec.cli.progress import progress
from mvcodec.container import McapReader
from mvcodec.decoder import Decoder
from mvcodec.errors import OutputError, SettingError
from mvcodec.frames import DecodedSet, Picture
from mvcodec.output.forms import FORMS, OutputPlan, ViewWriter, open_form
from mvcodec.stream import StreamHeader
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.table import SYNTHESIZERS, make_synthesizer

STANDARD_INPUT = "-"
DEFAULT_SYNTHESIZER = "layered"
MOSAIC = "mosaic"
MOSAIC_SUFFIXES = (".mp4", ".png")
THREADS = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``decode``."""
    parser.add_argument("input", metavar="IN.mcap", help="or - for standard input")
    parser.add_argument(
        "output", type=Path, metavar="OUT", help="a folder; for --format mosaic a .mp4 or .png file"
    )
    parser.add_argument("--format", choices=FORMS, help="default: array, or png with --view")
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
        raise SettingError("--view", "single views", "--grid RxC for --format array, which holds a grid")
    source: Path | BinaryIO = sys.stdin.buffer
    if arguments.input != STANDARD_INPUT:
        source = Path(arguments.input)
        if source.resolve() == arguments.output.resolve():
            raise SettingError("OUT", arguments.output, "another file than IN.mcap")
    _check_output(form, arguments.output)
    with (
        Decoder.open(source, arguments.frames) as decoder,
        ThreadPoolExecutor(THREADS, "render") as pool,
        progress("decode", _frame_total(source, arguments.frames), quiet=arguments.quiet) as bar,
        ExitStack() as outputs,
    ):
        plan = _plan(decoder.header, arguments)
        writer: ViewWriter | None = None
        for decoded in decoder:
            if writer is None:
                plan = replace(plan, first_frame=decoded.index)
                writer = outputs.enter_context(open_form(form, arguments.output, plan))
            writer.push(_render(synthesizer, decoded, plan.viewpoints, pool))
            bar.update()
            if form == MOSAIC and arguments.output.suffix.lower() == ".png":
                break  # one picture holds one frame set


def _check_output(form: str, path: Path) -> None:
    """Refuse what cannot be written before any work is done."""
    if form != MOSAIC:
        if path.exists() and not path.is_dir():
            raise OutputError(path, f"it is a file, --format {form} needs a folder")
    elif path.suffix.lower() not in MOSAIC_SUFFIXES:
        expected = f"a name that ends in {' or '.join(MOSAIC_SUFFIXES)} for --format {MOSAIC}"
        raise SettingError("OUT", path, expected)
    elif path.is_dir():
        raise OutputError(path, f"it is a folder, --format {MOSAIC} needs a file")


def _render(
    synthesizer: Synthesizer, decoded: DecodedSet, viewpoints: Sequence[Viewpoint], pool: ThreadPoolExecutor
) -> list[Picture]:
    return list(pool.map(lambda viewpoint: synthesizer.render(decoded, viewpoint).pixels, viewpoints))


def _plan(header: StreamHeader, arguments: argparse.Namespace) -> OutputPlan:
    array = header.array
    if arguments.view:
        viewpoints = tuple(Viewpoint(*place) for place in arguments.view)
        for viewpoint in viewpoints:
            array.check_viewpoint(viewpoint)
        return OutputPlan(array, viewpoints, None)
    grid = arguments.grid or (array.rows, array.cols)
    return OutputPlan(array, array.viewpoints(*grid), grid)


def _frame_total(source: Path | BinaryIO, frames: slice | None) -> int | None:
    """How many frames the progress bar counts to; unknown where the input cannot be read twice."""
    if not isinstance(source, Path) or not sys.stderr.isatty():
        return None
    with McapReader.open(source) as reader:
        count = reader.frame_count
    return None if count is None else len(range(*(frames or slice(None)).indices(count)))

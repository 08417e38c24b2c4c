"""``mvcodec decode``: one MCAP file in, synthesised views out."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import BinaryIO, cast

from mvcodec.array import Viewpoint
from mvcodec.cli.arguments import (
    add_frames,
    add_matcher,
    add_output_options,
    add_synthesizer,
    check_matcher,
    pair_of_sizes,
    view,
)
from mvcodec.cli.info import count
from mvcodec.cli.interrupt import deferred_interrupt
from mvcodec.cli.layer_options import add_no_enhancement
from mvcodec.cli.paths import (
    ARRAY_NAMES,
    PICTURE_NAMES,
    VIDEO_NAMES,
    add_overwrite,
    check_file_target,
    check_folder_target,
    local_path,
)
from mvcodec.cli.progress import progress, tell_written
from mvcodec.cli.safety import add_limits, add_on_error, limits_of
from mvcodec.cli.standard_streams import OUTPUT_NAME, STANDARD, standard_input, standard_output
from mvcodec.container import McapReader
from mvcodec.container.chunk_writing import CHUNK_MS
from mvcodec.container.follow import FollowedFile
from mvcodec.container.remote import is_url
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import OutputError, SettingError, StreamError
from mvcodec.frames import DecodedSet, Picture, RenderedView
from mvcodec.output.forms import FORMS, OutputPlan, open_form
from mvcodec.output.mcap_views import McapViews
from mvcodec.output.provenance_pictures import ProvenanceWriter
from mvcodec.stream import StreamHeader
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.synthesis.towards_enhanced import TowardsEnhanced, views_near
from mvcodec.workers import run_all

MOSAIC = "mosaic"
MOSAIC_SUFFIXES = (".mp4", ".png")
MCAP = "mcap"
FORM_OF_ENDING = dict.fromkeys(MOSAIC_SUFFIXES, MOSAIC) | {".mcap": MCAP}
FOLDER_NAMES = {"array": ARRAY_NAMES, "png": PICTURE_NAMES, "mp4": VIDEO_NAMES}
FORMS_WITH_PROVENANCE = ("array", "png")
"""Those whose views are folders of pictures, which it can lie beside."""


Sink = Callable[[DecodedSet, list[RenderedView]], None]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``decode``."""
    parser.add_argument(
        "input", metavar="IN.mcap", help="or its URL on a web server, or - for standard input"
    )
    parser.add_argument(
        "output",
        type=local_path,
        metavar="OUT",
        help="a folder; or by its ending one file: .mp4 or .png, several views as a mosaic, or .mcap, each"
        " view a topic; or - with --format mcap",
    )
    parser.add_argument(
        "--format",
        choices=(*FORMS, MCAP),
        help="default: by OUT's ending; for a folder array, or png with --view",
    )
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
    add_synthesizer(parser)
    add_matcher(parser)
    add_no_enhancement(parser)
    parser.add_argument(
        "--provenance",
        action="store_true",
        help="beside each view's picture 000000.png write 000000.provenance.png, 8-bit RGB: red = number of"
        " real cameras that saw the pixel (0 = filled), green + 256 * blue = its depth layer (1 = farthest,"
        f" 0 = none). For --format {' and '.join(FORMS_WITH_PROVENANCE)}",
    )
    parser.add_argument(
        "--follow", action="store_true", help="wait for more where the file ends, until it is complete"
    )
    add_frames(parser, "frames of the file to decode")
    add_on_error(parser)
    add_limits(parser)
    add_overwrite(parser)
    add_output_options(parser, "print what was decoded, and how much of the input was read, as JSON")


def run(arguments: argparse.Namespace) -> None:
    """Decode, render every view of each frame set side by side, write."""
    synthesizer = TowardsEnhanced(make_synthesizer(arguments.synthesizer))
    form = arguments.format or _form_of(arguments)
    if arguments.json and str(arguments.output) == STANDARD:
        raise SettingError("--json", "with OUT -", "another OUT: both would be standard output")
    if form == "array" and arguments.view:
        raise SettingError("--view", "single views", "--grid RxC for --format array, which holds a grid")
    _check_follow(arguments)
    _check_output(form, arguments)
    damage: StreamError | None = None
    with (
        _source(arguments) as source,
        Decoder.open(
            source,
            arguments.frames,
            arguments.on_error,
            limits_of(arguments),
            arguments.matcher,
            enhanced=() if arguments.no_enhancement else None,
        ) as decoder,
        progress("decode", _frame_total(source, arguments.frames), quiet=arguments.quiet) as bar,
        ExitStack() as outputs,
    ):
        check_matcher(arguments.matcher, decoder.header)
        plan = _plan(decoder.header, arguments)
        if decoder.enhanced is None:
            decoder.enhanced = views_near(decoder.header.array, plan.viewpoints)
        sink: Sink | None = None
        frames = 0
        try:
            for decoded in decoder:
                views = _render(synthesizer, decoded, plan.viewpoints)
                if sink is None:
                    plan = replace(plan, first_frame=decoded.index)
                    sink = _open_sink(form, arguments, plan, outputs)
                sink(decoded, views)
                bar.update()
                frames += 1
                if form == MOSAIC and arguments.output.suffix.lower() == ".png":
                    break  # one picture holds one frame set
        except StreamError as error:
            damage = error  # the outputs are completed first, so that what was decoded stays
        # A closed file has no size.
        report = {"frames": frames, "bytes_read": decoder.bytes_read, "bytes": decoder.bytes}
    if arguments.json:
        print(json.dumps(report))
    elif not arguments.quiet and damage is None:
        of_views = f"{count(frames, 'frame')} of {count(len(plan.viewpoints), 'view')}"
        wrote = str(arguments.output) if str(arguments.output) != STANDARD else OUTPUT_NAME
        tell_written(wrote, of_views, frames, plan.array.fps)
    if damage is not None:
        raise damage


def _form_of(arguments: argparse.Namespace) -> str:
    """The form that OUT's ending names, else that of a folder."""
    folder = "png" if arguments.view else "array"
    return FORM_OF_ENDING.get(arguments.output.suffix.lower(), folder)


@contextmanager
def _source(arguments: argparse.Namespace) -> Iterator[str | BinaryIO]:
    """The input. With --follow, Ctrl-C ends it, as its end does."""
    if arguments.input == STANDARD:
        yield standard_input()
    elif arguments.follow:
        with deferred_interrupt() as interrupted, FollowedFile(Path(arguments.input), interrupted) as file:
            yield cast("BinaryIO", file)
    else:
        yield arguments.input


def _check_follow(arguments: argparse.Namespace) -> None:
    if arguments.follow and (arguments.input == STANDARD or is_url(arguments.input)):
        expected = "the path of a file that grows (standard input is always read as it comes)"
        raise SettingError("--follow", f"IN.mcap {arguments.input}", expected)


def _check_output(form: str, arguments: argparse.Namespace) -> None:
    """Refuse what cannot be written before any work is done."""
    path: Path = arguments.output
    if arguments.input != STANDARD and Path(arguments.input).resolve() == path.resolve():
        raise SettingError("OUT", path, "another file than IN.mcap")
    if arguments.provenance and form not in FORMS_WITH_PROVENANCE:
        allowed = " or ".join(FORMS_WITH_PROVENANCE)
        raise SettingError("--provenance", f"--format {form}", f"--format {allowed}")
    if form not in (MOSAIC, MCAP):
        if str(path) == STANDARD:
            raise SettingError("OUT", path, f"a folder, or --format {MCAP} for standard output")
        if path.exists() and not path.is_dir():
            raise OutputError(path, f"it is a file, --format {form} needs a folder")
        check_folder_target(path, FOLDER_NAMES[form], overwrite=arguments.overwrite)
        return
    suffixes = MOSAIC_SUFFIXES if form == MOSAIC else (".mcap",)
    if path.suffix.lower() not in suffixes and not (form == MCAP and str(path) == STANDARD):
        expected = f"a name that ends in {' or '.join(suffixes)} for --format {form}"
        raise SettingError("OUT", path, expected)
    check_file_target(path, overwrite=arguments.overwrite)


def _open_sink(form: str, arguments: argparse.Namespace, plan: OutputPlan, outputs: ExitStack) -> Sink:
    """What takes the views of each frame set; `outputs` completes it."""
    target: Path = arguments.output
    if form == MCAP:
        live = str(target) == STANDARD
        mcap = outputs.enter_context(
            McapViews(standard_output() if live else target, plan, 0 if live else CHUNK_MS.default)
        )
        return lambda decoded, views: mcap.push(_pictures(views), decoded.index, decoded.time_ns)
    writer = outputs.enter_context(open_form(form, target, plan))
    if not arguments.provenance:
        return lambda decoded, views: writer.push(_pictures(views), decoded.time_ns)
    provenance = ProvenanceWriter(target, plan.names)

    def push(decoded: DecodedSet, views: list[RenderedView]) -> None:
        writer.push(_pictures(views), decoded.time_ns)
        provenance.push(views)

    return push


def _pictures(views: Sequence[RenderedView]) -> list[Picture]:
    return [view.pixels for view in views]


def _render(
    synthesizer: Synthesizer, decoded: DecodedSet, viewpoints: Sequence[Viewpoint]
) -> list[RenderedView]:
    return run_all(partial(synthesizer.render, decoded), viewpoints)


def _plan(header: StreamHeader, arguments: argparse.Namespace) -> OutputPlan:
    array = header.array
    if arguments.view:
        viewpoints = tuple(Viewpoint(*place) for place in arguments.view)
        for viewpoint in viewpoints:
            array.check_viewpoint(viewpoint)
        return OutputPlan(array, viewpoints, None)
    grid = arguments.grid or (array.rows, array.cols)
    return OutputPlan(array, array.viewpoints(*grid), grid)


def _frame_total(source: str | BinaryIO, frames: slice | None) -> int | None:
    """How many frames the progress bar counts to; unknown where the input cannot be read twice."""
    if not isinstance(source, str) or not sys.stderr.isatty():
        return None
    with McapReader.open(source) as reader:
        count = reader.frame_count
    return None if count is None else len(range(*(frames or slice(None)).indices(count)))

"""``mvcodec rectify``: pictures of an ordinary rig in, a rectified array (or the rig's calibration) out."""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path

from mvcodec.capture import ArraySource, open_input, resolve_frames
from mvcodec.cli.arguments import (
    add_frames,
    add_output_options,
    field_of_view,
    pair_of_sizes,
    picture_size,
    positive_number,
)
from mvcodec.cli.paths import (
    ARRAY_NAMES,
    add_overwrite,
    check_file_target,
    check_folder_target,
    local_path,
)
from mvcodec.cli.progress import progress
from mvcodec.cli.rig_option import tell_delays, tell_order
from mvcodec.cli.time_options import add_time_options, timing_of
from mvcodec.errors import SettingError
from mvcodec.evaluation.rig_report import rig_report
from mvcodec.frames import FrameSet
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter
from mvcodec.output.atomic import write_bytes
from mvcodec.rigs.board import EXPECTED, Board, Sightings, find_board
from mvcodec.rigs.calibration import (
    Calibrated,
    Wishes,
    calibrate_from_board,
    calibrate_from_files,
    calibrate_from_scene,
    spread_frame_sets,
)
from mvcodec.rigs.framing import CROPS
from mvcodec.rigs.from_board import LENS_CHOICES
from mvcodec.rigs.remap import DEFAULT_INTERPOLATION, INTERPOLATIONS, RectifiedSource, Rectifier
from mvcodec.rigs.rig import rig_text

RIG_NAME = "rig.json"
WAYS = ("scene", "board", "file")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``rectify``."""
    parser.add_argument(
        "input",
        type=local_path,
        nargs="+",
        metavar="INPUT",
        help="an array folder, or R*C videos in row order with --grid",
    )
    parser.add_argument(
        "output",
        type=local_path,
        metavar="OUT_FOLDER|RIG.json",
        help="a folder for the rectified pictures and the rig, or a .json file for the rig alone",
    )
    parser.add_argument("--grid", type=pair_of_sizes, metavar="RxC", help="grid of the input's views")
    parser.add_argument(
        "--from",
        dest="how",
        choices=WAYS,
        help="what says how the cameras are (default: scene, or what there are options for)",
    )
    parser.add_argument(
        "--calibration",
        type=local_path,
        nargs="+",
        metavar="FILE",
        help="of the cameras in row order: Kalibr, EuRoC or ROS YAML; or one RIG.json",
    )
    lens = parser.add_mutually_exclusive_group()
    lens.add_argument(
        "--focal",
        type=positive_number,
        metavar="PX",
        help="focal length of the cameras in pixels, with --from scene (default: found, near the width)",
    )
    lens.add_argument(
        "--fov",
        type=field_of_view,
        metavar="DEG",
        help="the same by the angle of view from left to right that the lens has without its distortion",
    )
    parser.add_argument("--board", metavar="BOARD", help=f"what was filmed: {EXPECTED}")
    parser.add_argument(
        "--board-input",
        type=local_path,
        nargs="+",
        metavar="FOLDER|VIDEO",
        help="the same cameras while they saw the board (default: INPUT)",
    )
    parser.add_argument(
        "--lens",
        choices=LENS_CHOICES,
        default="auto",
        help="model of the lenses, with --board (default: the one that fits)",
    )
    parser.add_argument(
        "--crop",
        choices=CROPS,
        default="common",
        help="common: what all cameras see; all: full size with black borders (default: %(default)s)",
    )
    parser.add_argument(
        "--size", type=picture_size, metavar="WxH", help="of the rectified pictures, px, or a word as 720p"
    )
    parser.add_argument(
        "--match-colours",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="make the cameras equally bright (default: yes)",
    )
    parser.add_argument(
        "--interpolation",
        choices=tuple(INTERPOLATIONS),
        default=DEFAULT_INTERPOLATION,
        help="between pixels (default: %(default)s)",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="stop where cameras stand in another order, show something else, or are late",
    )
    parser.add_argument(
        "--report", type=local_path, metavar="rig.html", help="write a page with figures and pictures"
    )
    add_frames(parser, "frames of the input to use")
    add_time_options(parser)
    add_overwrite(parser)
    add_output_options(parser, "print the rig as JSON")


def run(arguments: argparse.Namespace) -> None:
    """Calibrate, and write what was asked for."""
    output: Path = arguments.output
    if output.resolve() in [path.resolve() for path in arguments.input]:
        raise SettingError("OUT", output, "another place than INPUT")
    if output.suffix.lower() == ".json":
        check_file_target(output, overwrite=arguments.overwrite)
    else:
        names = rf"{re.escape(RIG_NAME)}|{ARRAY_NAMES}"
        check_folder_target(output, names, overwrite=arguments.overwrite)
    timing = timing_of(arguments)
    source = open_input(arguments.input, grid=arguments.grid, real="all", timing=timing)
    chosen = resolve_frames(arguments.frames, source.frame_count, source.name)
    tell_delays(source, chosen, arguments, strict=arguments.strict)
    tell_order(source, chosen, strict=arguments.strict)
    found = _calibrated(source, chosen, arguments)
    text = rig_text(found.rig)
    if output.suffix.lower() == ".json":
        write_bytes(output, text.encode())
    else:
        _write_folder(source, chosen, found, arguments)
        write_bytes(output / RIG_NAME, text.encode())
    if arguments.report is not None:
        write_bytes(arguments.report, rig_report(found, source.name).encode())
    if arguments.json:
        print(json.dumps(found.rig.document()))
    elif not arguments.quiet:
        print(f"{output}: {found.summary()}")


def _calibrated(source: ArraySource, chosen: range, arguments: argparse.Namespace) -> Calibrated:
    given = "file" if arguments.calibration else "board" if arguments.board else "scene"
    way = arguments.how or given
    if (way == "board") != (arguments.board is not None):
        found = f"{'one' if arguments.board else 'none'} with --from {way}"
        raise SettingError("board", found, f"--from board, and {EXPECTED}")
    if arguments.board_input and way != "board":
        raise SettingError("board_input", arguments.board_input[0], "--board, which says what it shows")
    if (way == "file") != bool(arguments.calibration):
        found = f"{len(arguments.calibration or [])} files with --from {way}"
        raise SettingError("calibration", found, "--from file, and the files of the cameras in row order")
    wishes = Wishes(arguments.crop, arguments.size)
    focal_px = _focal_px(source, arguments)
    if focal_px is not None and way != "scene":
        raise SettingError("focal", f"one with --from {way}", "--from scene: others say it themselves")
    if way == "file":
        return calibrate_from_files(source, chosen, arguments.calibration, wishes)
    if way == "board":
        shown = _board_source(source, arguments)
        sightings = _sightings(Board.from_text(arguments.board), shown, quiet=arguments.quiet)
        return calibrate_from_board(source, chosen, sightings, shown.name, arguments.lens, wishes)
    return calibrate_from_scene(source, chosen, wishes, focal_px)


def _focal_px(source: ArraySource, arguments: argparse.Namespace) -> float | None:
    """What `--focal` or `--fov` says; None without."""
    width = source.array.width
    if arguments.fov is not None:
        return width / 2 / math.tan(math.radians(arguments.fov) / 2)
    focal_px: float | None = arguments.focal
    if focal_px is not None and not width / 10 <= focal_px <= 100 * width:
        raise SettingError("focal", f"{focal_px:g}", f"{width / 10:g} to {100 * width} px")
    return focal_px


def _board_source(source: ArraySource, arguments: argparse.Namespace) -> ArraySource:
    """The pictures that show the board."""
    if arguments.board_input is None:
        return source
    array = source.array
    grid = None if len(arguments.board_input) == 1 else (array.rows, array.cols)
    shown = open_input(arguments.board_input, grid=grid, real="all")
    if (shown.array.rows, shown.array.cols) != (array.rows, array.cols):
        found = f"{shown.array.rows}x{shown.array.cols} cameras in {shown.name}"
        raise SettingError("board_input", found, f"{array.rows}x{array.cols}, the cameras of INPUT")
    return shown


def _sightings(board: Board, shown: ArraySource, *, quiet: bool) -> Sightings:
    array = shown.array
    with progress("board", None, quiet=quiet) as bar:

        def told() -> Iterator[FrameSet]:
            for frame_set in spread_frame_sets(shown):
                yield frame_set
                bar.update()

        return find_board(board, told(), array.positions, (array.width, array.height))


def _write_folder(
    source: ArraySource, chosen: range, found: Calibrated, arguments: argparse.Namespace
) -> None:
    rectifier = Rectifier(found.rig, arguments.interpolation, match_colours=arguments.match_colours)
    straight = RectifiedSource(source, rectifier)
    facts = ArrayFacts.of(straight.array)
    with (
        ArrayFolderWriter(arguments.output, facts) as writer,
        progress("rectify", len(chosen), quiet=arguments.quiet) as bar,
    ):
        for frame_set in straight.frame_sets(slice(chosen.start, chosen.stop)):
            writer.push(frame_set.pictures)
            bar.update()

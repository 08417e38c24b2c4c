"""``mvcodec render``: pictures to take away: paths of the viewpoint, stereo, quilts, refocus."""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import chain, repeat
from pathlib import Path

from tqdm import tqdm

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.cli.arguments import (
    add_frames,
    add_matcher,
    add_output_options,
    add_synthesizer,
    check_matcher,
    pair_of_sizes,
    view,
)
from mvcodec.cli.info import count as counted
from mvcodec.cli.layer_options import add_no_enhancement
from mvcodec.cli.paths import add_overwrite, check_file_target, local_path
from mvcodec.cli.progress import progress, tell_written
from mvcodec.cli.safety import add_limits, add_on_error, limits_of
from mvcodec.cli.setting_options import add_setting
from mvcodec.container import McapReader
from mvcodec.container.limits import Limits
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import SettingError, StreamError
from mvcodec.frames import DecodedSet, Picture
from mvcodec.output.light_field import quilt_path
from mvcodec.output.picture_file import STILL_SUFFIX, WRITERS, at_rate, find_writer
from mvcodec.output.styles import STYLES, ShotSettings, take
from mvcodec.output.view_path import FILE_SUFFIX, SHAPES, read_waypoints, walk_shape, walk_waypoints
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.synthesis.towards_enhanced import TowardsEnhanced, views_near

QUILT = "quilt"
STYLE_WORDS = dict.fromkeys(("sbs", "stereo", "3d"), "side-by-side") | {"red-cyan": "anaglyph"}
"""What everyone else calls a style."""
FROZEN_SECONDS = 2
"""How long a path takes while time stands."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``render``."""
    parser.add_argument("input", metavar="FILE.mcap", help="or its URL on a web server")
    parser.add_argument(
        "output",
        type=local_path,
        metavar="OUT",
        help=f"a file *{', *'.join(WRITERS)}; {STILL_SUFFIX} holds the first picture",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--path",
        metavar="PATH",
        help=f"way of the viewpoint: {', '.join(SHAPES)}, or a file *{FILE_SUFFIX} with "
        '{"viewpoints": [[row, col], ...]}; of a single frame time stands meanwhile',
    )
    where.add_argument(
        "--view",
        type=view,
        metavar="ROW,COL",
        help="viewpoint, in steps of the input's grid (default: middle); of a quilt or slice its row",
    )
    parser.add_argument(
        "--style",
        type=lambda text: STYLE_WORDS.get(text.lower(), text),
        choices=STYLES,
        default="mono",
        help="default: %(default)s",
    )
    add_setting(parser, ShotSettings, "focus_px", metavar="PX")
    add_setting(parser, ShotSettings, "convergence_px", metavar="PX")
    add_setting(parser, ShotSettings, "grid", parse=pair_of_sizes, metavar="RxC")
    add_synthesizer(parser)
    add_matcher(parser)
    add_no_enhancement(parser)
    add_frames(parser, "frames of the file")
    add_on_error(parser)
    add_limits(parser)
    add_overwrite(parser)
    add_output_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Decode, render, compose and write; tell the name where it is another than OUT."""
    synthesizer = TowardsEnhanced(make_synthesizer(arguments.synthesizer))
    write = find_writer(arguments.output)
    _check_settings(arguments)
    limits = limits_of(arguments)
    with Decoder.open(
        arguments.input,
        arguments.frames,
        arguments.on_error,
        limits,
        arguments.matcher,
        enhanced=() if arguments.no_enhancement else None,
    ) as decoder:
        check_matcher(arguments.matcher, decoder.header)
        array, count = decoder.header.array, _frame_count(arguments, limits)
        places = _places(arguments, array, count)
        if decoder.enhanced is None and arguments.style == "mono" and arguments.focus_px is None:
            decoder.enhanced = views_near(array, places)
        sets = iter(decoder)
        first = next(sets, None)
        if first is None:
            raise StreamError(arguments.input, "no frame set", "one at least")
        shot = STYLES[arguments.style](_settings(first, arguments))
        if arguments.path is not None and not shot.moves:
            raise SettingError("--path", arguments.path, "none for a picture of the whole array")
        output = arguments.output
        if arguments.style == QUILT and shot.grid is not None:
            output = quilt_path(output, *shot.grid, array.width / array.height)
            check_file_target(output, overwrite=arguments.overwrite)
        times = repeat(first) if count == 1 else chain([first], sets)
        stamps: deque[int] = deque()
        moments = _stamped(zip(places, times, strict=False), stamps)
        with progress("render", len(places), quiet=arguments.quiet, unit="picture") as bar:
            made = _Counted(take(shot, moments, synthesizer), bar)
            pictures = iter(made)
            timed = ((picture, stamps.popleft()) for picture in pictures)
            write(output, at_rate(pictures, array.fps) if count == 1 else timed, array.fps)
    if not arguments.quiet:
        tell_written(output, counted(made.count, "picture"), made.count, array.fps)
        if output != arguments.output:
            print(output)


def _settings(first: DecodedSet, arguments: argparse.Namespace) -> ShotSettings:
    return ShotSettings.of(first, arguments.grid, arguments.focus_px, arguments.convergence_px)


def _check_settings(arguments: argparse.Namespace) -> None:
    """Refuse what cannot be done before any work is."""
    if arguments.focus_px is not None and arguments.style != "mono":
        expected = "--style mono; --convergence says what lies in the plane of the screen"
        raise SettingError("--refocus", f"with --style {arguments.style}", expected)
    if arguments.convergence_px is not None and arguments.style == "mono":
        raise SettingError("--convergence", "with --style mono", "a style of several views")
    output = arguments.output
    if Path(arguments.input).resolve() == output.resolve():
        raise SettingError("OUT", output, "another file than FILE.mcap")
    check_file_target(output, overwrite=arguments.overwrite)
    if arguments.path is not None and output.suffix.lower() == STILL_SUFFIX:
        raise SettingError("--path", arguments.path, f"none for {output.name}, which holds one picture")


def _places(arguments: argparse.Namespace, array: CameraArray, count: int) -> tuple[Viewpoint, ...]:
    """The viewpoint of each picture to be made of `count` frame sets."""
    if arguments.path is None:
        row, col = arguments.view or ((array.rows - 1) / 2, (array.cols - 1) / 2)
        array.check_viewpoint(Viewpoint(row, col))
        return (Viewpoint(row, col),) * (1 if arguments.output.suffix.lower() == STILL_SUFFIX else count)
    if count == 1:
        count = max(2, round(FROZEN_SECONDS * array.fps))
    if arguments.path.lower().endswith(FILE_SUFFIX):
        return walk_waypoints(read_waypoints(Path(arguments.path), array), count)
    return walk_shape(arguments.path, array, count)


def _frame_count(arguments: argparse.Namespace, limits: Limits) -> int:
    """How many frame sets are selected; 0 where the decoder will refuse them."""
    on_damage = _say_nothing if arguments.on_error == "skip" else None  # the decoder will say it
    with McapReader.open(arguments.input, limits, on_damage) as reader:
        count = reader.frame_count
        if count is None:  # cut short: counted by reading it
            count = max((number + 1 for number, _ in reader.packets()), default=0)
    return len(range(*(arguments.frames or slice(None)).indices(count)))


def _say_nothing(_: StreamError) -> None:
    pass


def _stamped(
    moments: Iterable[tuple[Viewpoint, DecodedSet]], stamps: deque[int]
) -> Iterator[tuple[DecodedSet, Viewpoint]]:
    """The moments; their times wait in `stamps` until the pictures are made."""
    for place, decoded in moments:
        stamps.append(decoded.time_ns)
        yield decoded, place


class _Counted:
    """Pictures, and how many there were."""

    def __init__(self, pictures: Iterator[Picture], bar: tqdm[None]) -> None:
        self._pictures, self._bar = pictures, bar
        self.count = 0

    def __iter__(self) -> Iterator[Picture]:
        for picture in self._pictures:
            self.count += 1
            yield picture
            self._bar.update()

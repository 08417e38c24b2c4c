"""``mvcodec recover``: a clean file out of a damaged or unfinished one."""

from __future__ import annotations

import argparse
import warnings

from mvcodec.cli.info import count
from mvcodec.cli.paths import add_overwrite, check_file_target, local_path
from mvcodec.cli.safety import add_limits
from mvcodec.conformance.recovery import recover
from mvcodec.container.limits import Limits
from mvcodec.errors import MvCodecWarning, SettingError, StreamError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``recover``."""
    parser.add_argument("input", type=local_path, metavar="IN.mcap", help="a damaged or unfinished file")
    parser.add_argument("output", type=local_path, metavar="OUT.mcap", help="the clean one")
    parser.add_argument(
        "--incomplete",
        choices=("keep", "drop"),
        default="keep",
        help="frame sets in which a camera is missing: keep the others, or drop them up to the next keyframe"
        " that is complete (default: %(default)s)",
    )
    add_limits(parser)
    add_overwrite(parser)
    parser.add_argument("--quiet", action="store_true", help="no summary")


def run(arguments: argparse.Namespace) -> None:
    """Copy what is whole; say what is not."""
    if arguments.output.resolve() == arguments.input.resolve():
        raise SettingError("OUT", arguments.output, "another file than IN.mcap")
    check_file_target(arguments.output, overwrite=arguments.overwrite)
    limits = Limits(**dict(arguments.limit))
    result = recover(arguments.input, arguments.output, _warn, limits, arguments.incomplete)
    if not arguments.quiet:
        partly = f", {result.incomplete} of them incomplete" if result.incomplete else ""
        lost = f"; {count(result.dropped, 'frame set')} left out" if result.dropped else ""
        print(f"{arguments.output}: {count(result.frames, 'frame set')} recovered{partly}{lost}")


def _warn(error: StreamError) -> None:
    warnings.warn(str(error), MvCodecWarning, stacklevel=3)

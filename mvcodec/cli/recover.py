"""``mvcodec recover``: a clean file out of a damaged or unfinished one."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

from mvcodec.cli.info import count
from mvcodec.cli.safety import add_limits
from mvcodec.container.limits import Limits
from mvcodec.container.recovery import recover
from mvcodec.errors import MvCodecWarning, OutputError, SettingError, StreamError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``recover``."""
    parser.add_argument("input", type=Path, metavar="IN.mcap")
    parser.add_argument("output", type=Path, metavar="OUT.mcap")
    add_limits(parser)
    parser.add_argument("--quiet", action="store_true", help="no summary")


def run(arguments: argparse.Namespace) -> None:
    """Copy what is whole; say what is not."""
    if arguments.output.resolve() == arguments.input.resolve():
        raise SettingError("OUT", arguments.output, "another file than IN.mcap")
    if arguments.output.is_dir():
        raise OutputError(arguments.output, "it is a folder")
    result = recover(arguments.input, arguments.output, _warn, Limits(**dict(arguments.limit)))
    if not arguments.quiet:
        lost = f"; {count(result.dropped, 'incomplete frame set')} left out" if result.dropped else ""
        print(f"{arguments.output}: {count(result.frames, 'frame set')} recovered{lost}")


def _warn(error: StreamError) -> None:
    warnings.warn(str(error), MvCodecWarning, stacklevel=3)

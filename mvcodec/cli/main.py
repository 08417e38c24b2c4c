"""The command line: finds the command, prints errors and warnings as one line each, sets the exit code."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NoReturn

import mvcodec
from mvcodec.cli.arguments import as_option, in_options, join_negative_values, names_as_paths
from mvcodec.cli.setting_options import add_setting
from mvcodec.cli.standard_streams import ReaderGone, checked_streams
from mvcodec.cli.warning_lines import WarningLines
from mvcodec.cli.wording import in_our_words, with_suggestion
from mvcodec.errors import MvCodecError, MvCodecWarning, OutputError, SettingError
from mvcodec.workers import WorkerSettings, set_threads

COMMANDS: dict[str, str] = {
    "sample": "render the sample scene as an array folder",
    "init": "write the array.json of a folder of pictures or videos",
    "rectify": "make a rectified array of what ordinary cameras see",
    "encode": "code an array of pictures or videos into one MCAP file",
    "decode": "decode a file and synthesise views from it",
    "play": "watch a file in the browser, from any viewpoint",
    "render": "make pictures to take away: paths of the viewpoint, stereo, quilts, refocus",
    "export-web": "make a page that shows a file, for any web server or to be mailed",
    "info": "say what a file holds",
    "export-points": "write what the cameras see as points in space",
    "batch": "run one of encode, decode, render, validate on many recordings, over the workers of a cluster",
    "join": "write segments of one stream into one file, without coding them again",
    "recover": "write a clean file out of a damaged or unfinished one",
    "validate": "check a file against the rules of the format, access unit by access unit",
    "compare": "measure a decoded array against its original",
    "plugins": "list matchers and synthesizers with their settings",
    "evaluate": "measure rate and distortion of an array against stock codecs",
}
"""Name and purpose; each lives in mvcodec.cli.<name> as add_arguments(parser) and run(arguments)."""

COMPUTING = ("sample", "encode", "decode", "play", "render", "export-points", "compare", "evaluate")
"""The commands with --threads."""

EXIT_FAILURE = 1
EXIT_USAGE = 2


class OneLineParser(argparse.ArgumentParser):
    """An argument parser that says what is wrong in one line.

    Attributes:
        chosen: the parser of the command that is meant, if one is.
    """

    chosen: argparse.ArgumentParser | None = None

    def error(self, message: str) -> NoReturn:
        """Print one line and leave with exit code 2."""
        meant = self.chosen or self
        known = [option for action in meant._actions for option in action.option_strings]
        text = _one_line(in_our_words(message, known))
        self.exit(EXIT_USAGE, f"mvcodec: error: {text} (see {meant.prog} --help)\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: the arguments after the program's name; those of this process if None.

    Returns:
        0; 1 for bad input, bad output or Ctrl-C; 2 for a setting that is not allowed.

    Raises:
        SystemExit: from argparse, for --help (0) and arguments that don't parse (2).
    """
    tell_libraries()
    arguments = sys.argv[1:] if argv is None else list(argv)
    try:
        with checked_streams(), warnings.catch_warnings(), WarningLines() as lines:
            warnings.simplefilter("always", MvCodecWarning)
            warnings.showwarning = lines.show
            return _run(arguments)
    except ReaderGone:
        return EXIT_FAILURE
    except OutputError as error:  # what was printed, at the very end
        return _fail(error, EXIT_FAILURE)


def _run(arguments: Sequence[str]) -> int:
    parsed = _parser(arguments).parse_args(join_negative_values(names_as_paths(arguments)))
    try:
        _use_threads(getattr(parsed, "threads", None))
        _module(parsed.command).run(parsed)
    except SettingError as error:
        return _fail(with_suggestion(as_option(error)), EXIT_USAGE)
    except ReaderGone:
        return EXIT_FAILURE
    except (MvCodecError, OSError) as error:
        return _fail(error, EXIT_FAILURE)
    except KeyboardInterrupt:
        return _fail("interrupted", EXIT_FAILURE)
    return 0


def tell_libraries() -> None:
    """Say what libraries must know before they are loaded, where the user has not said otherwise."""
    # OpenCV writes lines of its own to standard error about files that we report.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
    # We hand out jobs ourselves; threads inside of BLAS wait for each other, and busily, where cores are few.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def command_parser(name: str) -> argparse.ArgumentParser:
    """The parser of one command alone, with all its options; for its documents."""
    parser = OneLineParser(prog=f"mvcodec {name}", description=COMMANDS[name], allow_abbrev=False)
    _add_arguments(name, parser)
    return parser


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="mvcodec", description=str(mvcodec.__doc__).partition("\n")[0], allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"mvcodec {mvcodec.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, purpose in COMMANDS.items():
        command = commands.add_parser(name, help=purpose, description=purpose, allow_abbrev=False)
        # The options name the choices of the plug-in tables, whose import takes time: ask only the
        # command that is meant.
        if name in arguments:
            parser.chosen = command
            _add_arguments(name, command)
    return parser


def _add_arguments(name: str, parser: argparse.ArgumentParser) -> None:
    _module(name).add_arguments(parser)
    if name in COMPUTING:
        add_setting(parser, WorkerSettings, "threads", metavar="N")


def _use_threads(count: int | None) -> None:
    set_threads(count)
    if count is not None:
        import cv2

        cv2.setNumThreads(count)


def _module(command: str) -> Any:
    return import_module(f"mvcodec.cli.{command.replace('-', '_')}")


def _fail(error: object, code: int) -> int:
    print("mvcodec: error:", _one_line(error), file=sys.stderr)
    return code


def _one_line(message: object) -> str:
    return in_options(" ".join(str(message).split()))

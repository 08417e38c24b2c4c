"""Options about how pictures of an input are read, for inputs of every kind."""

from __future__ import annotations

import argparse
import warnings

from mvcodec.capture.reading import Reading
from mvcodec.cli.safety import add_on_error
from mvcodec.errors import InputError, MvCodecWarning


def add_picture_options(parser: argparse.ArgumentParser) -> None:
    """``--bits`` and ``--on-error``."""
    parser.add_argument(
        "--bits",
        type=int,
        metavar="N",
        help="bits that pictures of 16 bits really use, 8..16 (default: as their files say, or as their"
        " values need)",
    )
    add_on_error(parser, "stop", "at a picture that cannot be read: leave its frame set out, or stop")


def reading_of(arguments: argparse.Namespace) -> Reading:
    """What the options say."""
    return Reading(arguments.bits, _warn if arguments.on_error == "skip" else None)


def _warn(error: InputError) -> None:
    warnings.warn(str(error), MvCodecWarning, stacklevel=3)

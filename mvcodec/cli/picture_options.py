"""Options about how pictures of an input are read, for inputs of every kind."""

from __future__ import annotations

import argparse
import warnings

from mvcodec.capture.reading import Reading
from mvcodec.cli.arguments import pair_of_sizes
from mvcodec.cli.safety import add_on_error
from mvcodec.cli.setting_options import add_setting
from mvcodec.errors import InputError, MvCodecWarning


def add_picture_options(parser: argparse.ArgumentParser) -> None:
    """``--bits``, ``--gaps``, ``--split`` and ``--on-error``."""
    add_setting(parser, Reading, "bits")
    add_setting(parser, Reading, "gaps")
    add_setting(parser, Reading, "split", parse=pair_of_sizes, metavar="RxC")
    add_on_error(parser, what="at a picture that cannot be read: leave its frame set out, or stop")


def reading_of(arguments: argparse.Namespace) -> Reading:
    """What the options say."""
    told = _warn if arguments.on_error == "skip" else None
    return Reading(arguments.bits, told, arguments.split, arguments.gaps)


def _warn(error: InputError) -> None:
    warnings.warn(str(error), MvCodecWarning, stacklevel=3)

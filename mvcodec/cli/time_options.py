"""Options about when pictures were taken, for inputs of every kind."""

from __future__ import annotations

import argparse
import math

from mvcodec.capture.timing import Timing
from mvcodec.cli.setting_options import add_setting


def add_time_options(parser: argparse.ArgumentParser) -> None:
    """``--fps``, ``--offset``, ``--sync`` and ``--tolerance-ms``."""
    group = parser.add_argument_group("time")
    add_setting(group, Timing, "fps")
    group.add_argument(
        "--offset",
        type=_offset,
        action="append",
        default=[],
        metavar="CAMERA=MS",
        help="what to add to the times of a camera (rNN_cNN, its file or topic), ms; repeatable",
    )
    add_setting(group, Timing, "sync")
    add_setting(group, Timing, "tolerance_ms")


def timing_of(arguments: argparse.Namespace) -> Timing:
    """What the options say.

    Raises:
        SettingError: a number is out of range.
    """
    return Timing(arguments.fps, dict(arguments.offset), arguments.tolerance_ms, arguments.sync)


def _offset(text: str) -> tuple[str, float]:
    camera, separator, number = text.rpartition("=")
    try:
        offset = float(number)
    except ValueError:
        offset = math.nan
    if not (separator and camera and math.isfinite(offset)):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected CAMERA=MS such as r00_c01=-12.5")
    return camera, offset

"""Options of the commands that read files from outside: what to do at damage, and how much is too much."""

from __future__ import annotations

import argparse
import re
from dataclasses import fields

from mvcodec.container.limits import Limits


def limit(text: str) -> tuple[str, int]:
    """``NAME=N``: one of the limits on what a file may ask for."""
    match = re.fullmatch(r"([a-z_]+)=(\d{1,18})", text)
    names = [field.name for field in fields(Limits)]
    if match is None or match[1] not in names:
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected NAME=N with NAME one of {', '.join(names)}"
        )
    return match[1], int(match[2])


def add_limits(parser: argparse.ArgumentParser) -> None:
    """``--limit NAME=N``."""
    parser.add_argument(
        "--limit",
        type=limit,
        action="append",
        default=[],
        metavar="NAME=N",
        help="what a file may ask for, such as max_cameras=2000; repeatable",
    )


def add_on_error(parser: argparse.ArgumentParser, default: str) -> None:
    """``--on-error skip|stop``."""
    parser.add_argument(
        "--on-error",
        choices=("skip", "stop"),
        default=default,
        help="at damage: go on with the next keyframe, or stop (default: %(default)s)",
    )

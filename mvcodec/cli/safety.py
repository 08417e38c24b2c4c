"""Options of the commands that read files from outside: what to do at damage, and how much is too much."""

from __future__ import annotations

import argparse
import re

from mvcodec.container.chunked_file import CHUNK_MS, MAX_CHUNK_MS
from mvcodec.container.limits import Limits
from mvcodec.errors import SettingError
from mvcodec.settings import did_you_mean, settings_of


def limit(text: str) -> tuple[str, int]:
    """``NAME=N``: one of the limits on what a file may ask for."""
    name, sign, number = text.partition("=")
    known = settings_of(Limits)
    if not sign or name not in known:
        guess = did_you_mean(name, known)
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected NAME=N with NAME one of {', '.join(known)}{guess}"
        )
    try:
        return name, known[name].read(number)
    except SettingError as error:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected {name}={error.expected}") from None


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


def limits_of(arguments: argparse.Namespace) -> Limits:
    """The limits that ``--limit`` leaves or sets."""
    return Limits(**dict(arguments.limit))


def add_on_error(
    parser: argparse.ArgumentParser,
    default: str,
    what: str = "at damage: go on with the next keyframe, or stop",
) -> None:
    """``--on-error skip|stop``."""
    parser.add_argument(
        "--on-error",
        choices=("skip", "stop"),
        default=default,
        help=f"{what} (default: {default})",
    )


def add_chunk_ms(parser: argparse.ArgumentParser) -> None:
    """``--chunk-ms N``."""
    parser.add_argument(
        "--chunk-ms",
        type=_chunk_ms,
        metavar="N",
        help="stream time that waits before it is written, which is what a power cut can lose;"
        f" 0 writes each frame set at once (default: {CHUNK_MS}, on standard output 0)",
    )


def _chunk_ms(text: str) -> int:
    if not re.fullmatch(r"\d{1,9}", text) or int(text) > MAX_CHUNK_MS:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected 0..{MAX_CHUNK_MS} ms")
    return int(text)

"""Options of the commands that read files from outside: what to do at damage, and how much is too much."""

from __future__ import annotations

import argparse
from dataclasses import replace

from mvcodec.cli.setting_options import add_option
from mvcodec.container.chunk_writing import CHUNK_MS
from mvcodec.container.limits import Limits
from mvcodec.decoding.decoder import ON_ERROR, OnError
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
    default: OnError = ON_ERROR.default,
    what: str = ON_ERROR.help,
) -> None:
    """``--on-error skip|stop``."""
    add_option(parser, replace(ON_ERROR, default=default, help=what))


def add_chunk_ms(parser: argparse.ArgumentParser) -> None:
    """``--chunk-ms N``."""
    note = f" (default: {CHUNK_MS.default}, on standard output 0)"
    add_option(parser, CHUNK_MS, left_open=True, note=note)

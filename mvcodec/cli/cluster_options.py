"""Options of the commands whose work can go to many machines."""

from __future__ import annotations

import argparse
from pathlib import Path

from mvcodec.cli.setting_options import add_option
from mvcodec.cluster.connection import RETRIES, check_cluster
from mvcodec.errors import SettingError


def add_cluster(parser: argparse.ArgumentParser, default: str | None = None) -> None:
    """``--cluster`` and ``--retries``."""
    parser.add_argument(
        "--cluster",
        type=_cluster,
        default=default,
        metavar="local[:N]|tcp://HOST:8786",
        help="Dask workers that do the work: N processes of this machine, or those of a scheduler that is"
        f" running (default: {default or 'none, this process'})",
    )
    add_option(parser, RETRIES)


def place(text: str) -> Path | str:
    """A path, or the address of something that fsspec reaches."""
    return text if "://" in text else Path(text)


def _cluster(text: str) -> str:
    try:
        return check_cluster(text)
    except SettingError as error:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected {error.expected}") from None

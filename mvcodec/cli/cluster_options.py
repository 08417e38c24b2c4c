"""Options of the commands whose work can go to many machines."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from mvcodec.cluster.connection import check_cluster
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
    parser.add_argument(
        "--retries",
        type=_retries,
        default=2,
        metavar="N",
        help="how often a task is tried again whose worker died (default: %(default)s)",
    )


def place(text: str) -> Path | str:
    """A path, or the address of something that fsspec reaches."""
    return text if "://" in text else Path(text)


def _cluster(text: str) -> str:
    try:
        return check_cluster(text)
    except SettingError as error:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected {error.expected}") from None


def _retries(text: str) -> int:
    if not re.fullmatch(r"\d{1,3}", text):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a whole number")
    return int(text)

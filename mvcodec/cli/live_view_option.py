"""`--live-view`: what is being encoded, in Foxglove."""

from __future__ import annotations

import argparse
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from mvcodec.errors import MvCodecWarning
from mvcodec.output.live_view import LiveView
from mvcodec.player.access import is_loopback

DEFAULT_HOST = "127.0.0.1"
MAX_PORT = 65535


def add_live_view(parser: argparse.ArgumentParser) -> None:
    """``--live-view [HOST:]PORT``."""
    parser.add_argument(
        "--live-view",
        type=address,
        metavar="[HOST:]PORT",
        help="show what is written in Foxglove while encoding, over its WebSocket"
        f" (HOST: {DEFAULT_HOST} by default; PORT 0: any free one)",
    )


def address(text: str) -> tuple[str, int]:
    """``8765``, ``localhost:8765`` or ``[::1]:8765`` -> host and port."""
    match = re.fullmatch(r"(?:(?:\[([0-9a-fA-F:.%\w]+)\]|([^:\s\[\]]+)):)?(\d{1,5})", text)
    if match is None or int(match[3]) > MAX_PORT:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected [HOST:]PORT with PORT 0..{MAX_PORT}")
    return match[1] or match[2] or DEFAULT_HOST, int(match[3])


@contextmanager
def live_view(arguments: argparse.Namespace) -> Iterator[LiveView | None]:
    """The live view that the command line asks for, if any, until the end of the block."""
    if arguments.live_view is None:
        yield None
        return
    host, port = arguments.live_view
    with LiveView(host, port) as view:
        if not is_loopback(host):
            text = f"--live-view {host}: everyone who reaches this machine over the network can watch"
            warnings.warn(text, MvCodecWarning, stacklevel=2)
        # Standard output may be the stream itself.
        print(f"mvcodec: live view for Foxglove: {view.url}", file=sys.stderr, flush=True)
        yield view

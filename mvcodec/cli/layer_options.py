"""``--enhance`` and ``--enhance-views``: the enhancement layer of ``encode``."""

from __future__ import annotations

import argparse
from typing import Any

from mvcodec.array import Position
from mvcodec.cli.arguments import position
from mvcodec.encoding.config import AUTO


def add_layer(parser: argparse.ArgumentParser) -> None:
    """The options of the enhancement layer."""
    parser.add_argument(
        "--enhance",
        type=_qp,
        metavar="QP|auto",
        help="add an enhancement layer: virtual views, whose originals INPUT must have, coded from their"
        " synthesis with about the quality of this QP; the base stays as it is without. auto: what goes best"
        " with the pictures' QP; beside --bitrate both together hold the rate",
    )
    parser.add_argument(
        "--enhance-views",
        type=position,
        nargs="+",
        metavar="R,C",
        help="the views of the layer (default: every one that no real camera has)",
    )


def _qp(text: str) -> int | str:
    try:
        return text if text == AUTO else int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a QP or {AUTO}") from None


def layer_settings(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings of EncoderConfig that they make."""
    views: list[Position] | None = arguments.enhance_views
    return {"enhance": arguments.enhance, "enhance_views": None if views is None else tuple(views)}

"""``--enhance`` and what belongs to it: the enhancement layer of ``encode``; and ``--no-enhancement``."""

from __future__ import annotations

import argparse
from typing import Any

from mvcodec.array import Position
from mvcodec.cli.arguments import OPTIONS, position
from mvcodec.cli.setting_options import add_setting
from mvcodec.encoding.config import AUTO, EncoderConfig
from mvcodec.settings import settings_of


def add_layer(parser: argparse.ArgumentParser) -> None:
    """The options of the enhancement layer."""
    add_setting(parser, EncoderConfig, "enhance", parse=_qp, metavar="QP|+QPS|auto")
    parser.add_argument(
        OPTIONS["enhance_views"],
        type=position,
        nargs="+",
        metavar="R,C",
        help=settings_of(EncoderConfig)["enhance_views"].help,
    )
    add_setting(parser, EncoderConfig, "enhance_chain", metavar="N")


def add_no_enhancement(parser: argparse.ArgumentParser) -> None:
    """``--no-enhancement``, for what shows views."""
    parser.add_argument(
        "--no-enhancement", action="store_true", help="leave the file's enhancement layer out: the base alone"
    )


def _qp(text: str) -> float | str:
    try:
        if text == AUTO or text[:1] in ("+", "-"):
            return text
        return float(text) if "." in text else int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a QP, +QPS or {AUTO}") from None


def layer_settings(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings of EncoderConfig that they make."""
    views: list[Position] | None = arguments.enhance_views
    return {
        "enhance": arguments.enhance,
        "enhance_views": None if views is None else tuple(views),
        "enhance_chain": arguments.enhance_chain,
    }

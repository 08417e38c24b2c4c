"""Options of ``encode`` for files that are coded in segments: `mvcodec join` makes one file of them."""

from __future__ import annotations

import argparse
import json

from mvcodec.array import CameraArray
from mvcodec.cli.arguments import positive_int
from mvcodec.encoding.config import EncoderConfig, default_gop
from mvcodec.errors import SettingError


def add_segment(parser: argparse.ArgumentParser) -> None:
    """``--continues N`` and ``--dry-run``."""
    parser.add_argument(
        "--continues",
        type=positive_int,
        default=0,
        metavar="N",
        help="N frame sets come before these in files of their own, for `mvcodec join`; N is a multiple of"
        " the GOP. Give all segments the same --disparity-range and --exact-range. With --qp and codec h264"
        " or av1 the joined file then has the packets that one run would have written",
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="print as JSON what would be coded (frames, rate, GOP, disparities); no file is written",
    )


def check_continues(array: CameraArray, config: EncoderConfig, continues: int) -> None:
    """Raise SettingError where a segment would not begin with a keyframe."""
    gop = config.gop or default_gop(array.fps)
    if continues % gop:
        raise SettingError("--continues", continues, f"a multiple of the GOP, {gop} frame sets")


def plan(array: CameraArray, config: EncoderConfig, chosen: range, range_px: tuple[float, float]) -> str:
    """What ``--dry-run`` prints."""
    return json.dumps(
        {
            "frames": [chosen.start, chosen.stop],
            "fps": array.fps,
            "gop": config.gop or default_gop(array.fps),
            "cameras": len(array.real),
            "size": [array.width, array.height],
            "disparity_range_px": list(range_px),
            "keyframe_ratio": config.keyframe_ratio,
        }
    )

"""Options of the commands that code an array, and the encoder's configuration that they make."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mvcodec.array import CameraArray
from mvcodec.capture import ArraySource
from mvcodec.cli.arguments import (
    SPECIFICATION,
    codec_name,
    disparity_qp,
    disparity_range,
    pair_of_sizes,
)
from mvcodec.cli.paths import local_path
from mvcodec.encoding.config import AUTO
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.speed_choice import FOR_FILES, FOR_LIVE, SPEEDS
from mvcodec.frames import FrameSet
from mvcodec.layers.refinement import matcher_choices
from mvcodec.stereo.disparity_range import MAX_FRAMES, estimate_range
from mvcodec.stereo.given import given_range
from mvcodec.stream import DISPARITY_CAMERAS, PREDICTIONS
from mvcodec.video.codec import PRESETS
from mvcodec.video.codecs import CODECS


def add_input(
    parser: argparse.ArgumentParser, what: str, kind: Callable[[str], Path | str] = local_path
) -> None:
    """``INPUT``, ``--grid`` and ``--real``."""
    parser.add_argument("input", type=kind, nargs="+", metavar="INPUT", help=what)
    parser.add_argument("--grid", type=pair_of_sizes, metavar="RxC", help="grid of the input's views")
    parser.add_argument(
        "--real",
        default="corners",
        metavar="corners|all|every:K|R,R..xC,C..",
        help="the cameras to code (default: corners, or both ends of a linear array)",
    )


def add_coding(parser: argparse.ArgumentParser) -> None:
    """How pictures and maps are coded, apart from the rate."""
    default = EncoderConfig()
    parser.add_argument(
        "--speed",
        choices=SPEEDS,
        help=f"sets --matcher and --preset together (default: {FOR_FILES}; of standard input and live"
        f" cameras: {FOR_LIVE})",
    )
    parser.add_argument(
        "--codec",
        type=codec_name,
        choices=CODECS,
        default=default.codec,
        help="of pictures and maps (default: %(default)s, which viewers are sure to play)",
    )
    _add_disparity(parser)
    parser.add_argument(
        "--gop", type=int, metavar="N", help="frames from keyframe to keyframe, at most one second's"
    )
    parser.add_argument(
        "--matcher",
        metavar=SPECIFICATION,
        help=f"{matcher_choices()}; mvcodec plugins lists settings (default: what --speed has; best:"
        f" {SPEEDS[FOR_FILES].matcher})",
    )
    parser.add_argument(
        "--preset",
        metavar="NAME",
        help=f"effort of video encoders, one of {', '.join(PRESETS)} (default: what --speed has; best:"
        f" {SPEEDS[FOR_FILES].preset})",
    )


def _add_disparity(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--disparity-qp",
        type=disparity_qp,
        metavar="N|auto",
        help="QP of the disparity maps (default: auto, chosen for the pictures' QP)",
    )
    parser.add_argument(
        "--disparity-scale",
        type=int,
        metavar="1|2",
        help="2: maps at half the pictures' size each way (default: chosen for the pictures' QP)",
    )
    parser.add_argument(
        "--disparity-cameras",
        choices=(*DISPARITY_CAMERAS, AUTO),
        help="the real cameras that send a map; alternate: every second one, and decoders derive the others';"
        " none: decoders estimate all maps, which takes them as long as it takes encoders, and readers of"
        " format version 1 refuse the file; auto: what costs fewest bits"
        " (default: all or alternate, chosen for the pictures' QP)",
    )
    parser.add_argument(
        "--prediction",
        choices=PREDICTIONS,
        default=EncoderConfig().prediction,
        help="synthesis: real cameras are coded from each other, for fewer bits; the first one alone plays in"
        " any viewer, and readers of format version 1 refuse the file (default: %(default)s)",
    )
    parser.add_argument(
        "--disparity-median",
        type=int,
        metavar="N",
        help="smooth maps over N x N before coding, N odd; 0: don't (default: 5, at half size 3)",
    )
    parser.add_argument(
        "--disparity-range",
        type=disparity_range,
        metavar="LO,HI|auto",
        help="px between neighbouring real cameras; auto: estimated whatever the input states"
        " (default: estimated within what it states)",
    )


def checked_config(array: CameraArray, arguments: argparse.Namespace, **others: Any) -> EncoderConfig:
    """The settings, checked against the array before the time-consuming part begins.

    Args:
        others: settings of EncoderConfig that `add_coding` has no option for.

    Raises:
        SettingError: one does not fit.
    """
    config = EncoderConfig(
        disparity_qp=arguments.disparity_qp,
        disparity_scale=arguments.disparity_scale,
        disparity_cameras=arguments.disparity_cameras,
        disparity_median=arguments.disparity_median,
        prediction=arguments.prediction,
        gop=arguments.gop,
        speed=arguments.speed or FOR_FILES,
        matcher=arguments.matcher,
        preset=arguments.preset,
        codec=arguments.codec,
        **others,
    )
    Encoder(array, config).flush()
    return config


def find_range(
    source: ArraySource, chosen: range, option: tuple[float, float] | str | None, given: bool = False
) -> tuple[float, float]:
    """The range of disparities, px, that ``--disparity-range`` asks for, estimated where it gives none.

    Args:
        given: the maps that the input has will be coded: their own range counts.
    """
    if isinstance(option, tuple):
        return option
    if given:
        return given_range(_samples(source, chosen))
    hint = None if option == "auto" else source.array.disparity_hint_px
    return estimate_range(source.array, _samples(source, chosen), hint)


def _samples(source: ArraySource, chosen: range) -> list[FrameSet]:
    count = min(MAX_FRAMES, len(chosen))
    numbers = {chosen[index * (len(chosen) - 1) // max(count - 1, 1)] for index in range(count)}
    return [
        frame_set for number in sorted(numbers) for frame_set in source.frame_sets(slice(number, number + 1))
    ]

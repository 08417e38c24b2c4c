"""Options of the commands that code an array, and the encoder's configuration that they make."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mvcodec.array import CameraArray
from mvcodec.capture import ArraySource
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.cli.arguments import (
    SPECIFICATION,
    codec_name,
    disparity_range,
    pair_of_sizes,
)
from mvcodec.cli.paths import local_path
from mvcodec.cli.setting_options import add_setting
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.keyframe_ratio import STILL_RATIO, keyframe_ratio
from mvcodec.encoding.speed_choice import FOR_FILES, FOR_LIVE
from mvcodec.errors import SettingError
from mvcodec.frames import FrameSet
from mvcodec.layers.refinement import matcher_choices
from mvcodec.stereo.disparity_range import MAX_FRAMES, estimate_range
from mvcodec.stereo.given import given_range

APART_S = 0.5
"""Pictures nearer to each other in time tell the same of the range of disparities."""

PAIR, MOST_PAIRS = 2, 3
"""Pictures side by side that tell whether a camera and what it sees stand still; how many pairs are seen."""

INSIST = "--exact-range keeps it as stated"

CODING = (
    "codec",
    "disparity_qp",
    "disparity_scale",
    "disparity_cameras",
    "prediction",
    "second_reference",
    "disparity_median",
    "gop",
    "keyframe_ratio",
    "matcher",
    "preset",
)
"""The settings of EncoderConfig that go from `add_coding` to the encoder as they are."""


def add_input(
    parser: argparse.ArgumentParser, what: str, kind: Callable[[str], Path | str] = local_path
) -> None:
    """``INPUT``, ``--grid`` and ``--real``."""
    parser.add_argument("input", type=kind, nargs="+", metavar="INPUT", help=what)
    parser.add_argument("--grid", type=pair_of_sizes, metavar="RxC", help="grid of the input's views")
    add_setting(parser, RecordingSettings, "real", metavar="corners|all|every:K|R,R..xC,C..")


def add_coding(parser: argparse.ArgumentParser) -> None:
    """How pictures and maps are coded, apart from the rate."""
    add_setting(
        parser,
        EncoderConfig,
        "speed",
        left_open=True,
        note=f" (default: {FOR_FILES}; of standard input and live cameras: {FOR_LIVE})",
    )
    add_setting(parser, EncoderConfig, "codec", parse=codec_name)
    add_setting(parser, EncoderConfig, "disparity_qp", metavar="N|auto")
    for name in (
        "disparity_scale",
        "disparity_cameras",
        "prediction",
        "second_reference",
        "disparity_median",
    ):
        add_setting(parser, EncoderConfig, name)
    add_setting(
        parser,
        EncoderConfig,
        "disparity_range_px",
        parse=disparity_range,
        metavar="LO,HI|auto",
        note="; auto: estimated whatever the input states. Widened where the pictures show more, of files"
        " narrowed where they show less",
    )
    parser.add_argument(
        "--exact-range",
        action="store_true",
        help="take --disparity-range as it stands, whatever the pictures show",
    )
    add_setting(parser, EncoderConfig, "gop")
    add_setting(
        parser,
        EncoderConfig,
        "keyframe_ratio",
        metavar="R",
        left_open=True,
        note=f" (default: {STILL_RATIO:g} for files of which most stands still, at a constant QP or CRF)",
    )
    add_setting(
        parser,
        EncoderConfig,
        "matcher",
        metavar=SPECIFICATION,
        note=f", {matcher_choices()}; mvcodec plugins lists settings",
    )
    add_setting(parser, EncoderConfig, "preset")


def check_exact_range(arguments: argparse.Namespace) -> None:
    """Refuse ``--exact-range`` where no range is given."""
    if arguments.exact_range and not isinstance(arguments.disparity_range_px, tuple):
        raise SettingError("--exact-range", "no range", "--disparity-range LO,HI, which it keeps")


def checked_config(array: CameraArray, arguments: argparse.Namespace, **others: Any) -> EncoderConfig:
    """The settings, checked against the array before the time-consuming part begins.

    Args:
        others: settings of EncoderConfig that `add_coding` has no option for.

    Raises:
        SettingError: one does not fit.
    """
    config = EncoderConfig(
        **{name: getattr(arguments, name) for name in CODING}, speed=arguments.speed or FOR_FILES, **others
    )
    if config.chosen_second_reference != "none" and config.prediction == "none" and config.enhance is None:
        expected = "prediction synthesis or enhance beside it: nothing else is predicted"
        raise SettingError("second_reference", config.second_reference, expected)
    Encoder(array, config).flush()
    return config


def find_range(
    source: ArraySource,
    chosen: range,
    option: tuple[float, float] | str | None,
    *,
    given: bool = False,
    exact: bool = False,
    first: FrameSet | None = None,
) -> tuple[float, float]:
    """The range of disparities, px, that ``--disparity-range`` asks for, estimated where it gives none.

    Args:
        given: the maps that the input has will be coded: their own range counts.
        exact: the option's range is taken as it stands, not as a hint.
        first: the first frame set of those chosen, where it has been read already.
    """
    stated = option if isinstance(option, tuple) else None
    if stated and (exact or given):
        return stated
    samples = _samples(source, chosen, first)
    if stated:
        return estimate_range(source.array, samples, stated, INSIST)
    if given:
        return given_range(samples)
    hint = None if option == "auto" else source.array.disparity_hint_px
    return estimate_range(source.array, samples, hint)


def with_keyframe_ratio(source: ArraySource, chosen: range, config: EncoderConfig) -> EncoderConfig:
    """The settings with the ratio that the pictures of the first real camera ask for, where none is given."""
    given = config.keyframe_ratio is not None or config.codec != "h264" or config.quality is None
    if given or len(chosen) < PAIR:
        return config
    pairs = max(min(MOST_PAIRS, len(chosen) // PAIR), 1)
    starts = [chosen.start + place * (len(chosen) - PAIR) // max(pairs - 1, 1) for place in range(pairs)]
    camera = source.array.real[0]
    seen = (source.frame_sets(slice(start, start + PAIR), [camera]) for start in starts)
    pictures = ([frames.pictures[camera] for frames in pair] for pair in seen)
    return replace(config, keyframe_ratio=keyframe_ratio(pair for pair in pictures if len(pair) == PAIR))


def _samples(source: ArraySource, chosen: range, first: FrameSet | None) -> list[FrameSet]:
    """Frame sets spread over those chosen: few of a short time, in which scenes stay as they are."""
    seconds = (len(chosen) - 1) / source.array.fps
    count = min(MAX_FRAMES, len(chosen), 1 + round(seconds / APART_S))
    numbers = {chosen[index * (len(chosen) - 1) // max(count - 1, 1)] for index in range(count)}
    read = [] if first is None else [first]
    if read:
        numbers.discard(chosen[0])
    for number in sorted(numbers):
        read += source.frame_sets(slice(number, number + 1))
    return read

"""Parsing that the commands share. Each parser raises what argparse turns into one line and exit code 2."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Sequence
from pathlib import Path

from mvcodec.errors import SettingError
from mvcodec.settings import did_you_mean
from mvcodec.stream import StreamHeader

NEGATIVE_VALUES = ("--convergence", "--disparity-range", "--frames", "--max-depth", "--refocus", "--view")
"""Options whose value may begin with a minus sign."""

OTHERWISE = {
    "bitrate_kbps": "--bitrate",
    "convergence_px": "--convergence",
    "disparity_range_px": "--disparity-range",
    "focus_px": "--refocus",
    "offsets_ms": "--offset",
    "patience_s": "--patience",
    "qps": "--qp",
    "viewpoint": "--view",
    "views": "--view",
}
"""Options that are called otherwise than the library's settings behind them."""

AS_THEY_ARE = (
    "anchor_codecs anchors bits board board_input calibration chunk_ms clock cluster codec crf "
    "depth_topics disparity_cameras disparity_median disparity_qp disparity_scale enhance enhance_chain "
    "enhance_views format fps frames gaps gop grid host incomplete interpolation keyframe_ratio live_view "
    "matcher nominal on_error path port prediction preset qp real retries rig scene second_reference seed "
    "size speed split style sync synthesizer target_psnr threads tolerance_ms topics when_behind"
)
OPTIONS = {name: f"--{name.replace('_', '-')}" for name in AS_THEY_ARE.split()} | OTHERWISE
"""The options behind the library's settings."""

_SETTING = re.compile(r"(?<![-\w:.])\w+(?=$|,| )")
_QUOTED = re.compile(r"`(\w+)`")

SPECIFICATION = "NAME[:KEY=VALUE,..]"

DEFAULT_SYNTHESIZER = "layered"


def as_option(error: SettingError) -> SettingError:
    """The same error with the library's settings under the names of their options."""
    setting = _SETTING.sub(lambda name: OPTIONS.get(name[0], name[0]), error.setting)
    return SettingError(setting, error.found, in_options(error.expected))


def in_options(text: str) -> str:
    """A message of the library, where settings stand in backquotes, in words of the command line."""
    return _QUOTED.sub(lambda name: OPTIONS.get(name[1], name[0]), text)


def join_negative_values(argv: Sequence[str]) -> list[str]:
    """Turn ``--frames -2:`` into ``--frames=-2:``, which argparse would take for an option."""
    joined: list[str] = []
    for argument in argv:
        if joined and joined[-1] in NEGATIVE_VALUES and re.match(r"-[\d.]", argument):
            joined[-1] += "=" + argument
        else:
            joined.append(argument)
    return joined


def names_as_paths(argv: Sequence[str]) -> list[str]:
    """Turn ``-cam.mp4``, which argparse would take for options, into ``./-cam.mp4`` where that is a file."""

    def path(argument: str) -> str:
        is_name = argument.startswith("-") and len(argument) > 2 and Path(argument).is_file()
        return f"./{argument}" if is_name else argument

    return [path(argument) for argument in argv]


def pair_of_sizes(text: str) -> tuple[int, int]:
    """``640x360`` or ``5x5`` as two positive integers."""
    match = re.fullmatch(r"([1-9]\d{0,8})[xX]([1-9]\d{0,8})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected two positive whole numbers such as 5x3")
    return int(match[1]), int(match[2])


MOST_FOV_DEG = 150.0
"""Wider lenses are fisheyes."""

COMMON_SIZES = {"480p": (854, 480), "720p": (1280, 720), "1080p": (1920, 1080), "1440p": (2560, 1440)}
COMMON_SIZES |= dict.fromkeys(("4k", "2160p"), (3840, 2160))


def picture_size(text: str) -> tuple[int, int]:
    """``640x360``, or a word that everyone uses, as ``1080p``: (width, height)."""
    try:
        return COMMON_SIZES.get(text.lower()) or pair_of_sizes(text)
    except argparse.ArgumentTypeError:
        words = f"{', '.join(COMMON_SIZES)}{did_you_mean(text, COMMON_SIZES)}"
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected WxH such as 640x360, or {words}"
        ) from None


CODEC_WORDS = dict.fromkeys(("h265", "h.265", "x265"), "hevc") | dict.fromkeys(
    ("avc", "h.264", "x264"), "h264"
)


def codec_name(text: str) -> str:
    """The name that we have for a codec."""
    return CODEC_WORDS.get(text.lower(), text.lower())


def frame_slice(text: str) -> slice:
    """``A:B`` as a Python slice; either end may be left out or negative."""
    match = re.fullmatch(r"(-?\d{1,15})?:(-?\d{1,15})?", text)
    if match is None:
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected A:B, a Python slice such as 0:9, :9 or -2:"
        )
    start, stop = match[1], match[2]
    return slice(None if start is None else int(start), None if stop is None else int(stop))


def disparity_range(text: str) -> tuple[float, float] | str:
    """``LO,HI`` in px, LO < HI, or ``auto``."""
    if text == "auto":
        return text
    low, high = _two_numbers(text, "LO,HI in px with LO < HI, or auto")
    if low >= high:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected LO < HI")
    return low, high


def view(text: str) -> tuple[float, float]:
    """``ROW,COL`` in steps of the grid; fractions are legal."""
    return _two_numbers(text, "ROW,COL such as 0,2 or 0.5,1.25")


def positive_int(text: str) -> int:
    """A whole number of at least 1."""
    if not re.fullmatch(r"\d{1,9}", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a whole number of at least 1")
    return int(text)


def positive_number(text: str) -> float:
    """A number above 0, which may be infinite."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not number > 0:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a number above 0")
    return number


def field_of_view(text: str) -> float:
    """Degrees, as a flat picture can have them."""
    number = positive_number(text)
    if not number <= MOST_FOV_DEG:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected degrees up to {MOST_FOV_DEG:g}")
    return number


def position(text: str) -> tuple[int, int]:
    """``R,C``: a place of the grid, in whole steps."""
    match = re.fullmatch(r"(\d{1,4}),(\d{1,4})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected R,C such as 0,2")
    return int(match[1]), int(match[2])


def _two_numbers(text: str, expected: str) -> tuple[float, float]:
    try:
        first, second = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected {expected}") from None
    if not (math.isfinite(first) and math.isfinite(second)):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected {expected}")
    return first, second


def add_synthesizer(parser: argparse.ArgumentParser) -> None:
    """``--synthesizer NAME``."""
    from mvcodec.synthesis.synthesizers import SYNTHESIZERS

    parser.add_argument(
        "--synthesizer",
        default=DEFAULT_SYNTHESIZER,
        metavar=SPECIFICATION,
        help=f"one of {', '.join(SYNTHESIZERS)}; mvcodec plugins lists settings (default: %(default)s)",
    )


def add_matcher(parser: argparse.ArgumentParser) -> None:
    """``--matcher NAME``, of commands that decode."""
    from mvcodec.layers.refinement import matcher_choices

    parser.add_argument(
        "--matcher",
        metavar=SPECIFICATION,
        help=f"what estimates the maps of a file that holds none; {matcher_choices()}"
        " (default: the one that the file names)",
    )


def check_matcher(matcher: str | None, header: StreamHeader) -> None:
    """Refuse ``--matcher`` where it would have no effect.

    Raises:
        SettingError: it is given, and the file holds maps.
    """
    if matcher is not None and not header.estimates_maps:
        raise SettingError("--matcher", matcher, "no such option: the file holds maps")


def add_frames(parser: argparse.ArgumentParser, what: str) -> None:
    """``--frames A:B``."""
    parser.add_argument(
        "--frames", type=frame_slice, metavar="A:B", help=f"{what}, a Python slice (default: all)"
    )


def add_output_options(parser: argparse.ArgumentParser, json_help: str | None = None) -> None:
    """``--quiet``, and ``--json`` where the command has a result that a program would want."""
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no summary")
    if json_help is not None:
        parser.add_argument("--json", action="store_true", help=json_help)

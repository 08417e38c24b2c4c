"""Array folders that synthesis is measured on, and what of each: its uncoded corners and some views."""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mvcodec.array import CameraArray, Position
from mvcodec.capture import ArraySource, open_input
from mvcodec.errors import InputError, MvCodecError, MvCodecWarning, SettingError
from mvcodec.frames import DecodedSet, FrameSet
from mvcodec.layers.refinement import make_matcher, matcher_choices
from mvcodec.stereo.disparity_range import estimate_range


def scored_views(array: CameraArray) -> list[Position]:
    """The virtual views that count; a sample of them in the grids of 17 x 17 and 9 x 9."""
    virtual = [view for view in array.positions if view not in array.real]
    if (array.rows, array.cols) == (17, 17):
        return [(row, col) for row, col in virtual if row % 4 == 0 and col % 4 == 0]
    if (array.rows, array.cols) == (9, 9):
        return [(row, col) for row, col in virtual if (row + col) % 5 == 0]
    return virtual


def match_corners(source: ArraySource, matcher: str) -> tuple[FrameSet, DecodedSet, float]:
    """Frame 0 of real and scored views, its uncoded corners with their maps, and seconds of matching."""
    array = source.array
    (originals,) = source.frame_sets(slice(0, 1), [*array.real, *scored_views(array)])
    pictures = {camera: originals.pictures[camera] for camera in array.real}
    range_px = estimate_range(array, [originals], None)
    started = time.perf_counter()
    maps = make_matcher(matcher).match(array, pictures, range_px)
    seconds = time.perf_counter() - started
    decoded = DecodedSet(array, originals.index, originals.time_ns, pictures, maps, range_px)
    return originals, decoded, seconds


def find_sets(data: Path, names: Sequence[str] | None) -> dict[str, Path]:
    """Array folders by name: `data` itself, or those right below it."""
    if (data / "array.json").is_file():
        found = {data.resolve().name: data}
    else:
        found = {path.parent.name: path.parent for path in sorted(data.glob("*/array.json"))}
    if not found:
        raise InputError(data, "no array.json in it or right below it", "an array folder or a folder of them")
    unknown = [name for name in names or () if name not in found]
    if unknown:
        raise SettingError("--sets", ",".join(unknown), "some of " + ", ".join(found))
    return {name: found[name] for name in names or found}


def say(line: str, arguments: argparse.Namespace) -> None:
    """Tables go to standard output, or aside where JSON goes there."""
    print(line, file=sys.stderr if arguments.json else sys.stdout, flush=True)


def with_virtual_views(found: dict[str, Path], arguments: argparse.Namespace) -> dict[str, ArraySource]:
    """Open the sets; leave those out that have nothing to synthesise, and say so."""
    sets = {}
    for name, path in found.items():
        source = open_input([path])
        if scored_views(source.array):
            sets[name] = source
        else:
            say(
                f"{name}: skipped, its {source.array.rows} x {source.array.cols} grid has no virtual view",
                arguments,
            )
    if not sets:
        raise InputError(arguments.data, "no set with a virtual view", "at least one")
    return sets


def add_options(parser: argparse.ArgumentParser, *, data_required: bool) -> None:
    """What the measurements share: which sets, matched and rendered by what, and the form of the result."""
    parser.add_argument("--data", type=Path, metavar="DIR", required=data_required)
    parser.add_argument("--sets", type=lambda text: text.split(","), metavar="A,B")
    parser.add_argument("--matcher", default="joint", metavar="NAME", help=matcher_choices())
    parser.add_argument("--synthesizer", default="layered")
    parser.add_argument("--json", action="store_true")


def run(parser: argparse.ArgumentParser, measure: Callable[[argparse.Namespace], dict[str, Any]]) -> int:
    """Parse, measure, print; returns the exit code. An error is one line on standard error."""
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", MvCodecWarning)  # nominal calibration does not matter here
    try:
        document = measure(arguments)
    except MvCodecError as error:
        print(f"{Path(sys.argv[0]).stem}: {error}", file=sys.stderr)
        return 2 if isinstance(error, SettingError) else 1
    if arguments.json:
        print(json.dumps(document, indent=2))
    return 0

"""``mvcodec export-points``: what the cameras see, as points in space."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from mvcodec.capture.manifest import read_calibration
from mvcodec.cli.arguments import (
    add_frames,
    add_matcher,
    add_output_options,
    check_matcher,
    positive_int,
    positive_number,
)
from mvcodec.cli.info import count
from mvcodec.cli.paths import add_overwrite, check_file_target, local_path
from mvcodec.cli.progress import progress
from mvcodec.cli.safety import add_limits, add_on_error, limits_of
from mvcodec.container.point_writer import PointWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.depth import points_of, require_calibration, warn_behind_infinity
from mvcodec.errors import SettingError
from mvcodec.output.ply import write_ply

SUFFIXES = (".mcap", ".ply")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``export-points``."""
    parser.add_argument("input", metavar="IN.mcap", help="or its URL")
    parser.add_argument(
        "output",
        type=local_path,
        metavar="OUT",
        help="a .mcap file of all frames, or a .ply file of the first one",
    )
    parser.add_argument("--stride", type=positive_int, default=1, metavar="N", help="every Nth pixel")
    parser.add_argument(
        "--max-depth",
        type=positive_number,
        default=float("inf"),
        metavar="M",
        help="leave out what is farther, metres",
    )
    parser.add_argument(
        "--calibration", type=Path, metavar="FILE", help="JSON with the calibration as in array.json"
    )
    parser.add_argument("--nominal", action="store_true", help="accept nominal calibration")
    add_matcher(parser)
    add_frames(parser, "frames of the file to export")
    add_on_error(parser)
    add_limits(parser)
    add_overwrite(parser)
    add_output_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Decode and write points."""
    target: Path = arguments.output
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise SettingError("OUT", target, f"a name that ends in {' or '.join(SUFFIXES)}")
    check_file_target(target, overwrite=arguments.overwrite)
    if target.resolve() == Path(arguments.input).resolve():
        raise SettingError("OUT", target, "another file than IN.mcap")
    with (
        Decoder.open(
            arguments.input, arguments.frames, arguments.on_error, limits_of(arguments), arguments.matcher
        ) as decoder,
        progress("export", None, quiet=arguments.quiet) as bar,
        PointWriter(target) as writer,
    ):
        check_matcher(arguments.matcher, decoder.header)
        array = decoder.header.array
        if arguments.calibration is not None:
            array = replace(array, calibration=read_calibration(arguments.calibration))
        require_calibration(array, arguments.nominal)
        total = frames = 0
        first: int | None = None
        for number, decoded in enumerate(decoder):
            if number == 0:
                maps = (item.values_px for item in decoded.disparities.values())
                warn_behind_infinity(array, maps, arguments.input)
                first = decoded.index
            points = points_of(replace(decoded, array=array), arguments.stride, arguments.max_depth)
            total += len(points.places_m)
            frames += 1
            if suffix == ".ply":
                write_ply(target, points)
                break
            writer.push(decoded.index, decoded.time_ns, points.places_m, points.colours)
            bar.update()
    if not arguments.quiet and frames:
        of = f"frame {first}" if suffix == ".ply" else count(frames, "frame")
        print(f"{target}: {count(total, 'point')} of {of}")

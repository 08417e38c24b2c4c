"""``mvcodec join``: segments of one stream to one file."""

from __future__ import annotations

import argparse
import json

from mvcodec.cli.arguments import add_output_options
from mvcodec.cli.info import document, summary
from mvcodec.cli.paths import add_overwrite, check_file_target, local_path
from mvcodec.cli.safety import add_limits, limits_of
from mvcodec.container import read_info
from mvcodec.container.joining import join
from mvcodec.errors import SettingError
from mvcodec.output.atomic import replacing


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``join``."""
    parser.add_argument(
        "input",
        nargs="+",
        metavar="PART.mcap",
        help="files of one encoding, or their URLs, in order of time, as `encode --continues` writes them",
    )
    parser.add_argument("output", type=local_path, metavar="OUT.mcap", help="the file to write")
    add_limits(parser)
    add_overwrite(parser)
    add_output_options(parser, "print what the new file holds as JSON")


def run(arguments: argparse.Namespace) -> None:
    """Join the parts; nothing is left of a file that could not be completed."""
    if str(arguments.output) in arguments.input:
        raise SettingError("OUT", arguments.output, "another file than PART.mcap")
    check_file_target(arguments.output, overwrite=arguments.overwrite)
    with replacing(arguments.output) as part:
        join(arguments.input, part, limits_of(arguments))
    info = read_info(arguments.output)
    if arguments.json:
        print(json.dumps(document(info, arguments.output)))
    elif not arguments.quiet:
        print(f"{arguments.output}: {summary(info)}")

"""``mvcodec init``: the array.json of a folder of pictures or videos."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from mvcodec.capture.manifest import DEFAULT_FPS, MANIFEST_NAME
from mvcodec.capture.numbered_files import FoundViews, find_views
from mvcodec.capture.timing import Timing
from mvcodec.cli.arguments import pair_of_sizes
from mvcodec.cli.info import count
from mvcodec.cli.paths import add_overwrite, check_file_target, local_path
from mvcodec.cli.setting_options import add_setting
from mvcodec.output.atomic import write_bytes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``init``."""
    parser.add_argument(
        "folder",
        type=local_path,
        metavar="FOLDER",
        help="holds the pictures or videos, or folders of them; names have numbers for row and column, or one"
        " for the camera, and pictures one for the frame, from 0 or 1 on",
    )
    parser.add_argument(
        "--grid", type=pair_of_sizes, metavar="RxC", help="needed where names have one number for the camera"
    )
    add_setting(parser, Timing, "fps", left_open=True, note=f" (default: {DEFAULT_FPS:g})")
    add_overwrite(parser)
    parser.add_argument("--quiet", action="store_true", help="no summary")


def run(arguments: argparse.Namespace) -> None:
    """Look at the names, write, and say what was understood."""
    found = find_views(arguments.folder, arguments.grid)
    target: Path = arguments.folder / MANIFEST_NAME
    check_file_target(target, overwrite=arguments.overwrite)
    write_bytes(target, (json.dumps(document(found, arguments.fps), indent=1) + "\n").encode())
    if not arguments.quiet:
        frames = "videos" if found.videos else count(len(found.files[0, 0]), "picture") + " each"
        print(f"{target}: {found.rows} x {found.cols} views, {frames}; the first is {found.files[0, 0][0]}")


def document(found: FoundViews, fps: float | None) -> dict[str, object]:
    """The smallest array.json that says what was found."""
    views = [
        [
            found.files[row, col][0] if found.videos else list(found.files[row, col])
            for col in range(found.cols)
        ]
        for row in range(found.rows)
    ]
    stated: dict[str, object] = {"rows": found.rows, "cols": found.cols}
    if fps is not None:
        stated["fps"] = fps
    return stated | {"views": views}

"""Files and folders that the user names: no addresses on the web, and nothing is overwritten unasked."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from mvcodec.container.remote import is_url
from mvcodec.errors import InputError, OutputError

ASK = "-y overwrites it"

VIEW = r"r\d+(\.\d+)?_c\d+(\.\d+)?"
"""Names of views, between grid places too."""

ARRAY_NAMES = rf"array\.json|rig_truth\.json|truth|{VIEW}"
"""What stands in an array folder that we write, and of picture folders below it."""

PICTURE_NAMES = VIEW
VIDEO_NAMES = rf"{VIEW}\.mp4"


def local_path(text: str) -> Path:
    """A path, which an address on the web is not."""
    if is_url(text):
        raise argparse.ArgumentTypeError(f"found {text}, expected a file or folder on this machine")
    return Path(text)


def add_overwrite(parser: argparse.ArgumentParser) -> None:
    """``-y``, ``--overwrite``."""
    parser.add_argument("-y", "--overwrite", action="store_true", help="overwrite what is there already")


def check_file_target(path: Path, *, overwrite: bool) -> None:
    """Raise OutputError where a file cannot be: it is a folder, has none to lie in, or is there already.

    A folder that the user mistyped is not made, so that the file is not looked for in vain. Devices and pipes
    may be written to.
    """
    if path.is_dir():
        raise OutputError(path, "it is a folder")
    if not path.parent.is_dir():
        raise OutputError(path, f"there is no folder {path.parent}")
    if path.is_file() and not overwrite:
        raise OutputError(path, f"it is there already; {ASK}")


def check_folder_target(path: Path, names: str, *, overwrite: bool) -> None:
    """Raise OutputError where a folder holds other things than what is to be written, or just that, unasked.

    Args:
        names: pattern of the names that may be overwritten.
    """
    if path.exists() and not path.is_dir():
        raise OutputError(path, "it is a file, and a folder is to be written")
    try:
        held = sorted(item.name for item in path.iterdir()) if path.is_dir() else []
    except OSError as error:
        raise InputError(path, error.strerror or "an unreadable folder", "a folder") from None
    others = [name for name in held if not re.fullmatch(names, name)]
    if others:
        raise OutputError(path, f"it holds other things, such as {others[0]}; name another folder")
    if held and not overwrite:
        raise OutputError(path, f"it holds {held[0]} already; {ASK}")

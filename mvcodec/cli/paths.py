"""Files and folders that the user names: addresses on the web are none, and files need a folder."""

from __future__ import annotations

import argparse
from pathlib import Path

from mvcodec.container.remote import is_url
from mvcodec.errors import OutputError


def local_path(text: str) -> Path:
    """A path, which an address on the web is not."""
    if is_url(text):
        raise argparse.ArgumentTypeError(f"found {text}, expected a file or folder on this machine")
    return Path(text)


def check_file_target(path: Path) -> None:
    """Raise OutputError where a file cannot be: a folder is there, or none that it could lie in.

    A folder that the user mistyped is not made, so that the file is not looked for in vain.
    """
    if path.is_dir():
        raise OutputError(path, "it is a folder")
    if not path.parent.is_dir():
        raise OutputError(path, f"there is no folder {path.parent}")

"""Files and folders that the user names: addresses on the web are none, and files need a folder."""

from __future__ import annotations

import argparse
from pathlib import Path

from mvcodec.container.remote import is_url


def local_path(text: str) -> Path:
    """A path, which an address on the web is not."""
    if is_url(text):
        raise argparse.ArgumentTypeError(f"found {text}, expected a file or folder on this machine")
    return Path(text)

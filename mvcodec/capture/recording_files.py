"""The files that a recording consists of: those of a rosbag2 folder; other bags are refused by their name."""

from __future__ import annotations

import re
from pathlib import Path

from mvcodec.errors import InputError

SUFFIX = ".mcap"
METADATA = "metadata.yaml"
"""What rosbag2 writes beside its files."""

_ARRAY = "array.json"

_OTHERS = {
    ".db3": "a rosbag2 recording in SQLite",
    ".bag": "a ROS 1 bag",
    ".mcap.zstd": "a recording that rosbag2 compressed as a file",
    ".db3.zstd": "a rosbag2 recording in SQLite, compressed as a file",
}
_CONVERT = "MCAP: rosbags-convert (package rosbags) converts it, see docs/recordings.md"
_UNPACK = "MCAP: zstd -d unpacks it"


def recording_files(path: Path) -> list[Path]:
    """The MCAP files of a folder that is a recording, in order of their numbers; of all else the path alone.

    Raises:
        InputError: a bag that is not in MCAP.
    """
    if path.name == METADATA and path.is_file():
        path = path.parent
    if not path.is_dir():
        _refuse(path)
        return [path]
    if (path / _ARRAY).exists():
        return [path]
    held = [item for item in path.iterdir() if not item.name.startswith(".")]
    parts = [item for item in held if item.suffix.lower() == SUFFIX]
    is_bag = path / METADATA in held
    if is_bag and not parts:
        for item in held:
            _refuse(item)
    return sorted(parts, key=_by_number) if parts and (is_bag or len(parts) == len(held)) else [path]


def _refuse(path: Path) -> None:
    for ending, found in _OTHERS.items():
        if path.name.lower().endswith(ending) and path.is_file():
            raise InputError(path, found, _UNPACK if ending == ".mcap.zstd" else _CONVERT)


def _by_number(path: Path) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]

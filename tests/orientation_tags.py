"""Display matrices put into MP4 files, as cameras that are mounted upside down write them."""

from __future__ import annotations

import struct
from pathlib import Path

_ONE = 0x10000
_LAST = 0x40000000
_STRAIGHT = struct.pack(">9i", _ONE, 0, 0, 0, _ONE, 0, 0, 0, _LAST)


def turn_upside_down(path: Path, size: tuple[int, int]) -> None:
    """Tag the pictures (width, height) of an MP4 file as to be shown turned by 180 degrees."""
    write_matrix(path, (-_ONE, 0, 0, 0, -_ONE, 0, size[0] << 16, size[1] << 16, _LAST))


def write_matrix(path: Path, matrix: tuple[int, ...]) -> None:
    """Put a display matrix in place of the track's own, which does nothing."""
    data = bytearray(path.read_bytes())
    at = data.find(_STRAIGHT, data.find(b"tkhd"))
    assert at > 0
    data[at : at + 36] = struct.pack(">9i", *matrix)
    path.write_bytes(data)

"""Points out: binary PLY."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mvcodec.depth import Points
from mvcodec.output.atomic import write_bytes

_VERTEX = np.dtype([("place", "<f4", 3), ("colour", "u1", 3)])
_HEADER = """ply
format binary_little_endian 1.0
comment x forward, y left, z up, metres
element vertex {count}
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
end_header
"""


def write_ply(path: Path, points: Points) -> None:
    """Write points with their colours, complete or not at all.

    Raises:
        OutputError: the system refuses.
    """
    vertices = np.zeros(len(points.places_m), _VERTEX)
    vertices["place"], vertices["colour"] = points.places_m, points.colours
    write_bytes(path, _HEADER.format(count=len(vertices)).encode() + vertices.tobytes())

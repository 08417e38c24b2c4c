"""How a picture must be turned before it stands as the camera saw it: tags of video files and of JPEG."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from mvcodec.frames import Picture

_ONE = 1 << 16
"""1.0 in a display matrix."""

_EXIF = {
    2: (0, True),
    3: (2, False),
    4: (2, True),
    5: (3, True),
    6: (3, False),
    7: (1, True),
    8: (1, False),
}
"""EXIF's Orientation -> (quarter turns to the left, mirrored left to right after them)."""


@dataclass(frozen=True, slots=True)
class Orientation:
    """Quarter turns to the left, then a swap of left and right.

    Attributes:
        turns: 0..3.
        mirrored: whether left and right are swapped after the turns.
    """

    turns: int = 0
    mirrored: bool = False

    def size(self, width: int, height: int) -> tuple[int, int]:
        """(width, height) of a picture of that size after it was turned."""
        return (height, width) if self.turns % 2 else (width, height)

    def apply(self, picture: Picture) -> Picture:
        """The picture as the camera saw it, uint8 (H, W, 3)."""
        if not (self.turns or self.mirrored):
            return picture
        turned = np.rot90(picture, self.turns)
        return np.ascontiguousarray(turned[:, ::-1] if self.mirrored else turned)


UPRIGHT = Orientation()


def exif_orientation(value: object) -> Orientation:
    """What EXIF's Orientation tag asks for; upright for values that it does not have."""
    return Orientation(*_EXIF.get(value, (0, False))) if isinstance(value, int) else UPRIGHT


def matrix_orientation(data: bytes) -> Orientation | None:
    """What a display matrix asks for: nine big numbers of 32 bits (ISO/IEC 14496-12, 8.3.2).

    Returns:
        None where it turns by other angles than quarters, or shears.
    """
    if len(data) < 36:
        return None
    a, b, _, c, d = struct.unpack_from("<5i", data)
    # Row vectors: (x, y) goes to (a x + c y, b x + d y), y down.
    across, down = (_sign(a), _sign(b)), (_sign(c), _sign(d))
    known = {
        ((1, 0), (0, 1)): (0, False),
        ((0, 1), (-1, 0)): (3, False),
        ((-1, 0), (0, -1)): (2, False),
        ((0, -1), (1, 0)): (1, False),
        ((-1, 0), (0, 1)): (0, True),
        ((1, 0), (0, -1)): (2, True),
        ((0, 1), (1, 0)): (3, True),
        ((0, -1), (-1, 0)): (1, True),
    }
    found = known.get((across, down))
    return None if found is None else Orientation(*found)


def _sign(value: int) -> int:
    """-1, 0 or 1 of a number that is one of these; 2 for others, which no quarter turn has."""
    nearest = round(value / _ONE)
    return nearest if abs(value - nearest * _ONE) <= _ONE // 100 and abs(nearest) <= 1 else 2

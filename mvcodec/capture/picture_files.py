"""Picture files in: PNG, JPEG, PPM/PGM, BMP, TIFF, 8 to 16 bits a channel."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import ImageFile

from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.still_pictures import (
    GREY_MODES,
    SCALING_DECODERS,
    StillFacts,
    UnreadablePicture,
    deep_pixels,
    opened_still,
    still_facts,
    still_to_rgb,
)
from mvcodec.errors import InputError
from mvcodec.frames import Picture

_EXPECTED = "PNG, JPEG, PPM, PGM, BMP or TIFF"


def picture_facts(path: Path) -> StillFacts:
    """Size and such of a picture, from the file's header alone.

    Raises:
        InputError: missing or not a picture.
    """
    with _opened(path) as picture:
        return still_facts(picture)


def picture_size(path: Path) -> tuple[int, int]:
    """(width, height) in px as shown, from the file's header alone.

    Raises:
        InputError: missing or not a picture.
    """
    return picture_facts(path).size


def look_at_depth(path: Path, depth: BitDepth) -> None:
    """Take a picture into account for the depth of its input, where its file says too little.

    Raises:
        InputError: unreadable.
    """
    with _opened(path):
        pixels = deep_pixels(path.read_bytes())
        if pixels is not None:
            depth.look(pixels)


def read_picture(path: Path, size: tuple[int, int] | None = None, depth: BitDepth | None = None) -> Picture:
    """Read a picture as uint8 (H, W, 3) RGB, turned as its tags say; a grey one becomes three equal channels.

    Args:
        path: the file.
        size: (width, height) that it must have, px.
        depth: of the input that it belongs to, where that is more than 8 bits.

    Raises:
        InputError: missing, unreadable, deeper than 16 bits, or of another size.
    """
    with _opened(path) as picture:
        found = still_facts(picture).size
        if size is not None and found != size:
            raise wrong_size(path, found, size)
        return still_to_rgb(picture, path, depth or BitDepth(str(path)))


def read_grey(path: Path) -> NDArray[Any]:
    """Read a picture of one channel, 8 or 16 bits, as integers (H, W), values as stored.

    Raises:
        InputError: missing, unreadable, or with several channels.
    """
    with _opened(path) as picture:
        if picture.mode != "L" and picture.mode not in GREY_MODES:
            raise InputError(path, f"{len(picture.getbands())} channels ({picture.mode})", "one grey channel")
        if picture.tile and picture.tile[0][0] in SCALING_DECODERS:
            # Pillow would stretch them.
            raise InputError(path, "text, or grey levels that end elsewhere", "binary PGM up to 255 or 65535")
        return np.array(picture)


def wrong_size(path: Path, found: tuple[int, int], expected: tuple[int, int]) -> InputError:
    """The error for a picture of another size than the rest of its array."""
    return InputError(
        path, f"{found[0]}x{found[1]} px", f"{expected[0]}x{expected[1]} px as in the first view of the array"
    )


@contextmanager
def _opened(path: Path) -> Iterator[ImageFile.ImageFile]:
    """The opened picture; what goes wrong inside becomes an InputError."""
    try:
        with opened_still(path) as picture:
            yield picture
    except UnreadablePicture as error:
        raise InputError(path, error, _EXPECTED) from None
    except FileNotFoundError:
        raise InputError(path, "no such file", "a picture") from None

"""Picture files in: PNG, JPEG, PPM/PGM, BMP, TIFF, 8 bits a channel."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile, UnidentifiedImageError

from mvcodec.errors import InputError
from mvcodec.frames import Picture

# Pillow, not OpenCV: equally exact, but OpenCV's libpng writes its own complaints to stderr.
_DEEP_MODES = {"I": 32, "I;16": 16, "I;16B": 16, "I;16L": 16, "F": 32}
_SCALING_DECODERS = ("ppm", "ppm_plain")


def picture_size(path: Path) -> tuple[int, int]:
    """(width, height) in px, from the file's header alone.

    Raises:
        InputError: missing or not a picture.
    """
    with _opened(path) as picture:
        return picture.size


def read_picture(path: Path, size: tuple[int, int] | None = None) -> Picture:
    """Read a picture as uint8 (H, W, 3) RGB; a grey one becomes three equal channels.

    The pixels are taken as they lie in the file: a rotation tag would break the rectification.

    Args:
        path: the file.
        size: (width, height) that it must have, px.

    Raises:
        InputError: missing, unreadable, deeper than 8 bits, or of another size.
    """
    with _opened(path) as picture:
        if size is not None and picture.size != size:
            raise wrong_size(path, picture.size, size)
        depth = _depth(picture)
        if depth > 8:
            raise InputError(path, f"{depth} bits a channel", "8 bits a channel")
        return np.array(picture if picture.mode == "RGB" else picture.convert("RGB"), np.uint8)


def read_grey(path: Path) -> NDArray[Any]:
    """Read a picture of one channel, 8 or 16 bits, as integers (H, W), values as stored.

    Raises:
        InputError: missing, unreadable, or with several channels.
    """
    with _opened(path) as picture:
        if picture.mode != "L" and picture.mode not in _DEEP_MODES:
            raise InputError(path, f"{len(picture.getbands())} channels ({picture.mode})", "one grey channel")
        if picture.tile and picture.tile[0][0] in _SCALING_DECODERS:
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
    expected = "PNG, JPEG, PPM, PGM, BMP or TIFF"
    try:
        with Image.open(path) as picture:
            yield picture
    except UnidentifiedImageError:
        found = "an unreadable picture" if path.stat().st_size else "an empty file"
        raise InputError(path, found, expected) from None
    except FileNotFoundError:
        raise InputError(path, "no such file", "a picture") from None
    except (OSError, ValueError, SyntaxError, EOFError, IndexError, Image.DecompressionBombError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        found = f"an unreadable picture ({' '.join(reason.split())})"
        raise InputError(path, found, expected) from None


def _depth(picture: ImageFile.ImageFile) -> int:
    """Bits a channel in the file; Pillow takes the upper 8 of deep colours without a word."""
    if picture.mode in _DEEP_MODES:
        return _DEEP_MODES[picture.mode]
    for decoder, _, _, options in picture.tile:
        highest = options[-1] if decoder in _SCALING_DECODERS and isinstance(options, tuple) else 255
        if ";16" in str(options) or highest > 255:
            return 16
    return 8

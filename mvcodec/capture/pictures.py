"""Picture files in: PNG, JPEG, PPM/PGM, BMP, TIFF, 8 bits a channel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from mvcodec.errors import InputError
from mvcodec.frames import Picture

# The pixels as they lie in the file: a rotation tag would break the rectification.
_PICTURE_FLAGS = cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION


def picture_size(path: Path) -> tuple[int, int]:
    """(width, height) in px, from the file's header alone.

    Raises:
        InputError: missing or not a picture.
    """
    try:
        with Image.open(path) as picture:
            return picture.size
    except UnidentifiedImageError:
        raise InputError(path, "an unreadable picture", "PNG, JPEG, PPM, PGM, BMP or TIFF") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise _unreadable(path, error) from None


def read_picture(path: Path, size: tuple[int, int] | None = None) -> Picture:
    """Read a picture as uint8 (H, W, 3) RGB; a grey one becomes three equal channels.

    Args:
        path: the file.
        size: (width, height) that it must have, px.

    Raises:
        InputError: missing, unreadable, deeper than 8 bits, or of another size.
    """
    pixels = read_pixels(path, _PICTURE_FLAGS)
    if pixels.dtype != np.uint8:
        raise InputError(path, f"{pixels.dtype.itemsize * 8} bits a channel", "8 bits a channel")
    found = pixels.shape[1], pixels.shape[0]
    if size is not None and found != size:
        raise wrong_size(path, found, size)
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB), np.uint8)


def read_pixels(path: Path, flags: int) -> NDArray[np.integer[Any] | np.floating[Any]]:
    """Decode a picture file with OpenCV's `flags`: (H, W) or (H, W, C), BGR.

    Raises:
        InputError: missing or unreadable.
    """
    try:
        data = np.fromfile(path, np.uint8)
        pixels = cv2.imdecode(data, flags) if data.size else None
    except OSError as error:
        raise _unreadable(path, error) from None
    except cv2.error as error:
        raise InputError(path, f"an unreadable picture ({error.err})", "a picture") from None
    if pixels is None:
        raise InputError(path, "an unreadable picture" if data.size else "an empty file", "a picture")
    return pixels


def wrong_size(path: Path, found: tuple[int, int], expected: tuple[int, int]) -> InputError:
    """The error for a picture of another size than the rest of its array."""
    return InputError(
        path, f"{found[0]}x{found[1]} px", f"{expected[0]}x{expected[1]} px as in the first view of the array"
    )


def _unreadable(path: Path, error: Exception) -> InputError:
    if isinstance(error, FileNotFoundError):
        return InputError(path, "no such file", "a picture")
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return InputError(path, f"an unreadable picture ({' '.join(reason.split())})", "a picture")

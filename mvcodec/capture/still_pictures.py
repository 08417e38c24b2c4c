"""Coded still pictures -> RGB, from files and from messages alike."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageFile, UnidentifiedImageError

from mvcodec.capture.bit_depth import BitDepth, DeepPixels
from mvcodec.capture.orientation import Orientation, exif_orientation
from mvcodec.frames import Picture

GREY_MODES = {"I;16": 16, "I;16B": 16, "I;16L": 16, "I": 32, "F": 32}
"""Pillow's modes of one deep channel, and their bits."""

SCALING_DECODERS = ("ppm", "ppm_plain")
"""Those of Pillow that stretch values to the whole range themselves."""

_TURNED_WHEN_READ = ("TIFF",)
"""Pillow and OpenCV turn these by themselves, and no others."""

_BITS, _STRETCHED = "bits in the file", "stretched when read"
"""What is kept beside an opened picture's own information."""

_ALPHA_MODES = frozenset({"RGBA", "LA", "PA", "La", "RGBa"})
_SIGNIFICANT_BITS = b"sBIT"
_PNG = b"\x89PNG\r\n\x1a\n"
_TAGS = frozenset({b"eXIf", b"tEXt", b"zTXt", b"iTXt"})
"""Chunks of a PNG that may say how it is turned."""


class UnreadablePicture(Exception):
    """A picture that cannot be read; says what is found."""


@dataclass(frozen=True, slots=True)
class StillFacts:
    """What a picture's header says.

    Attributes:
        size: (width, height) as shown, px.
        orientation: how it must be turned for that.
        alpha: it says how opaque its pixels are.
        bits: of a channel.
        count: pictures in the file; the first one is read.
    """

    size: tuple[int, int]
    orientation: Orientation
    alpha: bool
    bits: int
    count: int


@contextmanager
def opened_still(source: Path | bytes) -> Iterator[ImageFile.ImageFile]:
    """The opened picture of a file or of its bytes. Pixels are read later.

    Raises:
        UnreadablePicture: also for what goes wrong inside the block.
        FileNotFoundError: there is no such file.
    """
    # Pillow, not OpenCV: equally exact, but OpenCV's libpng writes its own complaints to stderr.
    try:
        with Image.open(io.BytesIO(source) if isinstance(source, bytes) else source) as picture:
            # Once its pixels are read, Pillow forgets how they lie in the file; the tags of a PNG read them.
            picture.info |= {_BITS: _bits(picture), _STRETCHED: _is_stretched(picture)}
            yield picture
    except UnidentifiedImageError:
        size = len(source) if isinstance(source, bytes) else source.stat().st_size
        raise UnreadablePicture("an unreadable picture" if size else "an empty file") from None
    except FileNotFoundError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError, IndexError, Image.DecompressionBombError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise UnreadablePicture(f"an unreadable picture ({' '.join(reason.split())})") from None


def still_facts(picture: ImageFile.ImageFile) -> StillFacts:
    """What the header of an opened picture says."""
    orientation = exif_orientation(_orientation_tag(picture))
    alpha = picture.mode in _ALPHA_MODES or "transparency" in picture.info
    count = getattr(picture, "n_frames", 1)
    return StillFacts(orientation.size(*picture.size), orientation, alpha, picture.info[_BITS], count)


def _orientation_tag(picture: ImageFile.ImageFile) -> int | None:
    """How a picture says that it must be turned, as EXIF counts; None where that needs no doing."""
    if picture.format in _TURNED_WHEN_READ:
        return None
    # Pillow reads a PNG's pixels for what may stand behind them: mostly nothing does.
    early = picture.format == "PNG" and picture.tile and not _has_late_tags(picture)
    exif = Image.Image.getexif(picture) if early else picture.getexif()
    tag: int | None = exif.get(ExifTags.Base.Orientation)
    return tag


def _has_late_tags(picture: ImageFile.ImageFile) -> bool:
    """Whether a PNG that is not yet read, or a damaged one, has tags behind its pixels."""
    file = picture.fp
    assert file is not None
    before = file.tell()
    at, pixels = len(_PNG), False
    try:
        while True:
            file.seek(at)
            head = file.read(8)
            if len(head) < 8:
                return True
            size, kind = struct.unpack(">I4s", head)
            if kind == b"IEND" or (pixels and kind in _TAGS):
                return kind in _TAGS
            pixels |= kind == b"IDAT"
            at += size + 12
    finally:
        file.seek(before)


def is_see_through(picture: ImageFile.ImageFile) -> bool:
    """Whether some pixel of a picture with alpha is not opaque."""
    return bool(np.array(picture.convert("RGBA").getchannel("A")).min() < 255)


def still_to_rgb(picture: ImageFile.ImageFile, source: Path | bytes, depth: BitDepth) -> Picture:
    """uint8 (H, W, 3) RGB of an opened picture, turned as it says; a grey one becomes three equal channels.

    Args:
        source: what it was opened from; deep colours are read from it again.
        depth: of the input.

    Raises:
        UnreadablePicture: of more than 16 bits, or of numbers that are no levels.
    """
    facts = still_facts(picture)
    if facts.bits > 16:
        raise UnreadablePicture(f"a picture of {facts.bits} bits a channel")
    if facts.bits > 8:
        data = source if isinstance(source, bytes) else source.read_bytes()
        deep = np.array(picture).astype(np.uint16) if picture.mode in GREY_MODES else _deep_colours(data)
        stated = facts.bits if picture.info[_STRETCHED] else _stated_bits(data)
        pixels = _three_channels(depth.scale(deep, stated))
    else:
        pixels = np.array(picture if picture.mode == "RGB" else picture.convert("RGB"), np.uint8)
    return facts.orientation.apply(pixels)


def deep_pixels(source: bytes) -> DeepPixels | None:
    """The pixels of a picture of 9 to 16 bits whose file does not say how many it uses; None of others."""
    with opened_still(source) as picture:
        if picture.info[_BITS] != 16 or picture.info[_STRETCHED] or _stated_bits(source) is not None:
            return None
        if picture.mode in GREY_MODES:
            return np.array(picture).astype(np.uint16)
        return _deep_colours(source)


def _bits(picture: ImageFile.ImageFile) -> int:
    """Bits a channel in the file; Pillow takes the upper 8 of deep colours without a word."""
    if picture.mode == "I" and picture.format in ("PNG", "PPM"):
        return 16  # Pillow's word for 16 bits of grey in these
    if picture.mode in GREY_MODES:
        return GREY_MODES[picture.mode]
    return 16 if any(";16" in str(options) for _, _, _, options in picture.tile) else 8


def _is_stretched(picture: ImageFile.ImageFile) -> bool:
    return bool(picture.tile) and picture.tile[0][0] in SCALING_DECODERS


def _stated_bits(data: bytes) -> int | None:
    """What a PNG says of the bits that its 16 really have (sBIT, 11.3.2.7); None where it says nothing."""
    if not data.startswith(b"\x89PNG"):
        return None
    at = 8
    while at + 12 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == _SIGNIFICANT_BITS:
            bits = max(data[at + 8 : at + 8 + size], default=0)
            return bits if 8 <= bits <= 16 else None
        if kind == b"IDAT":
            return None
        at += size + 12
    return None


def _deep_colours(data: bytes) -> DeepPixels:
    found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED | cv2.IMREAD_IGNORE_ORIENTATION)
    if found is None or found.dtype != np.uint16 or found.ndim != 3:
        raise UnreadablePicture("an unreadable picture of 16 bits a channel")
    return np.ascontiguousarray(found[..., 2::-1], np.uint16)


def _three_channels(pixels: NDArray[Any]) -> Picture:
    return pixels if pixels.ndim == 3 else np.repeat(pixels[..., None], 3, axis=2)

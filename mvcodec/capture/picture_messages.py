"""Messages with still pictures -> RGB, as their tags and formats say."""

from __future__ import annotations

import warnings

import numpy as np

from mvcodec.capture.bit_depth import BitDepth, DeepPixels
from mvcodec.capture.raw_pixels import RAW_ENCODINGS, Pixels, RawEncoding, find_encoding
from mvcodec.capture.still_pictures import (
    GREY_MODES,
    UnreadablePicture,
    deep_pixels,
    is_see_through,
    opened_still,
    still_facts,
    still_to_rgb,
)
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.errors import InputError, MvCodecWarning
from mvcodec.frames import Picture

MAX_PIXELS = 1 << 26
"""The largest picture that is taken: twice 8K."""

_DEPTH_MAP = "compressedDepth"
"""In formats of ROS: a PNG or RVL of depth behind a header of its own."""

_SWAPPED = "compressed rgb"
"""ROS's own reader swaps red and blue of such pictures; many senders of them do not."""

_GREY = ("L", *GREY_MODES)
"""Modes of pictures whose pixels may be a mosaic of colours."""

_COMPRESSED = "JPEG, PNG, WEBP, TIFF or BMP"


class StillDecoder:
    """Decodes the still pictures of one topic, coded and raw ones.

    Args:
        name: of the recording, for messages.
        depth: of the whole recording.
    """

    def __init__(self, name: str, depth: BitDepth) -> None:
        self._name, self._depth, self._told_alpha = name, depth, False
        self._told: set[str] = set()

    def look(self, message: RecordedPicture) -> None:
        """Take a picture into account for the depth of the recording; what is wrong with it is told later."""
        if message.kind == "video":
            return
        try:
            pixels = deep_pixels(message.data) if message.kind == "image" else self._deep_raw(message)
        except (UnreadablePicture, InputError):
            return
        if pixels is not None:
            self._depth.look(pixels)

    def decode(self, message: RecordedPicture) -> Picture:
        """uint8 (H, W, 3) RGB.

        Raises:
            InputError: damaged, too large, or of a format that mvcodec doesn't know.
        """
        return self._image(message) if message.kind == "image" else self._raw(message)

    def _image(self, message: RecordedPicture) -> Picture:
        if _DEPTH_MAP in message.format:
            found = f"a depth map in format {message.format!r}, which is not supported"
            raise self._error(message, found, "a topic of colour or grey pictures")
        if _SWAPPED in message.format:
            self._tell_once(
                f"{message.topic}: its format {message.format!r} may say that red and blue are swapped; its"
                " pictures are taken as they say themselves"
            )
        try:
            with opened_still(message.data) as picture:
                if picture.width * picture.height > MAX_PIXELS:
                    found = f"a picture of {picture.width}x{picture.height}"
                    raise self._error(message, found, f"at most {MAX_PIXELS} px")
                if not self._told_alpha and still_facts(picture).alpha and is_see_through(picture):
                    self._tell_alpha(message)
                pixels = still_to_rgb(picture, message.data, self._depth)
                mosaic = find_encoding(message.format.split(";")[0])
                if "bayer" not in message.format.casefold() or mosaic is None or picture.mode not in _GREY:
                    return pixels
                return mosaic.convert(pixels[..., :1])
        except UnreadablePicture as error:
            raise self._error(message, f"{error} in format {message.format!r}", _COMPRESSED) from None

    def _raw(self, message: RecordedPicture) -> Picture:
        encoding, rows = self._rows(message)
        if encoding.alpha and rows[..., -1].min() < np.iinfo(rows.dtype).max:
            self._tell_alpha(message)
        return encoding.convert(self._depth.scale(rows) if encoding.deep else rows)

    def _deep_raw(self, message: RecordedPicture) -> DeepPixels | None:
        encoding, rows = self._rows(message)
        return rows if encoding.deep else None

    def _rows(self, message: RecordedPicture) -> tuple[RawEncoding, Pixels]:
        assert message.layout is not None
        width, height, step = message.layout
        encoding = find_encoding(message.format)
        if encoding is None:
            found = f"raw pixels of encoding {message.format!r}, which is not supported"
            raise self._error(message, found, ", ".join(RAW_ENCODINGS))
        used = width * encoding.channels * (2 if encoding.deep else 1)
        fits = bool(width and height and width * height <= MAX_PIXELS and step >= used)
        if not fits or (encoding.half_rows % 2 and (width % 2 or height % 2)):
            raise self._error(message, f"{width}x{height} px in rows of {step} bytes", "a picture's layout")
        rows = height * encoding.half_rows // 2
        # The last row of some senders lacks its padding.
        if len(message.data) < step * (rows - 1) + used:
            raise self._error(message, f"{len(message.data)} bytes", f"{step * rows}")
        data = np.frombuffer(message.data, np.uint8, min(len(message.data), step * rows))
        padded = np.pad(data, (0, step * rows - len(data))).reshape(rows, step)[:, :used]
        values: Pixels = np.ascontiguousarray(padded)
        if encoding.deep:
            values = values.view(">u2" if message.big_endian else "<u2").astype(np.uint16)
        return encoding, values.reshape(rows, width, encoding.channels)

    def _tell_alpha(self, message: RecordedPicture) -> None:
        self._told_alpha = True
        self._tell_once(f"{message.topic}: how opaque its pixels are is left out")

    def _tell_once(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            warnings.warn(f"{self._name}: {text}", MvCodecWarning, stacklevel=4)

    def _error(self, message: RecordedPicture, found: str, expected: str) -> InputError:
        return InputError(f"{self._name}: {message.label}", found, expected)

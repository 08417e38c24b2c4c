"""Messages with pictures -> RGB, as their tags and formats say."""

from __future__ import annotations

import io
from collections.abc import Callable

import av
import numpy as np
from av.codec.context import Flags
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.reformatter import VideoReformatter
from PIL import Image, UnidentifiedImageError

from mvcodec.capture.video_input import frame_to_rgb
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.errors import InputError
from mvcodec.frames import Picture
from mvcodec.video.codecs import CODECS

MAX_PIXELS = 1 << 26
"""The largest picture that is taken: twice 8K."""

_DECODERS = {codec.foxglove: codec.library for codec in CODECS.values()}
_COMPRESSED = ("JPEG", "PNG", "WEBP")
_UNREADABLE = (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError)
"""What Pillow raises on damaged pictures."""


class PictureDecoder:
    """Decodes the messages of one topic, which must all come in order.

    Args:
        name: of the recording, for messages.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._context: VideoCodecContext | None = None
        self._format = ""
        self._reformatter = VideoReformatter()

    def push(self, message: RecordedPicture) -> Picture | None:
        """uint8 (H, W, 3) RGB; None where a video has not come to its first keyframe yet.

        Raises:
            InputError: damaged, too large, or of a format that mvcodec doesn't know.
        """
        if message.schema == "foxglove.CompressedVideo":
            return self._video(message)
        if message.schema == "foxglove.CompressedImage":
            return self._image(message)
        return self._raw(message)

    def _error(self, message: RecordedPicture, found: str, expected: str) -> InputError:
        return InputError(f"{self._name}: {message.label}", found, expected)

    def _video(self, message: RecordedPicture) -> Picture | None:
        if message.format not in _DECODERS:
            raise self._error(message, f"video of format {message.format!r}", ", ".join(_DECODERS))
        if self._context is None or self._format != message.format:
            self._format = message.format
            context = av.CodecContext.create(_DECODERS[message.format], "r")
            assert isinstance(context, VideoCodecContext)
            context.thread_count = 1
            context.flags |= Flags.low_delay
            context.options = {"max_pixels": str(MAX_PIXELS)}
            self._context = context
        try:
            frames = self._context.decode(av.Packet(message.data)) if message.data else []
        except FFmpegError:
            return None  # before the first keyframe there is nothing to build on
        if not frames or frames[-1].is_corrupt:
            return None
        return frame_to_rgb(frames[-1], self._reformatter)

    def _image(self, message: RecordedPicture) -> Picture:
        try:
            with Image.open(io.BytesIO(message.data), formats=_COMPRESSED) as picture:
                if picture.width * picture.height > MAX_PIXELS:
                    found = f"a picture of {picture.width}x{picture.height}"
                    raise self._error(message, found, f"at most {MAX_PIXELS} px")
                return np.array(picture.convert("RGB"), np.uint8)
        except (
            UnidentifiedImageError,
            OSError,
            ValueError,
            SyntaxError,
            Image.DecompressionBombError,
        ) as error:
            found = f"an unreadable {message.format or 'picture'} ({' '.join(str(error).split())})"
            raise self._error(message, found, ", ".join(_COMPRESSED)) from None

    def _raw(self, message: RecordedPicture) -> Picture:
        assert message.layout is not None
        width, height, step = message.layout
        if message.format not in _RAW:
            raise self._error(message, f"raw pixels of encoding {message.format!r}", ", ".join(_RAW))
        channels, convert = _RAW[message.format]
        if not (width and height and width * height <= MAX_PIXELS and step >= width * channels):
            raise self._error(message, f"{width}x{height} px in rows of {step} bytes", "a picture's layout")
        if len(message.data) < step * height:
            raise self._error(message, f"{len(message.data)} bytes", f"{step * height}")
        rows = np.frombuffer(message.data, np.uint8, step * height).reshape(height, step)
        return convert(rows[:, : width * channels].reshape(height, width, channels))


_RAW: dict[str, tuple[int, Callable[[Picture], Picture]]] = {
    "rgb8": (3, np.ascontiguousarray),
    "bgr8": (3, lambda pixels: np.ascontiguousarray(pixels[..., ::-1])),
    "8UC3": (3, lambda pixels: np.ascontiguousarray(pixels[..., ::-1])),
    "rgba8": (4, lambda pixels: np.ascontiguousarray(pixels[..., :3])),
    "bgra8": (4, lambda pixels: np.ascontiguousarray(pixels[..., 2::-1])),
    "mono8": (1, lambda pixels: np.repeat(pixels, 3, axis=2)),
    "8UC1": (1, lambda pixels: np.repeat(pixels, 3, axis=2)),
}
"""Encoding of foxglove.RawImage -> channels, and what makes RGB of them."""

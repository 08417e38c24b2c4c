"""One track through an encoder or a decoder of libavcodec, by PyAV: what the codecs of the table share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Literal, cast

import av
import numpy as np
from av.codec.context import Flags
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType, VideoFrame
from av.video.plane import VideoPlane
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from mvcodec.errors import SettingError, StreamError
from mvcodec.stream import TrackKind
from mvcodec.video.codec import CodedPicture, Plane, Planes, VideoSettings
from mvcodec.workers import scheduling_kept

MAX_PIXELS = 1 << 26
"""Decoders refuse larger pictures before they take memory: twice 8K."""


class PyavEncoder:
    """Codes one track.

    Args:
        library: libavcodec's name of the encoder.
        options: its options.
        settings: of the track.
        clean_keyframe: takes out of a keyframe's access unit what no decoder needs.

    Raises (from the first `push`):
        SettingError: the encoder does not take these settings.
    """

    def __init__(
        self,
        library: str,
        options: Mapping[str, str],
        settings: VideoSettings,
        clean_keyframe: Callable[[bytes], bytes] = bytes,
    ) -> None:
        self._library, self._settings, self._clean = library, settings, clean_keyframe
        fps = Fraction(settings.fps).limit_denominator(1_000_000)
        self._time_base = 1 / fps
        context = _context(library, "w")
        context.width, context.height = settings.width, settings.height
        context.pix_fmt = "yuv420p"
        context.framerate = fps
        context.time_base = self._time_base
        # One thread: frame threads would hold pictures back; tracks are coded side by side instead.
        context.thread_count = 1
        context.color_primaries = ColorPrimaries.BT709
        context.color_trc = ColorTrc.BT709
        context.colorspace = Colorspace.ITU709
        limited = settings.kind is TrackKind.TEXTURE
        context.color_range = ColorRange.MPEG if limited else ColorRange.JPEG
        context.options = dict(options)
        self._context = context
        self._count = 0

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        """See `VideoEncoder`."""
        frame = VideoFrame(self._settings.width, self._settings.height, "yuv420p")
        for target, plane in zip(frame.planes, (planes.y, planes.u, planes.v), strict=True):
            _view(target, *plane.shape)[:] = plane
        frame.pts = self._count
        frame.time_base = self._time_base
        frame.pict_type = PictureType.I if keyframe else PictureType.NONE
        self._count += 1
        return self._coded(frame)

    def flush(self) -> list[CodedPicture]:
        """See `VideoEncoder`."""
        return self._coded(None) if self._count else []

    def _coded(self, frame: VideoFrame | None) -> list[CodedPicture]:
        try:
            if not self._context.is_open:
                with scheduling_kept():
                    self._context.open(strict=False)
            packets = self._context.encode(frame)
        except FFmpegError as error:
            found = f"{self._library}, which refuses {self._settings.width}x{self._settings.height}"
            expected = "an encoder that takes this size and these settings"
            raise SettingError("codec", f"{found} ({error.strerror})", expected) from None
        coded = []
        for packet in packets:
            data = bytes(packet)
            coded.append(CodedPicture(self._clean(data) if packet.is_keyframe else data, packet.is_keyframe))
        return coded


class PyavDecoder:
    """Decodes one track; damage is an error, never a concealed picture.

    Args:
        library: libavcodec's name of the decoder.
        expected: what one packet holds, for messages.
        low_delay: the stream has no pictures out of order, so that each comes out at once.
    """

    def __init__(self, library: str, expected: str, low_delay: bool) -> None:
        context = _context(library, "r")
        context.thread_count = 1
        if low_delay:
            context.flags |= Flags.low_delay
        context.options = {"err_detect": "explode", "max_pixels": str(MAX_PIXELS)}
        self._context, self._expected, self._low_delay = context, expected, low_delay

    def push(self, data: bytes, label: str) -> list[Planes]:
        """See `VideoDecoder`."""
        try:
            frames = self._context.decode(av.Packet(data)) if data else []
        except FFmpegError as error:
            raise StreamError(label, f"a damaged picture ({error.strerror})", self._expected) from None
        # dav1d skips what it does not know, without a word.
        if any(frame.is_corrupt for frame in frames) or (self._low_delay and not frames):
            raise StreamError(label, "a damaged picture", self._expected)
        return [_planes(frame, label) for frame in frames]

    def flush(self) -> list[Planes]:
        """See `VideoDecoder`."""
        return [_planes(frame, "end of stream") for frame in self._context.decode(None)]


def _context(library: str, mode: Literal["r", "w"]) -> VideoCodecContext:
    return cast("VideoCodecContext", VideoCodecContext.create(library, mode))


def library_versions() -> dict[str, str]:
    """Versions of FFmpeg and of its coding library, on which streams and pictures depend."""
    codec = ".".join(map(str, av.library_versions["libavcodec"]))
    return {"ffmpeg": av.ffmpeg_version_info, "libavcodec": codec}


def _view(plane: VideoPlane, rows: int, cols: int) -> Plane:
    """The pixels of a plane in place, without the padding at the end of each line."""
    buffer = cast("memoryview", plane)  # planes are buffers, which their annotations do not say
    return np.frombuffer(buffer, np.uint8).reshape(-1, plane.line_size)[:rows, :cols]


class _FramePlanes(Planes):
    """Planes of a frame, copied out of it when somebody first looks: what is only passed costs no copy.

    The copies are contiguous for the kernels, and free of the decoder's own buffers.
    """

    __slots__ = ("_copies", "_frame", "_size")
    _copies: tuple[Plane, Plane, Plane] | None
    _frame: VideoFrame | None
    _size: tuple[int, int]

    def __init__(self, frame: VideoFrame) -> None:
        object.__setattr__(self, "_frame", frame)
        object.__setattr__(self, "_copies", None)
        object.__setattr__(self, "_size", (frame.width, frame.height))

    @property
    def size(self) -> tuple[int, int]:
        return self._size

    def _look(self) -> tuple[Plane, Plane, Plane]:
        frame, copies = self._frame, self._copies  # in this order: the frame is let go of last
        if copies is None:
            assert frame is not None
            y, u, v = (np.ascontiguousarray(_view(part, part.height, part.width)) for part in frame.planes)
            copies = y, u, v
            object.__setattr__(self, "_copies", copies)
            object.__setattr__(self, "_frame", None)
        return copies

    @property
    def y(self) -> Plane:
        return self._look()[0]

    @property
    def u(self) -> Plane:
        return self._look()[1]

    @property
    def v(self) -> Plane:
        return self._look()[2]


def _planes(frame: VideoFrame, label: str) -> Planes:
    if frame.format.name not in ("yuv420p", "yuvj420p"):
        raise StreamError(label, f"pictures of format {frame.format.name}", "yuv420p")
    return _FramePlanes(frame)

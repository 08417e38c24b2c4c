"""Video files out: H.264 in MP4 that plays everywhere."""

from __future__ import annotations

import math
import warnings
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path

import av
import av.error
import cv2
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import (
    ColorPrimaries,
    ColorRange,
    Colorspace,
    ColorTrc,
    Interpolation,
    VideoReformatter,
)
from av.video.stream import VideoStream

from mvcodec.closing import Completing
from mvcodec.errors import MvCodecWarning, OutputError, StreamClosed
from mvcodec.frames import Picture
from mvcodec.output.atomic import replacing

DEFAULT_CRF = 18.0
_EXACT = (
    Interpolation.BICUBIC
    | Interpolation.ACCURATE_RND
    | Interpolation.FULL_CHR_H_INP
    | Interpolation.FULL_CHR_H_INT
)
_MAX_RATE_DENOMINATOR = 1001
_TICKS = 10_000
"""A second's at least: what times are rounded to."""

_STEP_TICKS = 1 << 24
"""From picture to picture at the nominal rate, at most: slower rates have fewer ticks a second."""

_MAX_STEP_TICKS = 1 << 28
"""From picture to picture, as FFmpeg can say it in MP4; longer pauses are shortened to that."""


class Mp4Writer(Completing):
    """Writes pictures of one view as H.264, yuv420p, BT.709 limited range (tagged), in MP4.

    Pictures are shown from their own times on, the first at 0, or at a constant rate where they have none.
    Odd sizes are padded by one column or row, repeated from the last: 4:2:0 has no odd ones.
    The file appears at `path` when the writer is closed; after an error there is none.

    Args:
        path: of the file.
        width, height: of the pictures, px.
        fps: pictures a second.
        crf: constant rate factor of libx264.

    Raises:
        OutputError: the system or FFmpeg refuses.
    """

    def __init__(self, path: Path, width: int, height: int, fps: float, *, crf: float = DEFAULT_CRF) -> None:
        self.path, self._size = path, (width, height)
        self._rate = steady_fraction(fps)
        # A whole number of ticks for a picture of the nominal rate.
        ticks = min(_TICKS, math.ceil(_STEP_TICKS * self._rate))
        self._ticks = self._rate.numerator * math.ceil(ticks / self._rate.numerator)
        self._first_ns = self._last_ticks = 0
        self._told = False
        self._reformatter, self._count, self._closed = VideoReformatter(), 0, False
        with ExitStack() as stack:
            part = stack.enter_context(replacing(path))
            try:
                options = {"movflags": "+faststart", "video_track_timescale": str(self._ticks)}
                self._container = av.open(f"file:{part}", "w", format="mp4", container_options=options)
                stack.callback(self._container.close)
                self._stream = self._add_stream(crf)
            except av.error.FFmpegError as error:
                raise OutputError(path, error.strerror or error) from None
            self._resources = stack.pop_all()

    def _add_stream(self, crf: float) -> VideoStream:
        stream = self._container.add_stream("libx264", rate=self._rate, options={"crf": f"{crf:g}"})
        stream.width, stream.height = (side + side % 2 for side in self._size)
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.time_base = Fraction(1, self._ticks)
        context.colorspace = Colorspace.ITU709
        context.color_range = ColorRange.MPEG
        context.color_primaries = ColorPrimaries.BT709
        context.color_trc = ColorTrc.BT709
        return stream

    def push(self, picture: Picture, time_ns: int | None = None) -> None:
        """Append uint8 (H, W, 3) RGB of the size given at the start.

        Args:
            time_ns: when it was taken, ascending; None: one step of the rate after the one before.

        Raises:
            StreamClosed: after `close`.
            OutputError: another size, or FFmpeg refuses.
        """
        if self._closed:
            raise StreamClosed(f"{self.path} is closed")
        height, width = picture.shape[:2]
        if (width, height) != self._size:
            expected = f"{self._size[0]}x{self._size[1]}"
            raise OutputError(self.path, f"a picture of {width}x{height} px in a video of {expected}")
        rgb = VideoFrame.from_ndarray(_even(picture), "rgb24")
        frame = self._reformatter.reformat(
            rgb,
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            src_color_range=ColorRange.JPEG,
            dst_color_range=ColorRange.MPEG,
            interpolation=_EXACT,
        )
        frame.pts, frame.time_base = self._next_ticks(time_ns), Fraction(1, self._ticks)
        frame.duration = round(self._ticks / self._rate)
        self._count += 1
        self._mux(frame)

    def _next_ticks(self, time_ns: int | None) -> int:
        if not self._count:
            self._first_ns = time_ns or 0
            return 0
        step = round(self._ticks / self._rate)
        if time_ns is not None:
            step = round(Fraction(time_ns - self._first_ns, 10**9) * self._ticks) - self._last_ticks
        if step > _MAX_STEP_TICKS and not self._told:
            self._told = True
            most = _MAX_STEP_TICKS / self._ticks
            text = (
                f"{self.path}: pauses of more than {most:.0f} s become that long, the most that MP4 can say"
            )
            warnings.warn(text, MvCodecWarning, stacklevel=2)
        self._last_ticks += min(max(step, 1), _MAX_STEP_TICKS)
        return self._last_ticks

    def _mux(self, frame: VideoFrame | None) -> None:
        try:
            self._container.mux(self._stream.encode(frame))
        except (av.error.FFmpegError, OSError) as error:
            raise OutputError(self.path, error.strerror or error) from None

    def close(self) -> None:
        """Finish the file and give it its name. A second call does nothing.

        Raises:
            OutputError: no picture was pushed, or the system refuses.
        """
        if not self._closed:
            self._closed = True
            with self._resources:
                if not self._count:
                    raise OutputError(self.path, "a video without a picture")
                self._mux(None)

    def abort(self) -> None:
        """Drop what was written; nothing appears at `path`. After `close` it does nothing."""
        if not self._closed:
            self._closed = True
            error = OutputError(self.path, "given up")
            self._resources.__exit__(type(error), error, None)


def steady_fraction(fps: float) -> Fraction:
    """A frame rate as files say it: 30000/1001 and such are exact, and slow ones are not 0."""
    if fps >= 1:
        return Fraction(fps).limit_denominator(_MAX_RATE_DENOMINATOR)
    return 1 / Fraction(1 / fps).limit_denominator(_MAX_RATE_DENOMINATOR)


def _even(picture: Picture) -> Picture:
    """The picture with its last row and column repeated where a side is odd."""
    height, width = picture.shape[:2]
    if height % 2 or width % 2:
        return np.asarray(
            cv2.copyMakeBorder(picture, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE), np.uint8
        )
    return np.ascontiguousarray(picture)

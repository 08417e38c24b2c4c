"""Video files in: frames of one view as RGB, converted exactly as the stream's tags say."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import av.error
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace, Interpolation, VideoReformatter
from av.video.stream import VideoStream

from mvcodec.capture.picture_files import wrong_size
from mvcodec.errors import InputError
from mvcodec.frames import Picture

# PyAV's default (bilinear, rounded coarsely, chroma at half width) darkens luma by about 2 levels.
_EXACT = (
    Interpolation.BICUBIC
    | Interpolation.ACCURATE_RND
    | Interpolation.FULL_CHR_H_INP
    | Interpolation.FULL_CHR_H_INT
)
# ITU-T H.273 MatrixCoefficients to swscale's names; 2 is "unspecified".
_MATRICES = {
    1: Colorspace.ITU709,
    4: Colorspace.FCC,
    5: Colorspace.ITU601,
    6: Colorspace.ITU601,
    7: Colorspace.SMPTE240M,
    9: Colorspace.BT2020,
}
_FIRST_HD_HEIGHT = 720


class VideoView:
    """The frames of one view in a video file. Opened anew for each pass over it.

    Attributes:
        path: the file.
        size: (width, height), px.
        count: frames in it.
        fps: its frame rate.

    Raises:
        InputError: missing, unreadable, or without a video stream or any frame.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with av.open(str(path)) as container:
                stream = _video_stream(container, path)
                self.size = stream.width, stream.height
                self.fps = float(stream.average_rate or stream.guessed_rate or Fraction(0))
                self.count = stream.frames or sum(packet.size > 0 for packet in container.demux(stream))
        except (av.error.FFmpegError, OSError) as error:
            raise _unreadable(path, error) from None
        if self.count < 1 or min(self.size) < 1:
            raise InputError(path, "no frames", "a video file")

    def pictures(self, frames: range) -> Iterator[Picture]:
        """uint8 (H, W, 3) RGB of consecutive frames, decoded as they are asked for.

        Raises:
            InputError: damaged, shorter than its header says, or changing its size.
        """
        given = 0
        reformatter = VideoReformatter()
        try:
            with av.open(str(self.path)) as container:
                stream = _video_stream(container, self.path)
                # The views are decoded side by side; threads within one would only compete.
                stream.codec_context.thread_count = 1
                for number, frame in enumerate(container.decode(stream)):
                    if number in frames:
                        if (frame.width, frame.height) != self.size:
                            raise wrong_size(self.path, (frame.width, frame.height), self.size)
                        yield frame_to_rgb(frame, reformatter)
                        given += 1
                    if number + 1 >= frames.stop:
                        break
        except (av.error.FFmpegError, OSError) as error:
            raise _unreadable(self.path, error) from None
        if given < len(frames):
            raise InputError(self.path, f"{frames.start + given} frames", f"{frames.stop} frames")


def frame_to_rgb(frame: VideoFrame, reformatter: VideoReformatter) -> Picture:
    """uint8 (H, W, 3) RGB of a decoded frame, by its own matrix and range tags.

    Untagged frames count as BT.709 from 720 lines on, as BT.601 below, limited range.
    """
    guess = Colorspace.ITU709 if frame.height >= _FIRST_HD_HEIGHT else Colorspace.ITU601
    full = frame.color_range == ColorRange.JPEG or frame.format.name.startswith("yuvj")
    rgb = reformatter.reformat(
        frame,
        format="rgb24",
        src_colorspace=_MATRICES.get(int(frame.colorspace), guess),
        src_color_range=ColorRange.JPEG if full else ColorRange.MPEG,
        dst_color_range=ColorRange.JPEG,
        interpolation=_EXACT,
    )
    return np.ascontiguousarray(rgb.to_ndarray(), np.uint8)


def _video_stream(container: av.container.InputContainer, path: Path) -> VideoStream:
    if not container.streams.video:
        raise InputError(path, "no video stream", "a video file")
    return container.streams.video[0]


def _unreadable(path: Path, error: Exception) -> InputError:
    if isinstance(error, FileNotFoundError):
        return InputError(path, "no such file", "a video file")
    reason = getattr(error, "strerror", None) or str(error)
    return InputError(path, f"an unreadable video ({reason})", "a video file")

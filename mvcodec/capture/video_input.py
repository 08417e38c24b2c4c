"""Video files in: frames of one view as RGB, converted exactly as the stream's tags say."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import cast

import av
import av.error
import numpy as np
from av.container import InputContainer
from av.sidedata.sidedata import SideData
from av.sidedata.sidedata import Type as SideDataType
from av.stream import Disposition
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace, Interpolation, VideoReformatter
from av.video.stream import VideoStream

from mvcodec.capture.orientation import UPRIGHT, Orientation, matrix_orientation
from mvcodec.capture.picture_files import wrong_size
from mvcodec.capture.reading import OnUnreadable
from mvcodec.capture.time_gaps import Gaps
from mvcodec.capture.video_times import VideoTimes, read_times, with_data
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
_ALPHA = "how opaque its pixels are is left out"
_HDR = {16: "PQ", 18: "HLG"}
"""ITU-T H.273 TransferCharacteristics of high dynamic range."""


class VideoView:
    """The frames of one view in a video file. Opened anew for each pass over it.

    Args:
        path: the file.
        gaps: what gaps in time are where the codec does not tell, see `behind_gaps`.

    Attributes:
        path: the file.
        size: (width, height) as shown, px.
        count: whole frames that are shown, by the packets and edit lists.
        times_ns: when they are shown, ascending; None where the file has no times.
        early: see ViewReader.
        fps: its frame rate; 0 where nothing says so.
        notes: what is unusual about it, one line each.

    Raises:
        InputError: missing, unreadable, or without a video stream or any frame.
    """

    def __init__(self, path: Path, gaps: Gaps | None = None) -> None:
        self.path = path
        try:
            with _opened(path) as container:
                times = read_times(container, _video_stream(container, path), gaps)
            with _opened(path) as container:
                stream = _video_stream(container, path)
                first = next(container.decode(stream), None) if times.stamps else None
                self.notes = _stated_oddities(container, stream)
        except (av.error.FFmpegError, OSError) as error:
            raise _unreadable(path, error) from None
        if not times.stamps or first is None or min(first.width, first.height) < 1:
            why = "; ".join(f"{count} are left out: {reason}" for reason, count in times.left_out.items())
            raise InputError(path, f"no frames{f' ({why})' * bool(why)}", "a video file")
        self._times = times
        self.count, self.early = len(times.stamps), times.early
        self.times_ns, self.fps = times.times_ns, times.fps
        self._coded_size = first.width, first.height
        self._orientation, notes = _orientation(first)
        self.size = self._orientation.size(*self._coded_size)
        self.notes += notes + unusual(first)
        self.notes += tuple(f"{count} pictures are left out: {why}" for why, count in times.left_out.items())
        if times.set_back:
            self.notes += (
                f"its clock was set back {len(times.set_back)} times, by up to {max(times.set_back):.3f} s:"
                " times go on from there",
            )
        if times.pauses and gaps is None:
            self.notes += (
                f"{times.pauses} gaps in time are taken for those of a variable rate: video of its codec does"
                " not say whether pictures are missing there that later ones build on; if so, `gaps` lost"
                " leaves these out",
            )
        if times.cut_off:
            self.notes += (f"it breaks off after {self.count} pictures ({times.cut_off})",)

    def pictures(self, frames: Sequence[int]) -> Iterator[Picture]:
        """uint8 (H, W, 3) RGB of the frames of these numbers, which ascend, decoded as they are asked for.

        Raises:
            InputError: damaged, shorter than its packets say, or changing its size.
        """
        for picture in self.readable(frames, None):
            assert picture is not None
            yield picture

    def readable(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> Iterator[Picture | None]:
        """See ViewReader."""
        wanted = deque(frames)
        if not wanted:
            return
        reformatter = VideoReformatter()
        try:
            with _opened(self.path) as container:
                stream = _video_stream(container, self.path)
                # The views are decoded side by side; threads within one would only compete.
                stream.codec_context.thread_count = 1
                for number, frame in _numbered(
                    _decoded(container, stream, self._times.numbered), self._times
                ):
                    while wanted and wanted[0] < number:
                        self._tell_unreadable(wanted.popleft(), on_unreadable)
                        yield None
                    if wanted and wanted[0] == number:
                        wanted.popleft()
                        found = frame.width, frame.height
                        if found == self._coded_size:
                            yield self._orientation.apply(frame_to_rgb(frame, reformatter))
                        elif on_unreadable is None:
                            raise wrong_size(self.path, found, self._coded_size)
                        else:
                            on_unreadable(wrong_size(self.path, found, self._coded_size))
                            yield None
                    if not wanted:
                        return
        except (av.error.FFmpegError, OSError) as error:
            raise _unreadable(self.path, error) from None
        while wanted:
            self._tell_unreadable(wanted.popleft(), on_unreadable)
            yield None

    def _tell_unreadable(self, number: int, on_unreadable: OnUnreadable | None) -> None:
        """Tell of a frame that the decoder did not give; raise it where nobody wants to know."""
        known = self.times_ns is not None and number < len(self.times_ns)
        where = f" at {self.times_ns[number] / 1e9:.3f} s" if known and self.times_ns else ""
        found = f"no whole picture {number}{where}, the file is damaged there"
        error = InputError(self.path, found, f"{self.count} pictures")
        if on_unreadable is None:
            raise error
        on_unreadable(error)


def _numbered(frames: Iterator[VideoFrame | None], times: VideoTimes) -> Iterator[tuple[int, VideoFrame]]:
    """Decoded frames with their numbers; without those that are left out."""
    numbers = {stamp: number for number, stamp in enumerate(times.stamps)}
    count = 0
    for frame in frames:
        if frame is None:
            if times.counted:
                return  # how many are missing is unknown
        elif frame.pts in numbers:
            yield count if times.counted else numbers[frame.pts], frame
            count += 1


def _decoded(container: InputContainer, stream: VideoStream, numbered: bool) -> Iterator[VideoFrame | None]:
    """The whole pictures; None for a damaged one, and for what builds on it.

    Args:
        numbered: pictures are called by the numbers of their packets.
    """
    lost = False
    for number, packet in enumerate(with_data(container, stream)):
        if numbered:
            packet.pts = packet.dts = number
        try:
            frames = packet.decode()
        except av.error.FFmpegError:
            lost = True
            yield None
            continue
        for frame in frames:
            lost = frame.is_corrupt or (lost and not frame.key_frame)
            yield None if lost else frame
    if not lost:
        yield from stream.codec_context.decode(None)


def _stated_oddities(container: InputContainer, stream: VideoStream) -> tuple[str, ...]:
    """What a file says of its pictures that is left aside, one line each."""
    notes = []
    ratio = stream.sample_aspect_ratio
    if ratio and ratio != 1:
        notes.append(
            f"its pixels are {ratio.numerator}:{ratio.denominator}, not square: they are taken as they are,"
            " and pictures look squeezed; scale it first"
        )
    if stream.metadata.get("alpha_mode") == "1":
        notes.append(_ALPHA)
    others = [
        each
        for each in container.streams.video
        if each is not stream and not each.disposition & (Disposition.attached_pic | Disposition.still_image)
    ]
    if others:
        notes.append(f"it has {1 + len(others)} videos: the first one is taken, stream {stream.index}")
    return tuple(notes)


def unusual(frame: VideoFrame) -> tuple[str, ...]:
    """What is done to pictures like this one that their owner should know, one line each."""
    notes = []
    if any(component.is_alpha for component in frame.format.components):
        notes.append(_ALPHA)
    if frame.interlaced_frame:
        notes.append("its pictures are interlaced: lines of two moments are mixed; deinterlace it first")
    transfer = int(frame.color_trc)
    if transfer in _HDR:
        notes.append(
            f"its brightness is coded for HDR ({_HDR[transfer]}) and taken as it is: pictures look pale;"
            " convert it to BT.709 first"
        )
    return tuple(notes)


def frame_to_rgb(frame: VideoFrame, reformatter: VideoReformatter) -> Picture:
    """uint8 (H, W, 3) RGB of a decoded frame, by its own matrix and range tags.

    Untagged frames count as BT.709 from 720 lines on, as BT.601 below, limited range; grey ones as full.
    """
    guess = Colorspace.ITU709 if frame.height >= _FIRST_HD_HEIGHT else Colorspace.ITU601
    full = frame.color_range == ColorRange.JPEG or frame.format.name.startswith("yuvj")
    full |= frame.color_range == ColorRange.UNSPECIFIED and frame.format.name.startswith(("gray", "ya"))
    rgb = reformatter.reformat(
        frame,
        format="rgb24",
        src_colorspace=_MATRICES.get(int(frame.colorspace), guess),
        src_color_range=ColorRange.JPEG if full else ColorRange.MPEG,
        dst_color_range=ColorRange.JPEG,
        interpolation=_EXACT,
    )
    return np.ascontiguousarray(rgb.to_ndarray(), np.uint8)


def _orientation(frame: VideoFrame) -> tuple[Orientation, tuple[str, ...]]:
    # PyAV's annotations take it for a mapping of texts.
    sides = cast("Iterable[SideData]", frame.side_data)
    data = next((bytes(side) for side in sides if side.type == SideDataType.DISPLAYMATRIX), None)
    if data is None:
        return UPRIGHT, ()
    found = matrix_orientation(data)
    if found is None:
        return UPRIGHT, (
            f"its rotation by {frame.rotation} degrees is ignored: only quarter turns are applied",
        )
    return found, ()


def _opened(path: Path) -> InputContainer:
    # A name is never an address: "file:" keeps FFmpeg from reading "cam:1.mp4" as a protocol.
    return av.open(f"file:{path}")


def _video_stream(container: InputContainer, path: Path) -> VideoStream:
    """The first stream that is a video: a cover picture is none."""
    for stream in container.streams.video:
        if not stream.disposition & (Disposition.attached_pic | Disposition.still_image):
            return stream
    raise InputError(path, "no video stream", "a video file")


def _unreadable(path: Path, error: Exception) -> InputError:
    if isinstance(error, FileNotFoundError):
        return InputError(path, "no such file", "a video file")
    if path.is_file() and not path.stat().st_size:
        return InputError(path, "an empty file", "a video file")
    reason = getattr(error, "strerror", None) or str(error)
    return InputError(path, f"an unreadable video ({reason})", "a video file")

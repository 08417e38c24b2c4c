"""H.264 by libx264 and FFmpeg's decoder, through PyAV: one picture in, one access unit out."""

from __future__ import annotations

from fractions import Fraction
from typing import cast

import av
import numpy as np
from av.codec.context import Flags
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType, VideoFrame
from av.video.plane import VideoPlane
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from mvcodec.errors import StreamError
from mvcodec.stream import TrackKind
from mvcodec.video.annexb import without_user_data
from mvcodec.video.codec import CodedPicture, Plane, Planes, VideoSettings

# No packet may wait for a later picture: no B-frames, no look-ahead, and no variable frame rate
# (force-cfr), which alone holds one picture back. Keyframes come when the encoder asks for them
# (scenecut off), since all tracks must have theirs together.
_AT_ONCE = (
    "bframes=0:rc-lookahead=0:sync-lookahead=0:force-cfr=1:sliced-threads=0:scenecut=0:"
    "annexb=1:repeat-headers=1:open-gop=0"
)

X264_PARAMS = {
    # Psycho-visual decisions keep grain that differs from view to view and blurs in synthesis;
    # without them luma PSNR costs 5 % fewer bits (BD-rate, shop_v3, QP 27-37).
    TrackKind.TEXTURE: "psy=0",
    TrackKind.DISPARITY: "psy=0:aq-mode=0",
}


def h264_settings(kind: TrackKind) -> str:
    """x264's parameters for a kind of track, beyond preset and rate."""
    return X264_PARAMS[kind]


class H264Encoder:
    """Codes one track with libx264; closed GOPs, SPS and PPS with each keyframe, Annex B."""

    def __init__(self, settings: VideoSettings) -> None:
        self._settings = settings
        fps = Fraction(settings.fps).limit_denominator(1_000_000)
        self._time_base = 1 / fps
        context = VideoCodecContext.create("libx264", "w")
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
        context.options = _options(settings)
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
        # x264 puts its options, 600 bytes of text, into each track's first picture: 1 % of a short
        # file with eight tracks. The header's settings say the same once.
        return [
            CodedPicture(
                without_user_data(bytes(packet)) if packet.is_keyframe else bytes(packet), packet.is_keyframe
            )
            for packet in self._context.encode(frame)
        ]


class H264Decoder:
    """Decodes one track with FFmpeg; damage is an error, never a concealed picture."""

    def __init__(self) -> None:
        context = VideoCodecContext.create("h264", "r")
        context.thread_count = 1
        context.flags |= Flags.low_delay
        context.options = {"err_detect": "explode"}
        self._context = context

    def push(self, data: bytes, label: str) -> list[Planes]:
        """See `VideoDecoder`."""
        try:
            frames = self._context.decode(av.Packet(data)) if data else []
        except FFmpegError as error:
            raise StreamError(
                label, f"a damaged picture ({error.strerror})", "an H.264 access unit"
            ) from None
        if any(frame.is_corrupt for frame in frames):
            raise StreamError(label, "a damaged picture", "an H.264 access unit")
        return [_planes(frame, label) for frame in frames]

    def flush(self) -> list[Planes]:
        """See `VideoDecoder`."""
        return [_planes(frame, "end of stream") for frame in self._context.decode(None)]


def _options(settings: VideoSettings) -> dict[str, str]:
    rate = settings.rate
    options = {
        "preset": settings.preset,
        "forced-idr": "1",
        "x264-params": f"{_AT_ONCE}:keyint={settings.gop}:{X264_PARAMS[settings.kind]}",
    }
    if rate.qp is not None:
        options["qp"] = str(rate.qp)
    elif rate.crf is not None:
        options["crf"] = f"{rate.crf:g}"
    elif rate.bitrate_kbps is not None:
        options["b"] = str(round(rate.bitrate_kbps * 1000))
    return options


def _view(plane: VideoPlane, rows: int, cols: int) -> Plane:
    """The pixels of a plane in place, without the padding at the end of each line."""
    buffer = cast("memoryview", plane)  # planes are buffers, which their annotations do not say
    return np.frombuffer(buffer, np.uint8).reshape(-1, plane.line_size)[:rows, :cols]


def _planes(frame: VideoFrame, label: str) -> Planes:
    if frame.format.name not in ("yuv420p", "yuvj420p"):
        raise StreamError(label, f"pictures of format {frame.format.name}", "yuv420p")
    # Copies: contiguous for the kernels, and free of the decoder's own buffers.
    y, u, v = (np.ascontiguousarray(_view(plane, plane.height, plane.width)) for plane in frame.planes)
    return Planes(y, u, v)

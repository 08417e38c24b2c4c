"""When the pictures of a video file are shown, by its packets and edit lists; nothing is decoded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from av.bitstream import BitStreamFilterContext
from av.container import InputContainer
from av.format import Flags
from av.packet import Packet
from av.video.stream import VideoStream

from mvcodec.capture.timing import on_grid, rate_of_times, steady_rate
from mvcodec.capture.whole_pictures import NOT_STARTED, WholePictures

_TIMELESS = frozenset({"h264", "hevc", "m4v", "mpegvideo", "mjpeg", "obu", "vvc", "cavsvideo", "dirac"})
"""Streams of pictures alone; what FFmpeg gives as their times is made up."""

_BY_DECODING_TIME = frozenset({"avi"})
"""Containers without presentation times: FFmpeg's are a picture late."""

_ANNEX_B = {"h264": "h264_mp4toannexb", "hevc": "hevc_mp4toannexb"}


@dataclass(frozen=True, slots=True)
class VideoTimes:
    """The pictures of a video file that are whole, in the order of their time.

    Attributes:
        stamps: what the decoder will call them (pts); empty where the container has none, and they come
            in order.
        times_ns: when they are shown, ascending; None where the container has no times.
        count: pictures.
        fps: pictures a second; 0 where nothing says so.
        left_out: how many pictures are left out, by the reason.
    """

    stamps: tuple[int, ...]
    times_ns: tuple[int, ...] | None
    count: int
    fps: float
    left_out: dict[str, int]


@dataclass(frozen=True, slots=True)
class _Shown:
    """A packet whose picture is whole."""

    pts: int | None
    dts: int | None


def read_times(container: InputContainer, stream: VideoStream) -> VideoTimes:
    """Go through the packets of an opened file once.

    Raises:
        av.error.FFmpegError: it is damaged.
    """
    left_out: dict[str, int] = {}
    shown = list(_whole(container, stream, left_out))
    stamps = [item.pts for item in shown if item.pts is not None]
    timeless = Flags.no_timestamps in Flags(container.format.flags) or container.format.name in _TIMELESS
    if timeless or not shown or len(set(stamps)) < len(shown):
        return VideoTimes((), None, len(shown), _stated_rate(stream), left_out)
    stamps.sort()
    assert stream.time_base is not None
    unit_ns = float(stream.time_base * 10**9)
    ticks = stamps
    if container.format.name in _BY_DECODING_TIME:
        ticks = sorted(item.dts for item in shown if item.dts is not None)
        ticks = ticks if len(ticks) == len(stamps) else stamps
    times = tuple(round(tick * stream.time_base * 10**9) for tick in ticks)
    stated = [Fraction(r) for r in (stream.guessed_rate, stream.average_rate, stream.base_rate) if r]
    rate = steady_rate(times, unit_ns, stated)
    if rate is not None:
        times = on_grid(times, rate, unit_ns)
    fps = float(rate) if rate is not None else rate_of_times(times) or _stated_rate(stream)
    return VideoTimes(tuple(stamps), times, len(shown), fps, left_out)


def _whole(container: InputContainer, stream: VideoStream, left_out: dict[str, int]) -> Iterator[_Shown]:
    """The packets, in coding order, whose pictures are shown and are whole; counts the others."""
    name = stream.codec_context.name
    whole = WholePictures(name)
    plain = BitStreamFilterContext(_ANNEX_B[name], stream) if name in _ANNEX_B else None
    started, first = False, None
    for packet in container.demux(stream):
        if not packet.size:
            continue
        pts, dts, discard = packet.pts, packet.dts, packet.is_discard
        started = started or packet.is_keyframe
        first = pts if first is None and started else first
        why = _reason(packet, plain, whole)
        if why is None and (not started or (pts is not None and first is not None and pts < first)):
            # Pictures that are shown before the first keyframe build on what came before it.
            why = NOT_STARTED
        if why is not None:
            left_out[why] = left_out.get(why, 0) + 1
        elif not discard:
            yield _Shown(pts, dts)


def _reason(
    packet: Packet[VideoStream], plain: BitStreamFilterContext | None, whole: WholePictures
) -> str | None:
    """Why a packet gives no whole picture. The filter takes the packet's data away."""
    pts = packet.pts
    units = [packet] if plain is None else plain.filter(packet)
    return whole.push(b"".join(bytes(unit) for unit in units), pts)[0]


def _stated_rate(stream: VideoStream) -> float:
    return float(stream.guessed_rate or stream.average_rate or 0)

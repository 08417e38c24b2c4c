"""When the pictures of a video file are shown, by its packets and edit lists; nothing is decoded."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from av.container import InputContainer
from av.format import Flags
from av.packet import Packet
from av.video.stream import VideoStream

from mvcodec.capture.timing import on_grid, rate_of_times, steady_rate

_TIMELESS = frozenset({"h264", "hevc", "m4v", "mpegvideo", "mjpeg", "obu", "vvc", "cavsvideo", "dirac"})
"""Streams of pictures alone; what FFmpeg gives as their times is made up."""

_BY_DECODING_TIME = frozenset({"avi"})
"""Containers without presentation times: FFmpeg's are a picture late."""


@dataclass(frozen=True, slots=True)
class VideoTimes:
    """The pictures of a video file that can be shown, in the order of their time.

    Attributes:
        stamps: what the decoder will call them (pts); empty where the container has none, and they come
            in order.
        times_ns: when they are shown, ascending; None where the container has no times.
        count: pictures.
        fps: pictures a second; 0 where nothing says so.
        late: pictures left out, since they come before the first keyframe.
    """

    stamps: tuple[int, ...]
    times_ns: tuple[int, ...] | None
    count: int
    fps: float
    late: int


def read_times(container: InputContainer, stream: VideoStream) -> VideoTimes:
    """Go through the packets of an opened file once.

    Raises:
        av.error.FFmpegError: it is damaged.
    """
    packets = [packet for packet in container.demux(stream) if packet.size]
    first = next((number for number, packet in enumerate(packets) if packet.is_keyframe), 0)
    shown = [
        packet
        for packet in packets[first:]
        if not packet.is_discard and _can_be_shown(packet, packets[first])
    ]
    late = len(packets) - len(shown) - sum(packet.is_discard for packet in packets[first:])
    stamps = [packet.pts for packet in shown if packet.pts is not None]
    timeless = Flags.no_timestamps in Flags(container.format.flags) or container.format.name in _TIMELESS
    if timeless or not shown or len(set(stamps)) < len(shown):
        return VideoTimes((), None, len(shown), _stated_rate(stream), late)
    stamps.sort()
    assert stream.time_base is not None
    unit_ns = float(stream.time_base * 10**9)
    ticks = stamps
    if container.format.name in _BY_DECODING_TIME:
        ticks = sorted(packet.dts for packet in shown if packet.dts is not None)
        ticks = ticks if len(ticks) == len(stamps) else stamps
    times = tuple(round(tick * stream.time_base * 10**9) for tick in ticks)
    stated = [Fraction(r) for r in (stream.guessed_rate, stream.average_rate, stream.base_rate) if r]
    rate = steady_rate(times, unit_ns, stated)
    if rate is not None:
        times = on_grid(times, rate, unit_ns)
    fps = float(rate) if rate is not None else rate_of_times(times) or _stated_rate(stream)
    return VideoTimes(tuple(stamps), times, len(shown), fps, late)


def _can_be_shown(packet: Packet[VideoStream], keyframe: Packet[VideoStream]) -> bool:
    """Whether it does not build on what came before the first keyframe, as pictures shown before it do."""
    return packet.pts is None or keyframe.pts is None or packet.pts >= keyframe.pts


def _stated_rate(stream: VideoStream) -> float:
    return float(stream.guessed_rate or stream.average_rate or 0)

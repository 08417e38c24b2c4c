"""When the pictures of a video file are shown, by its packets and edit lists; nothing is decoded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial

from av.bitstream import BitStreamFilterContext
from av.container import InputContainer
from av.error import FFmpegError
from av.format import Flags
from av.packet import Packet
from av.video.stream import VideoStream

from mvcodec.capture.pairing import typical_step_ns
from mvcodec.capture.time_gaps import BEHIND_GAP, Gaps, TimedPacket, behind_gaps
from mvcodec.capture.timing import on_grid, rate_of_times, steady_rate
from mvcodec.capture.whole_pictures import BUILDS_ON_LOSS, NOT_STARTED, WholePictures

_TIMELESS = frozenset({"h264", "hevc", "m4v", "mpegvideo", "mjpeg", "obu", "vvc", "cavsvideo", "dirac"})
"""Streams of pictures alone; what FFmpeg gives as their times is made up."""

_BY_DECODING_TIME = frozenset({"avi"})
"""Containers without presentation times: FFmpeg's are a picture late."""

_BESIDE_GAP = "an AVI file with B-pictures does not say when those beside a gap are shown"
_DAMAGED = "damaged"
_ENCRYPTED = "they are encrypted"
_SAME_TIME = "they have the time of the picture before"
_UNKNOWN_TIME = "how many pictures are missing before them is unknown, since the stream has no times"

_MS = 1_000_000

_SET_BACK_S = Fraction(1, 4)
"""A time of decoding that is earlier than the one before by more is a clock that was set, as where files
were joined."""

_TELL_LOSSES = frozenset({"h264", "hevc", "av1"})
"""Codecs whose pictures say when what they build on is missing."""

_STATE_DURATIONS = frozenset({"gif", "apng", "webp"})
"""Codecs of animations, each of whose pictures says how long it stands: none is missing."""

_STILL_BRAND = "avif"
"""Of a file with a still picture, which a video's rules do not hold for."""

_PLAIN = {"h264": "h264_mp4toannexb", "hevc": "hevc_mp4toannexb", "av1": "av1_metadata"}
"""Filters that bring packets into the form of streams: NAL units with start codes, OBUs with sizes."""


@dataclass(frozen=True, slots=True)
class VideoTimes:
    """The pictures of a video file that are whole, in the order of their time.

    Attributes:
        stamps: what the decoder will call them (pts), or the numbers of their packets, ascending.
        numbered: stamps are numbers of packets.
        counted: pictures come in the order of their time, but not in that of their packets.
        times_ns: when they are shown, ascending; None where the container has no times.
        early: pictures before the first whole one, where there are no times.
        fps: pictures a second; 0 where nothing says so.
        left_out: how many pictures are left out, by the reason.
        cut_off: why the file could not be read to its end; empty where it could.
        set_back: by how many seconds the file's clock was set back, each time; times go on from there.
        pauses: gaps in time that are taken for pauses, though their codec does not tell.
    """

    stamps: tuple[int, ...]
    numbered: bool
    counted: bool
    times_ns: tuple[int, ...] | None
    early: int
    fps: float
    left_out: Mapping[str, int]
    cut_off: str = ""
    pauses: int = 0
    set_back: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class _Packet:
    """A packet in coding order; `why` says why its picture is not whole."""

    number: int
    pts: int | None
    dts: int | None
    keyframe: bool
    why: str | None


def read_times(container: InputContainer, stream: VideoStream, gaps: Gaps | None = None) -> VideoTimes:
    """Go through the packets of an opened file once.

    Args:
        gaps: what gaps in time are where the codec does not tell; None: lost pictures where they are rare.

    Raises:
        av.error.FFmpegError: it is damaged.
    """
    broken: list[str] = []
    set_back: list[float] = []
    packets = list(_packets(container, stream, broken.append, set_back.append))
    by_order = container.format.name in _BY_DECODING_TIME
    timeless = Flags.no_timestamps in Flags(container.format.flags) or container.format.name in _TIMELESS
    timeless |= any(packet.pts is None for packet in packets if packet.why is None)
    reordered = bool(stream.codec_context.has_b_frames)
    codec, pauses = stream.codec_context.codec.canonical_name, 0
    if codec not in _TELL_LOSSES | _STATE_DURATIONS and not timeless and not (by_order and reordered):
        packets, pauses = _gaps_judged(packets, by_order, reordered, gaps)
    left_out = Counter(packet.why for packet in packets if packet.why is not None)
    found = partial(
        VideoTimes,
        numbered=timeless or by_order,
        counted=(timeless or by_order) and reordered,
        early=left_out[NOT_STARTED] if timeless else 0,
        left_out=left_out,
        cut_off="".join(broken),
        pauses=pauses,
        set_back=tuple(set_back),
    )
    if timeless or by_order:
        whole = _placed(packets, reordered, timeless, left_out)
        numbers = tuple(packet.number for packet in whole)
        ticks = sorted({packet.dts for packet in whole if packet.dts is not None})
        if timeless or len(ticks) < len(whole):
            return found(stamps=numbers, times_ns=None, fps=_stated_rate(stream))
        times, fps = _times(ticks, stream)
        return found(stamps=numbers, times_ns=times, fps=fps)
    shown = [packet.pts for packet in packets if packet.why is None]
    stamps = sorted({stamp for stamp in shown if stamp is not None})
    if len(stamps) < len(shown):
        left_out[_SAME_TIME] = len(shown) - len(stamps)
    times, fps = _times(stamps, stream)
    return found(stamps=tuple(stamps), times_ns=times, fps=fps)


def _gaps_judged(
    packets: Sequence[_Packet], by_order: bool, reordered: bool, gaps: Gaps | None
) -> tuple[list[_Packet], int]:
    """The packets, where those behind gaps say so; and the gaps that are taken for pauses.

    Args:
        by_order: times of decoding count.
    """
    whole = [packet for packet in packets if packet.why is None]
    times = [packet.dts if by_order else packet.pts for packet in whole]
    timed = [TimedPacket(t or 0, packet.keyframe) for t, packet in zip(times, whole, strict=True)]
    unsure, pauses = behind_gaps(timed, reordered, gaps)
    numbers = {whole[place].number for place in unsure}
    return [replace(p, why=BEHIND_GAP) if p.number in numbers else p for p in packets], pauses


def _times(ticks: Sequence[int], stream: VideoStream) -> tuple[tuple[int, ...], float]:
    """Times in ns and the frame rate, of times in the stream's unit."""
    if not ticks:
        return (), 0.0
    assert stream.time_base is not None
    times = tuple(round(tick * stream.time_base * 10**9) for tick in ticks)
    unit_ns = float(stream.time_base * 10**9)
    if all(time % _MS == 0 for time in times):
        unit_ns = max(unit_ns, float(_MS))  # a container that counts milliseconds was there before this one
    stated = [Fraction(r) for r in (stream.guessed_rate, stream.average_rate, stream.base_rate) if r]
    rate = steady_rate(times, unit_ns, stated)
    if rate is None:
        return times, rate_of_times(times) or _stated_rate(stream)
    return on_grid(times, rate, unit_ns), float(rate)


def _placed(
    packets: Sequence[_Packet], reordered: bool, timeless: bool, left_out: Counter[str]
) -> list[_Packet]:
    """The whole pictures whose place in time is certain, though only the order of packets tells it.

    Args:
        reordered: pictures are shown in another order than coded: what is missing moves all of its GOP.
        timeless: what is missing moves all that follows.
        left_out: counts the others.
    """
    placed: list[_Packet] = []
    group: list[_Packet] = []
    lost = gap = False
    step = 0 if timeless else typical_step_ns([packet.dts or 0 for packet in packets])
    before: int | None = None
    for packet in packets:
        if packet.keyframe:
            placed += group
            group, gap = [], False
        if reordered and step and before is not None and (packet.dts or 0) - before > step:
            left_out[_BESIDE_GAP] += len(group)
            group, gap = [], not packet.keyframe
        before = packet.dts
        if packet.why not in (None, NOT_STARTED):
            lost = True
            if reordered:
                left_out[BUILDS_ON_LOSS] += len(group)
                group = []
        elif packet.why is None and (gap or (lost and timeless)):
            left_out[_BESIDE_GAP if gap else _UNKNOWN_TIME] += 1
        elif packet.why is None:
            group.append(packet)
    return placed + group


def _packets(
    container: InputContainer,
    stream: VideoStream,
    cut_off: Callable[[str], None],
    set_back: Callable[[float], None],
) -> Iterator[_Packet]:
    """The packets whose pictures are shown, in coding order."""
    name = stream.codec_context.codec.canonical_name
    if container.metadata.get("major_brand") == _STILL_BRAND:
        name = ""  # one picture, which nothing comes before
    whole = WholePictures(name)
    plain = BitStreamFilterContext(_PLAIN[name], stream) if name in _PLAIN else None
    started, first = False, None
    held: _Packet | None = None
    found_loss = False
    # In MPEG-TS FFmpeg may find a loss a picture earlier or later than it was.
    exact = container.format.name != "mpegts"
    for number, packet in enumerate(with_data(container, stream, cut_off, set_back)):
        pts, dts, discard, keyframe = packet.pts, packet.dts, packet.is_discard, packet.is_keyframe
        started = started or keyframe
        first = pts if first is None and started else first
        found_before, found_loss = found_loss and not exact, packet.is_corrupt
        if held is not None:
            yield replace(held, why=held.why or _DAMAGED) if found_loss and not exact else held
        why = _reason(packet, plain, whole, lost=found_loss or found_before)
        if why is None and (not started or (pts is not None and first is not None and pts < first)):
            # Pictures that are shown before the first keyframe build on what came before it.
            why = NOT_STARTED
        held = _Packet(number, pts, dts, keyframe, why) if why is not None or not discard else None
    if held is not None:
        yield held


def with_data(
    container: InputContainer,
    stream: VideoStream,
    cut_off: Callable[[str], None] = lambda _why: None,
    set_back: Callable[[float], None] = lambda _seconds: None,
) -> Iterator[Packet[VideoStream]]:
    """The packets that hold something: their places are their numbers.

    Args:
        cut_off: told why a file cannot be read to its end, where it has a beginning.
        set_back: told by how many seconds, each time that the clock is set back; times go on from there.
    """
    count = shift = 0
    last: int | None = None
    latest = 0
    try:
        for packet in container.demux(stream):
            if not packet.size:
                continue
            if packet.dts is not None:
                assert packet.time_base is not None
                if last is not None and packet.dts + shift < last - _SET_BACK_S / packet.time_base:
                    set_back(float((last - shift - packet.dts) * packet.time_base))
                    shift = latest + max(packet.duration or 0, 1) - packet.dts
                last = packet.dts = packet.dts + shift
            if packet.pts is not None:
                packet.pts += shift
            latest = max(latest, last or 0, packet.pts or 0)
            yield packet
            count += 1
    except FFmpegError as error:
        if not count:
            raise
        cut_off(error.strerror or "damaged")


def _reason(
    packet: Packet[VideoStream], plain: BitStreamFilterContext | None, whole: WholePictures, lost: bool
) -> str | None:
    """Why a packet gives no whole picture. The filter takes the packet's data away.

    Args:
        lost: part of it was lost on the way.
    """
    pts = packet.pts
    if lost:
        whole.lose(BUILDS_ON_LOSS)
        return _DAMAGED
    if packet.has_sidedata("encryption_info"):
        whole.lose(BUILDS_ON_LOSS)
        return _ENCRYPTED
    try:
        units = [packet] if plain is None else plain.filter(packet)
    except FFmpegError:
        whole.lose(BUILDS_ON_LOSS)
        return _DAMAGED
    return whole.push(b"".join(bytes(unit) for unit in units), pts)[0]


def _stated_rate(stream: VideoStream) -> float:
    return float(stream.guessed_rate or stream.average_rate or 0)

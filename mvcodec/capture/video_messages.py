"""Messages with access units of a video -> whole pictures in the order of their time."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterator
from typing import cast

import av
from av.codec.context import Flags
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from mvcodec.capture.picture_messages import MAX_PIXELS
from mvcodec.capture.time_gaps import BEHIND_GAP, Gaps, GapWatch
from mvcodec.capture.video_input import unusual
from mvcodec.capture.whole_pictures import WholePictures
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.errors import InputError, MvCodecWarning

_CODECS = {"h264": "h264", "h265": "hevc", "hevc": "hevc", "vp9": "vp9", "av1": "av1"}
"""A message's word for a codec -> ours."""

_LIBRARIES = {"h264": "h264", "hevc": "hevc", "vp9": "vp9", "av1": "libdav1d"}

_MAY_REPEAT = ("vp9", "av1")
"""Codecs in which pictures of what stands still may be the same bytes."""

_UNNUMBERED = ("vp9",)
"""Codecs whose pictures don't tell whether one before them is missing."""

_NAL_CODECS, _START_CODE = ("h264", "hevc"), b"\0\0\1"

_RECENT = 4
"""Messages among which a repeated one is looked for."""

_MAX_HEAD_BYTES = 1 << 16
"""Parameter sets that came in messages of their own."""

ShownPicture = tuple[RecordedPicture, VideoFrame]


class LeftOut(Exception):
    """A message whose picture is left out; says why."""


class VideoDecoder:
    """Decodes the messages of one topic, in the order in which they were sent.

    A picture comes out as soon as no later message can bring one that is shown before it.

    Args:
        name: of the recording, for messages.
        gaps: what gaps in time are where the codec does not tell; None: lost pictures where they are rare.
    """

    def __init__(self, name: str, gaps: Gaps | None = None) -> None:
        self._name, self._gaps, self._gap_watch = name, gaps, GapWatch(gaps)
        self._codec = ""
        self._whole = WholePictures("")
        self._context: VideoCodecContext | None = None
        self._sent: dict[int, RecordedPicture] = {}
        self._count = 0
        self._recent: deque[tuple[bytes, int]] = deque(maxlen=_RECENT)
        self._head = b""
        self._lost = self._left_out = False
        self._told: set[str] = set()

    def push(self, message: RecordedPicture) -> list[ShownPicture]:
        """The pictures that are known to be next, each with its own message.

        Raises:
            LeftOut: it has no whole picture.
            InputError: a codec that mvcodec doesn't know, or damage.
        """
        codec = _CODECS.get(message.format.lower())
        if codec is None:
            found = f"video of format {message.format!r}, which is not supported"
            raise self._error(message, found, ", ".join(_CODECS))
        key = message.data, message.stamp_ns if codec in _MAY_REPEAT else 0
        if key in self._recent:
            raise LeftOut("it is a duplicate")
        self._recent.append(key)
        if codec != self._codec:
            self._codec, self._whole, self._context = codec, WholePictures(codec), None
            self._gap_watch = GapWatch(self._gaps)
        if codec in _UNNUMBERED and self._gap_watch.push(message.time_ns):
            self.lose(BEHIND_GAP)
        data = self._head + message.data
        why, unit = self._whole.push(data, message.time_ns)
        if unit is not None and not unit.pictures:
            if codec in _NAL_CODECS and _START_CODE not in data:
                raise LeftOut("it has no start codes, as video in Annex B form has")
            self._head = data[:_MAX_HEAD_BYTES]
            return []
        self._head = b""
        if why is not None:
            self._left_out = True
            raise LeftOut(why)
        shown: list[ShownPicture] = []
        if self._left_out and self._context is not None:
            # What is shown after a loss must not build on what was there before it.
            shown = self.flush()
        self._left_out = False
        if unit is not None and unit.sequences and self._context is None:
            self._context = self._new_context(delays=unit.sequences[-1].reordered is not None)
        if self._context is None:
            self._context = self._new_context(delays=True)
        self._sent[self._count] = message
        packet = cast("av.Packet[VideoStream]", av.Packet(data))
        packet.pts = packet.dts = self._count
        self._count += 1
        return shown + self._decode(self._context, packet, message)

    def lose(self, why: str) -> None:
        """A message never came, or not whole: what builds on it is left out, up to the next keyframe."""
        self._whole.lose(why)
        self._left_out = True

    def flush(self) -> list[ShownPicture]:
        """The pictures that are left inside."""
        context, self._context = self._context, None
        if context is None:
            return []
        shown = list(self._shown(context.decode(None)))
        self._sent.clear()
        return shown

    def _new_context(self, delays: bool) -> VideoCodecContext:
        context = cast("VideoCodecContext", av.CodecContext.create(_LIBRARIES[self._codec], "r"))
        context.thread_count = 1
        if not delays:
            context.flags |= Flags.low_delay
        context.options = {"max_pixels": str(MAX_PIXELS)}
        self._lost = False
        return context

    def _decode(
        self, context: VideoCodecContext, packet: av.Packet[VideoStream], message: RecordedPicture
    ) -> list[ShownPicture]:
        try:
            return list(self._shown(context.decode(packet)))
        except FFmpegError as error:
            self._lost = True
            self._whole.lose("it builds on a damaged picture")
            raise self._error(message, f"a damaged picture ({error.strerror})", self._codec) from None

    def _shown(self, frames: list[VideoFrame]) -> Iterator[ShownPicture]:
        for frame in frames:
            message = self._sent.pop(cast("int", frame.pts), None)
            self._lost = frame.is_corrupt or (self._lost and not frame.key_frame)
            if message is None:
                continue
            if self._lost:
                self._whole.lose("it builds on a damaged picture")
                raise self._error(message, "a damaged picture", self._codec)
            for note in unusual(frame):
                self._tell_once(f"{message.topic}: {note}")
            yield message, frame

    def _tell_once(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            warnings.warn(f"{self._name}: {text}", MvCodecWarning, stacklevel=5)

    def _error(self, message: RecordedPicture, found: str, expected: str) -> InputError:
        return InputError(f"{self._name}: {message.label}", found, expected)

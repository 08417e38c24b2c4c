"""The pictures of one topic of a recording, each with its time, ready to be put together with others."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from av.video.reformatter import VideoReformatter

from mvcodec.capture.message_clock import SET_BACK_NS, MessageClock
from mvcodec.capture.picture_messages import StillDecoder
from mvcodec.capture.recorded_maps import DepthDecoder, Depths
from mvcodec.capture.stamp_check import Judged, StampCheck
from mvcodec.capture.time_gaps import Gaps
from mvcodec.capture.video_input import frame_to_rgb
from mvcodec.capture.video_messages import LeftOut, ShownPicture, VideoDecoder
from mvcodec.container.recorded_pictures import RecordedPicture
from mvcodec.frames import Picture

REORDERED = 8
"""Still pictures among which those whose stamps are out of order are put in order."""

WRONG_STAMP = "its time is far from those before and after it"
NOT_AFTER = "its time is not after the one before"


@dataclass(frozen=True, slots=True, eq=False)
class WaitingPicture:
    """A picture that waits for the other cameras'.

    Attributes:
        time_ns: when it was taken.
        message: where it came from.
        size: bytes of memory.
        decode: uint8 (H, W, 3) RGB of it, or its depth (see `DepthDecoder`); raises InputError.
    """

    time_ns: int
    message: RecordedPicture
    size: int
    decode: Callable[[], Picture | Depths]


class TopicPictures:
    """Takes the messages of one topic.

    Args:
        name: of the recording, for messages.
        clock: of the recording.
        offset_ns: what is added to the topic's times.
        stills: decodes its still pictures, or its depth.
        settled: the recording can be looked ahead in: still pictures are put in order of their stamps.
        leave_out: told of messages whose picture is left out, and why.
        gaps: what gaps in time are where the codec does not tell; None: lost pictures where they are rare.
    """

    def __init__(
        self,
        name: str,
        clock: MessageClock,
        offset_ns: int,
        stills: StillDecoder | DepthDecoder,
        settled: bool,
        leave_out: Callable[[RecordedPicture, str], None],
        gaps: Gaps | None = None,
    ) -> None:
        self._clock, self._offset_ns, self._leave_out = clock, offset_ns, leave_out
        self._ahead = REORDERED if settled else 0
        self._video, self.stills = VideoDecoder(name, gaps), stills
        self._reformatter = VideoReformatter()
        self._early: list[tuple[int, int, RecordedPicture]] = []
        self._count = 0
        self._check = StampCheck(settled)
        self._wrong: set[RecordedPicture] = set()
        self._set: set[RecordedPicture] = set()

    def push(self, message: RecordedPicture) -> list[WaitingPicture]:
        """The pictures that are next, in the order of their time.

        Raises:
            InputError: damaged, or of a format that mvcodec doesn't know.
        """
        return self._judged(self._check.push(message))

    def flush(self) -> list[WaitingPicture]:
        """The pictures that are left inside.

        Raises:
            InputError: damaged, or of a format that mvcodec doesn't know.
        """
        found = self._judged(self._check.flush())
        return found + self._videos(self._video.flush()) + self._stills(0)

    def _judged(self, messages: list[Judged]) -> list[WaitingPicture]:
        found = []
        for message, verdict in messages:
            if verdict == "set":
                self._set.add(message)
            if message.kind == "video":
                if verdict == "wrong":
                    self._wrong.add(message)  # others build on it
                found += self._decoded(message)
            elif verdict == "wrong":
                self._leave_out(message, WRONG_STAMP)
            else:
                found += self._sorted(message)
        return found

    def _decoded(self, message: RecordedPicture) -> list[WaitingPicture]:
        try:
            return self._videos(self._video.push(message))
        except LeftOut as reason:
            self._leave_out(message, str(reason))
            return []

    def _sorted(self, message: RecordedPicture) -> list[WaitingPicture]:
        set_back = bool(self._early) and self._early[0][0] - message.time_ns >= SET_BACK_NS
        found = self._stills(0) if set_back else []
        heapq.heappush(self._early, (message.time_ns, self._count, message))
        self._count += 1
        return found + self._stills(self._ahead)

    def _videos(self, shown: list[ShownPicture]) -> list[WaitingPicture]:
        found = []
        for message, frame in shown:
            if (time_ns := self._time(message)) is not None:
                size = sum(plane.buffer_size for plane in frame.planes)
                decode = partial(frame_to_rgb, frame, self._reformatter)
                found.append(WaitingPicture(time_ns, message, size, decode))
        return found

    def _stills(self, keep: int) -> list[WaitingPicture]:
        found = []
        while len(self._early) > keep:
            _, _, message = heapq.heappop(self._early)
            if (time_ns := self._time(message)) is not None:
                decode = partial(self.stills.decode, message)
                found.append(WaitingPicture(time_ns, message, len(message.data), decode))
        return found

    def _time(self, message: RecordedPicture) -> int | None:
        if message in self._wrong:
            self._wrong.discard(message)
            self._leave_out(message, WRONG_STAMP)
            return None
        time_ns = self._clock.time_of(message, message in self._set)
        self._set.discard(message)
        if time_ns is None:
            self._leave_out(message, NOT_AFTER)
            return None
        return time_ns + self._offset_ns

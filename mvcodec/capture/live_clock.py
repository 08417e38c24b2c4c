"""Times of live pictures: the sender's stamps, and what their arrival says about the sender's clock."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence

from mvcodec.container.recorded_pictures import Clock

_WINDOW = 1000
"""Pictures after which an early arrival is forgotten, since the sender's clock runs at a speed of its own."""

HELD_BACK = 2
"""Pictures inside FFmpeg: its demuxer and its parser know the end of one by the start of the next."""

AGREE_NS = 2_000_000_000
"""Clocks of senders that are no further apart are taken as one; a network and its buffers delay by less."""


class ArrivalClock:
    """Follows the least delay between a picture's stamp and its arrival.

    The least one: what comes later was delayed on the way, which says nothing of when it was taken.

    Args:
        held_back: pictures that come when the next ones begin, as `HELD_BACK` says. Where a connection
            ends they come at once, that much sooner than all before them, so that the last ones never count.
    """

    def __init__(self, held_back: int = 0) -> None:
        self.began_s = time.monotonic()
        self._held_back = held_back
        self._delays: deque[int] = deque()
        self._count = 0
        self._now: int | None = None
        self._before: int | None = None

    def push(self, stamp_ns: int, arrival_ns: int) -> None:
        """Take a picture into account."""
        self._delays.append(arrival_ns - stamp_ns)
        if len(self._delays) <= self._held_back:
            return
        if self._count % _WINDOW == 0:
            self._before, self._now = self._now, None
        self._count += 1
        delay = self._delays.popleft()
        self._now = delay if self._now is None else min(self._now, delay)

    @property
    def shift_ns(self) -> int | None:
        """What makes a time of day of a stamp; None before the first picture that counts."""
        known = [delay for delay in (self._now, self._before) if delay is not None]
        return min(known, default=None)


class SharedShifts:
    """What is added to the stamps of several senders so that they are on one clock.

    Args:
        clock: the senders' stamps, or arrival; None: stamps where they seem to be of one clock.

    Attributes:
        by_stamp: the senders' stamps count as they are, known after `begin`.
    """

    def __init__(self, clock: Clock | None) -> None:
        self._clock, self.by_stamp = clock, False
        self._now: list[int] = []
        self._begun: list[int] = []

    def begin(self, found_ns: Sequence[int]) -> None:
        """Connections are new: `found_ns` is what arrivals say of each sender, ns."""
        self.by_stamp = self._clock == "stamp" or (self._clock is None and common_clock(found_ns))
        self._begun = list(found_ns)
        self.follow(found_ns)

    def follow(self, found_ns: Sequence[int]) -> None:
        """Senders' clocks run at speeds of their own: arrivals say something else after a while."""
        self._now = list(found_ns)

    def of(self, sender: int) -> int:
        """What is added to the stamps of a sender, ns."""
        return min(self._begun) if self.by_stamp else self._now[sender]

    def drift_ns(self) -> int:
        """How far the senders' clocks went apart since the connections began."""
        moved = [now - begun for now, begun in zip(self._now, self._begun, strict=True)]
        return max(moved) - min(moved)


def common_clock(shifts_ns: Sequence[int]) -> bool:
    """Whether several senders stamp by one clock, as far as arrivals tell."""
    return max(shifts_ns) - min(shifts_ns) <= AGREE_NS

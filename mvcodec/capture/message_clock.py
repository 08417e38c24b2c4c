"""When the pictures of a recording were taken, told from clocks that may differ, jump and stand still."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median

from mvcodec.container.recorded_pictures import Clock, RecordedPicture
from mvcodec.errors import MvCodecWarning

SET_BACK_NS = 1_000_000_000
"""A time that is earlier than the one before by more than that is a clock that was set; by less, disorder."""

_SAME_SHIFT_NS = 500_000_000
"""Clocks of two topics that were set back by nearly the same are one clock."""

_REMEMBERED = 31
"""Steps whose median is a topic's own."""

_APART_STEPS = 2.0
"""Clocks that differ by more than so many steps put pictures of different moments together."""


@dataclass(slots=True)
class _Topic:
    raw_ns: int
    log_ns: int
    time_ns: int
    ahead_ns: int
    shift_ns: int = 0
    steps: deque[int] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))


class MessageClock:
    """Gives every picture its time, ascending within its topic.

    Args:
        name: of the recording, for messages.
        clock: which time counts, for messages.
    """

    def __init__(self, name: str, clock: Clock) -> None:
        self._name, self._clock = name, clock
        self._topics: dict[str, _Topic] = {}
        self._shifts: list[int] = []

    def time_of(self, message: RecordedPicture, was_set: bool = False) -> int | None:
        """When a picture was taken, ns; None where that is not after the one before.

        Args:
            was_set: the clock was set since the picture before.
        """
        topic = self._topics.get(message.topic)
        ahead = message.stamp_ns - message.log_ns if message.stamp_ns > 0 else 0
        if topic is None:
            self._topics[message.topic] = _Topic(message.time_ns, message.log_ns, message.time_ns, ahead)
            return message.time_ns
        time_ns = message.time_ns + topic.shift_ns
        if was_set or topic.time_ns - time_ns >= SET_BACK_NS:
            topic.shift_ns = self._shift(topic, message)
            time_ns = message.time_ns + topic.shift_ns
        if time_ns <= topic.time_ns:
            return None
        topic.steps.append(time_ns - topic.time_ns)
        topic.raw_ns, topic.log_ns, topic.time_ns = message.time_ns, message.log_ns, time_ns
        return time_ns

    def step_ns(self) -> int | None:
        """The shortest of the topics' usual times from picture to picture; None before any is known."""
        known = [int(median(topic.steps)) for topic in self._topics.values() if topic.steps]
        return min(known, default=None)

    def slowest_fps(self) -> float | None:
        """Pictures a second of the topic that has the fewest; None before any is known."""
        known = [int(median(topic.steps)) for topic in self._topics.values() if topic.steps]
        return round(1e9 / max(known), 3) if known else None

    def check_apart(self, topics: Sequence[str], step: int | None) -> str | None:
        """What is wrong where the stamps of topics differ by more than frames do, for the same log times.

        Args:
            step: usual time from picture to picture, ns.
        """
        if self._clock == "log" or step is None or any(topic not in self._topics for topic in topics):
            return None
        ahead = {topic: self._topics[topic].ahead_ns for topic in topics}
        late, early = min(ahead, key=lambda t: ahead[t]), max(ahead, key=lambda t: ahead[t])
        gap = ahead[early] - ahead[late]
        if gap <= _APART_STEPS * step:
            return None
        return (
            f"the stamps of {early} are {gap / 1e9:.3f} s ahead of those of {late}, though both were written"
            " down at the same times: their cameras' clocks differ? `clock` log pairs by when they were"
            " written down, `offsets_ms` TOPIC=MS shifts a camera"
        )

    def _shift(self, topic: _Topic, message: RecordedPicture) -> int:
        """What is added to a clock that was set back, so that time goes on."""
        usual = int(median(topic.steps)) if topic.steps else 1
        logged = message.log_ns - topic.log_ns
        passed = logged if self._clock == "stamp" and 0 < logged < 60 * SET_BACK_NS else usual
        own = topic.time_ns + passed - message.time_ns
        for shift in self._shifts:
            if abs(shift - own) <= _SAME_SHIFT_NS and message.time_ns + shift > topic.time_ns:
                return shift
        self._shifts.append(own)
        back = (topic.raw_ns + passed - message.time_ns) / 1e9
        how = f"was set back by {back:.3f} s" if back > 0 else f"jumped ahead by {-back:.3f} s"
        text = f"the clock of {message.topic} {how} at {topic.raw_ns / 1e9:.3f} s"
        warnings.warn(f"{self._name}: {text}; times go on from there", MvCodecWarning, stacklevel=4)
        return own

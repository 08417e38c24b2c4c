"""Which stamps of a topic to believe: single ones may be far off, and clocks may be set."""

from __future__ import annotations

from typing import Literal

from mvcodec.container.recorded_pictures import RecordedPicture

FAR_NS = 1_000_000_000
"""Stamps that differ from what the log says by less are believed: writing may be late."""

Verdict = Literal["good", "set", "wrong"]
"""Believed; the first one after the clock was set; far off, as the ones around it show."""

Judged = tuple[RecordedPicture, Verdict]

_KNOWN_STEPS = 3
"""Steps after which is known whether log times follow the stamps at all."""


class StampCheck:
    """Judges the messages of one topic, in the order in which they were written.

    A message whose time agrees with the one before is judged at once, others when the next one is there.

    Args:
        settled: the recording can be looked ahead in: the first message waits for the next one too.
    """

    def __init__(self, settled: bool) -> None:
        self._settled = settled
        self._base: RecordedPicture | None = None
        self._held: list[RecordedPicture] = []
        self._steps = self._stamped_ns = self._logged_ns = 0

    def push(self, message: RecordedPicture) -> list[Judged]:
        """The messages that can be judged now."""
        if self._base is None:
            return self._begin(message)
        base, held = self._base, self._held
        self._held = []
        if _agree(base, message):
            return [*((item, "wrong") for item in held), self._believe(message)]
        if not held:
            self._held = [message]
            return []
        (other,) = held
        if _agree(other, message):
            self._base = other
            return [(other, "set" if self._log_follows else "good"), self._believe(message)]
        self._held = [message]
        if self._log_follows:
            return [(other, "wrong")]
        self._base = other
        return [(other, "good")]

    def flush(self) -> list[Judged]:
        """What waits for messages that never came."""
        held, self._held = self._held, []
        verdict: Verdict = "wrong" if self._base is not None and self._log_follows else "good"
        return [(message, verdict) for message in held]

    def _begin(self, message: RecordedPicture) -> list[Judged]:
        """The first messages: the third one shows which of two is far off."""
        if not self._settled:
            return [self._believe(message)]
        held = [*self._held, message]
        first, last = held[0], held[-1]
        self._held = held
        if len(held) == 1 or (len(held) == 2 and not _agree(first, last)):
            return []
        self._held, self._base = [], last
        if len(held) == 2:
            return [(first, "good"), (last, "good")]
        second = held[1]
        wrong = first if _agree(second, last) else second if _agree(first, last) else None
        return [(item, "wrong" if item is wrong else "good") for item in held]

    def _believe(self, message: RecordedPicture) -> Judged:
        if self._base is not None:
            self._steps += 1
            self._stamped_ns += abs(message.time_ns - self._base.time_ns)
            self._logged_ns += abs(message.log_ns - self._base.log_ns)
        self._base = message
        return message, "good"

    @property
    def _log_follows(self) -> bool:
        """Whether the log goes on as the stamps do: that of converted recordings may not."""
        return self._steps >= _KNOWN_STEPS and (
            self._stamped_ns < 2 * self._logged_ns and self._logged_ns < 2 * self._stamped_ns
        )


def _agree(before: RecordedPicture, after: RecordedPicture) -> bool:
    stamped = after.time_ns - before.time_ns
    return abs(stamped) < FAR_NS or abs(stamped - (after.log_ns - before.log_ns)) < FAR_NS

"""A bit rate of a whole stream held by one quality of all its tracks, chosen anew at each keyframe."""

from __future__ import annotations

import math

HALVING = 6.0
"""QPs up, on libx264's scale, that halve a stream's bits."""

START_QP = 30.0
MOST_TRIES = 4
"""How often the very first frame set is coded, until its size is about right."""

FOLLOWING = 0.25
"""Bits of a frame set that follows a keyframe, as a part of the keyframe's; known better after one span."""

_CLOSE = 1.2
_FURTHEST = 12.0
_LEAST = 0.25


class StreamRate:
    """Chooses a QP for each keyframe's span, so that all tracks together hold a bit rate.

    Args:
        kbps: of all tracks that are counted.
        fps: frame sets a second.
        gop: frame sets from keyframe to keyframe.
        scale: QPs of the codec for one of libx264's.
        max_qp: the codec's.
    """

    def __init__(self, kbps: float, fps: float, gop: int, scale: float, max_qp: int) -> None:
        self._per_set, self._gop = 1000 * kbps / fps, gop
        self._halving, self._max_qp = HALVING * scale, max_qp
        self._furthest = _FURTHEST * scale
        self._qp = START_QP * scale
        self._spent = self._span_bits = 0.0
        self._sets = self._span = self._tries = 0

    @property
    def qp(self) -> int:
        """For the frame sets from the keyframe at hand on."""
        return round(self._qp)

    def begin(self) -> None:
        """A keyframe comes: aim again, by what the span before it took."""
        if self._span:
            debt = self._spent - self._sets * self._per_set
            aim = max(self._per_set - debt / self._gop, _LEAST * self._per_set)
            self._turn(self._span_bits / self._span, aim)
        self._span_bits, self._span = 0.0, 0

    def try_again(self, bits: int) -> bool:
        """Whether the very first frame set is to be coded again, with another `qp`.

        Args:
            bits: that it took.
        """
        self._tries += 1
        aim = self._per_set * self._gop / (1 + FOLLOWING * (self._gop - 1))
        if self._sets or self._tries == MOST_TRIES or aim / _CLOSE < bits < aim * _CLOSE:
            return False
        before = self.qp
        self._turn(bits, aim)
        return self.qp != before

    def spend(self, bits: int) -> None:
        """Count the bits of a frame set."""
        self._spent += bits
        self._span_bits += bits
        self._sets += 1
        self._span += 1

    def _turn(self, bits: float, aim: float) -> None:
        change = self._halving * math.log2(max(bits, 1.0) / aim)
        change = min(max(change, -self._furthest), self._furthest)
        self._qp = min(max(self._qp + change, 1.0), float(self._max_qp))

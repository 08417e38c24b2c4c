"""The play clock: which frame is due now."""

from __future__ import annotations

import math

MAX_STALL_S = 0.25
"""How far the clock may run ahead of the pictures before it waits for them, seconds of play."""


class PlayClock:
    """Turns seconds of a monotonic clock into frame numbers.

    Frames are dropped where rendering is slower than the clock. Where it is far slower the clock waits:
    every frame between two pictures must still be decoded, so that a clock that never waits would run
    away from the decoder.

    Args:
        frame_count: of the file, at least 1.
        fps: frames a second at speed 1.
    """

    def __init__(self, frame_count: int, fps: float) -> None:
        self._count, self._fps = frame_count, fps
        self._frame = 0
        self._since_s: float | None = None
        self._dropped = 0
        self._stride = 1
        self.loop = False
        self._section: tuple[int, int] | None = None
        self._speed = 1.0

    @property
    def frame(self) -> int:
        """The frame at hand: the last one that `advance` or `seek` arrived at."""
        return self._frame

    @property
    def playing(self) -> bool:
        """Whether the clock runs."""
        return self._since_s is not None

    @property
    def dropped(self) -> int:
        """Frames that were due between two pictures and not shown, in total."""
        return self._dropped

    @property
    def section(self) -> tuple[int, int] | None:
        """First and last frame of what is played over and over; None: everything, or nothing."""
        return self._section

    def set_section(self, first: int, last: int) -> None:
        """Play these frames over and over; all frames of the file mean none in particular."""
        first, last = max(first, 0), min(last, self._count - 1)
        self._section = (first, last) if first < last and (first, last) != (0, self._count - 1) else None

    @property
    def speed(self) -> float:
        """Multiple of the file's frame rate."""
        return self._speed

    def play(self, playing: bool, now_s: float) -> None:
        """Start or stop. At the last frame, starting begins again from the first."""
        first, last = self._ends
        if not playing:
            self._since_s = None
        elif not self.playing:
            if self._frame == last:
                self._frame = first
            self._since_s = now_s

    def set_speed(self, speed: float, now_s: float) -> None:
        """Change the speed from now on."""
        self._speed = speed
        self._stride = 1
        if self.playing:
            self._since_s = now_s

    def seek(self, frame: int, now_s: float) -> None:
        """Go to a frame; the clock goes on from there if it runs."""
        self._frame = min(max(frame, 0), self._count - 1)
        self._stride = 1
        if self.playing:
            self._since_s = now_s

    def advance(self, now_s: float) -> int:
        """Move on to the frame that is due, and return it. Stops at the last frame unless looping."""
        if self._since_s is None:
            return self._frame
        rate = self._fps * self._speed
        due = math.floor((now_s - self._since_s) * rate + 1e-6)
        if due < 1:
            return self._frame
        steps = min(due, max(1, math.ceil(MAX_STALL_S * rate)))
        self._stride = steps
        self._since_s = now_s if steps < due else self._since_s + due / rate
        last = self._count - 1
        if self._frame + steps > last and not self._goes_round:
            steps = last - self._frame
            self._since_s = None
        self._dropped += max(steps - 1, 0)
        self._frame = self._round(self._frame + steps)
        return self._frame

    @property
    def _ends(self) -> tuple[int, int]:
        return self._section or (0, self._count - 1)

    @property
    def _goes_round(self) -> bool:
        return self.loop or self._section is not None

    def _round(self, frame: int) -> int:
        """The frame that comes in place of one behind the last."""
        first, last = self._ends
        return frame if frame <= last else first + (frame - first) % (last - first + 1)

    def following(self, frame: int, ahead: int) -> tuple[int, ...]:
        """The frame that will be due after this one, if as many are dropped as last, and those behind it.

        Args:
            ahead: how many at most; fewer before the end.
        """
        if self._goes_round:
            first, last = self._ends
            return tuple(self._round(frame + self._stride + i) for i in range(min(ahead, last - first + 1)))
        first = min(frame + self._stride, self._count - 1)
        return tuple(range(first, min(first + ahead, self._count))) if frame + 1 < self._count else ()

    def seconds_to_next(self, now_s: float) -> float | None:
        """How long until another frame is due; None while paused."""
        if self._since_s is None:
            return None
        return max(0.0, self._since_s + 1 / (self._fps * self._speed) - now_s)

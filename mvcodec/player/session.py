"""One viewer's state: messages come in, requests for pictures go out. Knows nothing of the web.

The latest state wins: whatever was asked for and overtaken before a picture was begun is never rendered, and
at most `MAX_IN_FLIGHT` pictures wait to be drawn, so that nothing can queue up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.player.clock import PlayClock
from mvcodec.player.draft import SMALLER, WHOLE, Level, Pace
from mvcodec.player.looks import COMPARING, EXACT, EYES, ONE
from mvcodec.player.messages import (
    Dolly,
    Eyes,
    Focus,
    Loop,
    Message,
    Move,
    Play,
    Ready,
    Section,
    Seek,
    Show,
    Shown,
    Speed,
    Wipe,
)
from mvcodec.synthesis.towards_enhanced import views_near

MAX_IN_FLIGHT = 2

LOOK_AHEAD = 3
"""Frames that are decoded before they are asked for: the one after a dropped one is next at once."""

MOVING_S = 0.2
"""How long after its last move a viewpoint counts as moving."""


class Enhanced(Enum):
    """Which enhanced views are decoded for a picture."""

    AT_HAND = "those that are decoded already"
    FROM_KEYFRAMES = "they join at the next keyframe, which holds nothing up"
    ALL = "all near ones, from the keyframe before the frame on"


@dataclass(frozen=True, slots=True)
class PictureRequest:
    """All that decides what a picture shows.

    Attributes:
        frame: of the file, from 0.
        viewpoint: within the array.
        look: a name of LOOKS.
        eyes: a name of EYES.
        eye_steps: distance of two eyes in steps of the grid; 0 where one view is shown.
        dolly: how far ahead of the cameras' plane, as a share of the farthest; 0 where views are compared.
        wipe: share of the width, from the left, that shows the picture whatever the look.
        focus_px: the disparity in focus, px between neighbouring real cameras; None: everything is sharp.
        level: how it is made.
        enhanced: what is done for the enhanced views near to it.
    """

    frame: int
    viewpoint: Viewpoint
    look: str = "picture"
    eyes: str = ONE
    eye_steps: float = 0.0
    dolly: float = 0.0
    wipe: float = 0.0
    focus_px: float | None = None
    level: Level = WHOLE
    enhanced: Enhanced = Enhanced.AT_HAND


class Session:
    """The state machine of one viewer. Times are seconds of any monotonic clock.

    Args:
        array: the geometry; viewpoints are kept within it.
        frame_count: of the file.
        stop_on_damage: playback stops at a damaged frame instead of going on behind it.
        levels: at which pictures can be made, from the best to the cheapest.
        enhanced: the file's enhanced views.
    """

    def __init__(
        self,
        array: CameraArray,
        frame_count: int,
        *,
        stop_on_damage: bool = False,
        levels: Sequence[Level] = SMALLER,
        enhanced: frozenset[Position] = frozenset(),
    ) -> None:
        self._array = array
        self._stop_on_damage = stop_on_damage
        self._clock = PlayClock(frame_count, array.fps)
        middle = Viewpoint((array.rows - 1) / 2, (array.cols - 1) / 2)
        self._wanted = PictureRequest(0, middle)
        self._eye_steps = min(0.5, array.cols - 1)
        self._last: PictureRequest | None = None
        self._ready = False
        self._sent = 0
        self._in_flight: dict[int, float] = {}
        self._pace = Pace(levels)
        self._moved_s = -math.inf
        self._enhanced, self._keeps_up = enhanced, True
        self.transfer_ms: float | None = None

    @property
    def state(self) -> dict[str, Any]:
        """What the page must know of playback, as plain JSON values."""
        return {"playing": self._clock.playing}

    @property
    def dropped(self) -> int:
        """Frames that were due and not shown, since the start."""
        return self._clock.dropped

    def apply(self, message: Message, now_s: float) -> None:
        """Take one message from the page."""
        match message:
            case Ready():
                self._ready = True
            case Shown(picture):
                self._note_shown(picture, now_s)
            case Seek() | Play() | Speed() | Loop() | Section():
                self._steer(message, now_s)
            case _:
                self._want(message, now_s)

    def _steer(self, message: Message, now_s: float) -> None:
        """What is about the frame."""
        clock = self._clock
        match message:
            case Seek(frame):
                clock.seek(frame, now_s)
            case Play(playing):
                clock.play(playing, now_s)
                self._keeps_up = True
            case Speed(factor):
                clock.set_speed(factor, now_s)
            case Loop(loop):
                clock.loop = loop
            case Section(first, last):
                clock.set_section(first, last)

    def _want(self, message: Message, now_s: float) -> None:
        """What is about how a frame is shown."""
        match message:
            case Move(viewpoint):
                self._wanted = replace(self._wanted, viewpoint=self._inside(viewpoint))
                self._moved_s, self._keeps_up = now_s, True
            case Dolly(share):
                self._wanted = replace(self._wanted, dolly=share)
                self._moved_s, self._keeps_up = now_s, True
            case Wipe(share):
                self._wanted = replace(self._wanted, wipe=share)
            case Show(look):
                self._wanted = replace(self._wanted, look=look)
            case Eyes(mode, steps):
                self._wanted = replace(self._wanted, eyes=mode)
                self._eye_steps = min(max(steps, 0.0), float(self._array.cols - 1))
            case Focus(px):
                self._wanted = replace(self._wanted, focus_px=px)

    def next_request(self, now_s: float) -> PictureRequest | None:
        """The picture to make now; None while there is nothing new, or the page is still busy."""
        if not self._ready or len(self._in_flight) >= MAX_IN_FLIGHT:
            return None
        eye_steps = 0.0 if self._wanted.eyes == ONE else self._eye_steps
        request = replace(self._wanted, frame=self._clock.advance(now_s), eye_steps=eye_steps)
        # What cameras are compared with is never a draft, nor ahead of their plane.
        is_exact = request.look in EXACT
        if is_exact:
            request = replace(request, dolly=0.0)
        if request.look == COMPARING:  # one sharp view, from where an original was taken
            place = _nearest_place(request.viewpoint)
            request = replace(request, viewpoint=place, eyes=ONE, eye_steps=0.0, focus_px=None)
        if (self._clock.playing or self._moving(now_s)) and not is_exact:
            request = replace(request, level=self._pace.level)
        if self._clock.playing and self._keeps_up and not self._moving(now_s):
            request = replace(request, enhanced=Enhanced.FROM_KEYFRAMES)
        if self._last is not None and replace(self._last, enhanced=request.enhanced) == request:
            if self._clock.playing or self._moving(now_s) or not self._lacks_enhanced:
                return None
            request = replace(request, enhanced=Enhanced.ALL)
        self._last = request
        return request

    @property
    def _lacks_enhanced(self) -> bool:
        """Whether the last picture, should it stand, is to be made again with the enhanced views near it."""
        last = self._last
        if last is None or last.enhanced is Enhanced.ALL:
            return False
        places = EYES[last.eyes].place(self._array, last.viewpoint, last.eye_steps)
        return bool(self._enhanced & views_near(self._array, places))

    def upcoming(self) -> tuple[int, ...]:
        """The frames that playback will want next, in their order; none while paused."""
        if not self._clock.playing or self._last is None:
            return ()
        return self._clock.following(self._last.frame, LOOK_AHEAD)

    def seconds_to_next(self, now_s: float) -> float | None:
        """How long until `next_request` may have news without a message; None: not before one."""
        if not self._ready or len(self._in_flight) >= MAX_IN_FLIGHT:
            return None
        final = self._last is not None and self._last.level == WHOLE and not self._lacks_enhanced
        if self._clock.playing or self._last is None or final:
            return self._clock.seconds_to_next(now_s)
        return max(0.0, self._moved_s + MOVING_S - now_s)  # then a better picture follows

    def overtaken(self, request: PictureRequest, now_s: float) -> bool:
        """Whether a picture being made is not worth waiting for: it takes long, and something moves."""
        if request.enhanced is Enhanced.ALL and self._clock.playing:
            return True
        slow = request.level == WHOLE != self._pace.level or request.enhanced is Enhanced.ALL
        return slow and self._moving(now_s)

    def made(self, request: PictureRequest, cost_s: float, drawing_s: float, now_s: float) -> None:
        """Note what a picture cost, which decides the level of the next ones."""
        moving = self._moving(now_s)
        if request.level == self._pace.level and (moving or self._clock.playing):
            self._pace.note(cost_s, drawing_s, 0.0 if moving else 1 / (self._array.fps * self._clock.speed))
            # Drafts are no bargain for enhanced views; until something changes they are left out.
            self._keeps_up = self._keeps_up and self._pace.level == WHOLE

    def sent(self, now_s: float, *, damaged: bool = False) -> int:
        """Note that a picture leaves now; returns its number, from 1, which the page repeats in `Shown`."""
        self._sent += 1
        self._in_flight[self._sent] = now_s
        if damaged and self._stop_on_damage:
            self._clock.play(False, now_s)
        return self._sent

    def _note_shown(self, picture: int, now_s: float) -> None:
        sent_s = self._in_flight.pop(picture, None)
        if sent_s is not None:
            self.transfer_ms = 1000 * (now_s - sent_s)

    def _moving(self, now_s: float) -> bool:
        return now_s - self._moved_s < MOVING_S

    def _inside(self, viewpoint: Viewpoint) -> Viewpoint:
        array = self._array
        row = min(max(viewpoint.row, 0.0), array.rows - 1.0)
        col = min(max(viewpoint.col, 0.0), array.cols - 1.0)
        return Viewpoint(row, col)


def _nearest_place(viewpoint: Viewpoint) -> Viewpoint:
    """The same rounding as the page's."""
    return Viewpoint(float(math.floor(viewpoint.row + 0.5)), float(math.floor(viewpoint.col + 0.5)))

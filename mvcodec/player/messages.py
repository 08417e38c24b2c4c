"""What the page may say: one JSON object a message, checked field by field before anything sees it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from typing import Any

from mvcodec.array import Viewpoint
from mvcodec.errors import InputError
from mvcodec.player.looks import EYES, LOOKS

MAX_MESSAGE_BYTES = 1024
"""The longest legal message has under 100 bytes."""

MAX_NUMBER = 1e9
SPEEDS = (0.1, 4.0)


@dataclass(frozen=True, slots=True)
class Ready:
    """The page is set up and wants pictures."""


@dataclass(frozen=True, slots=True)
class Move:
    """Look from here; places outside the array mean its border."""

    viewpoint: Viewpoint


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a frame of the file, from 0; numbers past the ends mean the ends."""

    frame: int


@dataclass(frozen=True, slots=True)
class Play:
    """Play or pause."""

    playing: bool


@dataclass(frozen=True, slots=True)
class Speed:
    """Play at a multiple of the file's frame rate."""

    factor: float


@dataclass(frozen=True, slots=True)
class Loop:
    """Begin again after the last frame, or stop there."""

    loop: bool


@dataclass(frozen=True, slots=True)
class Section:
    """Play from one frame to another over and over; the whole file ends that."""

    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Show:
    """Show one of LOOKS."""

    look: str


@dataclass(frozen=True, slots=True)
class Eyes:
    """One of EYES, and the distance of two eyes in steps of the grid."""

    mode: str
    steps: float


@dataclass(frozen=True, slots=True)
class Dolly:
    """Look from ahead of the cameras' plane, by a share of the farthest that is allowed."""

    share: float


@dataclass(frozen=True, slots=True)
class Focus:
    """The disparity in focus, px between neighbouring real cameras; None: everything is."""

    px: float | None


@dataclass(frozen=True, slots=True)
class Wipe:
    """Show the picture itself on the left, over a share of the width, and the look beside it."""

    share: float


@dataclass(frozen=True, slots=True)
class Probe:
    """Tell the disparity at a place of the picture that was sent last.

    The place is in shares of the picture's size, from its upper left.
    """

    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Shown:
    """The page has drawn this picture and can take another."""

    picture: int


Message = (
    Ready | Move | Seek | Play | Speed | Loop | Section | Show | Eyes | Dolly | Focus | Wipe | Probe | Shown
)


def parse_message(text: str | bytes) -> Message:
    """Read one message.

    Raises:
        InputError: not a message, or a field of it is missing, unknown or outside its range.
    """
    if not isinstance(text, str):
        raise InputError("message", "binary data", "JSON text")
    if len(text) > MAX_MESSAGE_BYTES:
        raise InputError("message", f"{len(text)} characters", f"at most {MAX_MESSAGE_BYTES}")
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError("message", _short(text), "JSON") from None
    if not isinstance(document, dict):
        raise InputError("message", _short(document), "a JSON object")
    kind = document.pop("type", None)
    if not isinstance(kind, str) or kind not in _FORMS:
        raise InputError("message type", _short(kind), f"one of {', '.join(_FORMS)}")
    fields, make = _FORMS[kind]
    if set(document) != set(fields):
        expected = f"fields {', '.join(fields)}" if fields else "no fields"
        raise InputError(f"message {kind}", f"fields {_short(sorted(document))}", expected)
    return make(*(check(f"{kind}.{name}", document[name]) for name, check in fields.items()))


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(name, _short(value), "a number")
    # Compared before it is converted: an integer may be too large for a float.
    if not -MAX_NUMBER <= value <= MAX_NUMBER or math.isnan(value):
        raise InputError(name, _short(value), f"a number within +-{MAX_NUMBER:g}")
    return float(value)


def _whole(name: str, value: Any) -> int:
    number = _number(name, value)
    if not number.is_integer():
        raise InputError(name, _short(value), "a whole number")
    return int(number)


def _truth(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(name, _short(value), "true or false")
    return value


def _speed(name: str, value: Any) -> float:
    number = _number(name, value)
    if not SPEEDS[0] <= number <= SPEEDS[1]:
        raise InputError(name, _short(value), f"{SPEEDS[0]:g}..{SPEEDS[1]:g}")
    return number


def _share(name: str, value: Any) -> float:
    number = _number(name, value)
    if not 0 <= number <= 1:
        raise InputError(name, _short(value), "0..1")
    return number


def _number_or_null(name: str, value: Any) -> float | None:
    return None if value is None else _number(name, value)


def _one_of(choices: Collection[str], name: str, value: Any) -> str:
    if not isinstance(value, str) or value not in choices:
        raise InputError(name, _short(value), f"one of {', '.join(choices)}")
    return value


_look, _eyes = partial(_one_of, LOOKS), partial(_one_of, EYES)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


_Check = Callable[[str, Any], Any]

_FORMS: dict[str, tuple[dict[str, _Check], Callable[..., Message]]] = {
    "ready": ({}, Ready),
    "move": ({"row": _number, "col": _number}, lambda row, col: Move(Viewpoint(row, col))),
    "seek": ({"frame": _whole}, Seek),
    "play": ({"playing": _truth}, Play),
    "speed": ({"factor": _speed}, Speed),
    "loop": ({"loop": _truth}, Loop),
    "section": ({"first": _whole, "last": _whole}, Section),
    "show": ({"look": _look}, Show),
    "eyes": ({"mode": _eyes, "steps": _number}, Eyes),
    "dolly": ({"share": _share}, Dolly),
    "focus": ({"px": _number_or_null}, Focus),
    "wipe": ({"share": _share}, Wipe),
    "probe": ({"x": _share, "y": _share}, Probe),
    "shown": ({"picture": _whole}, Shown),
}
"""Message types: their fields, each with its check, and what is made of them."""

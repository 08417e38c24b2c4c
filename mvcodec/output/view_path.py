"""Ways of the viewpoint over the array: shapes by name, and waypoints from a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.errors import InputError, SettingError
from mvcodec.fields import Fields

FILE_SUFFIX = ".json"
MAX_WAYPOINTS = 100_000


def _sweep(angle: float) -> tuple[float, float]:
    return 0.0, -math.cos(angle)


def _circle(angle: float) -> tuple[float, float]:
    return -math.sin(angle), -math.cos(angle)


def _lemniscate(angle: float) -> tuple[float, float]:
    return math.sin(2 * angle), math.sin(angle)


SHAPES: dict[str, Callable[[float], tuple[float, float]]] = {
    "sweep": _sweep,
    "circle": _circle,
    "lemniscate": _lemniscate,
}
"""Angle 0..2 pi -> (row, col), each -1..1 from border to border; all end where they begin.

``sweep`` goes from the left to the right and back, ``lemniscate`` is Gerono's figure of eight.
"""


def walk_shape(name: str, array: CameraArray, count: int) -> tuple[Viewpoint, ...]:
    """`count` viewpoints along a shape; the one behind the last would be the first again.

    In an array of one column the sweep runs along that column.

    Raises:
        SettingError: no such shape.
    """
    if name not in SHAPES:
        raise SettingError("path", name, f"one of {', '.join(SHAPES)}, or a file *{FILE_SUFFIX}")
    places = (SHAPES[name](2 * math.pi * number / count) for number in range(count))
    if array.cols == 1:
        places = ((row or col, 0.0) for row, col in places)
    down, right = (array.rows - 1) / 2, (array.cols - 1) / 2
    return tuple(Viewpoint(down + down * row, right + right * col) for row, col in places)


def read_waypoints(path: Path, array: CameraArray) -> tuple[Viewpoint, ...]:
    """The waypoints of a path file: ``{"viewpoints": [[row, col], ...]}``, in steps of the array's grid.

    Raises:
        InputError: unreadable, malformed, or a waypoint outside the array.
    """
    fields = Fields.load(path)
    expected = f"a list of 1..{MAX_WAYPOINTS} pairs [row, col]"
    found = fields.get("viewpoints", expected)
    if not isinstance(found, list) or not 1 <= len(found) <= MAX_WAYPOINTS:
        size = f"a list of {len(found)}" if isinstance(found, list) else type(found).__name__
        raise fields.wrong("viewpoints", size, expected)
    return tuple(_waypoint(fields, f"viewpoints[{number}]", pair, array) for number, pair in enumerate(found))


def _waypoint(fields: Fields, key: str, pair: object, array: CameraArray) -> Viewpoint:
    if not isinstance(pair, list) or len(pair) != 2:
        raise fields.wrong(key, type(pair).__name__, "a pair [row, col]")
    viewpoint = Viewpoint(*(fields.check_number(key, value, "two numbers") for value in pair))
    try:
        array.check_viewpoint(viewpoint)
    except SettingError as error:
        raise InputError(fields.source, f"{key} = {error.found}", error.expected) from None
    return viewpoint


def walk_waypoints(waypoints: Sequence[Viewpoint], count: int) -> tuple[Viewpoint, ...]:
    """`count` viewpoints from the first waypoint to the last, straight between them.

    Every leg takes the same time: a waypoint given twice is a rest, and as many waypoints as viewpoints
    are taken one by one.
    """
    last = len(waypoints) - 1
    return tuple(_between(waypoints, last * number / max(count - 1, 1)) for number in range(count))


def _between(waypoints: Sequence[Viewpoint], place: float) -> Viewpoint:
    leg = min(int(place), max(len(waypoints) - 2, 0))
    start, end, share = waypoints[leg], waypoints[min(leg + 1, len(waypoints) - 1)], place - leg
    return Viewpoint(_mix(start.row, end.row, share), _mix(start.col, end.col, share))


def _mix(start: float, end: float, share: float) -> float:
    # Clamped, since a rounding error may pass the array's border.
    low, high = min(start, end), max(start, end)
    return min(max(start + share * (end - start), low), high)

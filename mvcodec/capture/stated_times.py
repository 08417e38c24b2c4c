"""`times_ns` of `array.json`: when the pictures were taken."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

from mvcodec.array import Position
from mvcodec.fields import Fields

_KEY = "times_ns"
_EXPECTED = "a list of whole numbers of nanoseconds, 0 or more, ascending"
_VIEW_NAME = re.compile(r"r(\d+)_c(\d+)")


def read_times_ns(fields: Fields, rows: int, cols: int) -> dict[Position, tuple[int, ...]]:
    """Times by view: one list for all views, or an object ``{"r00_c01": [...]}`` with a list for some.

    Raises:
        InputError: something else is there, or times that don't ascend.
    """
    if _KEY not in fields:
        return {}
    value = fields.get(_KEY, _EXPECTED)
    if not isinstance(value, dict):
        times = _times(fields, _KEY, value)
        return {(row, col): times for row in range(rows) for col in range(cols)}
    found = {}
    for name, times in value.items():
        match = _VIEW_NAME.fullmatch(name)
        position = (int(match[1]), int(match[2])) if match else (rows, cols)
        if position[0] >= rows or position[1] >= cols:
            raise fields.wrong(_KEY, f"times of {name!r}", f"a view of the {rows}x{cols} grid, rNN_cNN")
        found[position] = _times(fields, f"{_KEY}.{name}", times)
    return found


def _times(fields: Fields, key: str, value: Any) -> tuple[int, ...]:
    if not isinstance(value, list) or not value:
        raise fields.wrong(key, "no list with something in it", _EXPECTED)
    for number, time in enumerate(value):
        if isinstance(time, bool) or not isinstance(time, int) or not 0 <= time < 1 << 63:
            raise fields.wrong(f"{key}[{number}]", time, _EXPECTED)
    for number, (before, after) in enumerate(pairwise(value)):
        if after <= before:
            raise fields.wrong(f"{key}[{number + 1}]", after, f"more than {before}, the time before it")
    return tuple(value)

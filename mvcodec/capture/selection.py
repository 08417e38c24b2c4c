"""Which cameras of a grid are real (coded): the setting `real`."""

from __future__ import annotations

from collections.abc import Collection
from itertools import product
from typing import Any

from mvcodec.array import Position, legal_steps
from mvcodec.errors import SettingError
from mvcodec.settings import setting

CORNERS = "corners"

_SHOWN_PER_AXIS = 4

RealAxes = tuple[tuple[int, ...], tuple[int, ...]]
"""(rows, cols) whose crossings are real cameras."""


def real_cameras() -> Any:
    """The field of every settings class of an input, read by `select_real`."""
    return setting(CORNERS, "the cameras to code; corners: both ends of a linear array")


def select_real(text: str, rows: int, cols: int) -> RealAxes:
    """Read ``corners``, ``all``, ``every:K`` or ``R,R..xC,C..`` (e.g. ``0,2,4x0,4``).

    ``corners`` means both ends in a linear array. Every form takes in the first and the last
    row and column, equally spaced.

    Raises:
        SettingError: another text, or cameras that this grid doesn't allow; names those it does.
    """
    if text == CORNERS:
        return _axis(rows, max(rows - 1, 1)), _axis(cols, max(cols - 1, 1))
    if text == "all":
        return _axis(rows, 1), _axis(cols, 1)
    if text.startswith("every:"):
        number = text.removeprefix("every:")
        step = int(number) if _is_number(number) else 0
        if step not in _common_steps(rows, cols):
            raise _refusal(text, rows, cols)
        return _axis(rows, step), _axis(cols, step)
    halves = [half.split(",") for half in text.split("x")]
    if len(halves) != 2 or not all(_is_number(item) for half in halves for item in half):
        raise _refusal(text, rows, cols)
    chosen_rows, chosen_cols = (tuple(int(item) for item in half) for half in halves)
    if chosen_rows not in _choices(rows) or chosen_cols not in _choices(cols):
        raise _refusal(text, rows, cols)
    return chosen_rows, chosen_cols


def read_views(real: str, grid: tuple[int, int], others: Collection[Position] | None) -> frozenset[Position]:
    """The views whose pictures are read: the real cameras, and of `others` those in the grid (None: all).

    Raises:
        SettingError: `real` doesn't fit the grid.
    """
    every = set(product(range(grid[0]), range(grid[1])))
    cameras = product(*select_real(real, *grid))
    return frozenset(every if others is None else {*cameras, *every.intersection(others)})


def _axis(count: int, step: int) -> tuple[int, ...]:
    return tuple(range(0, count, step))


def _choices(count: int) -> list[tuple[int, ...]]:
    """Every legal choice along one axis, fewest cameras first."""
    return [_axis(count, step) for step in reversed(legal_steps(count))]


def _common_steps(rows: int, cols: int) -> tuple[int, ...]:
    """K of ``every:K``: divides rows - 1 and cols - 1 (an axis of one view allows any K)."""
    axes = [count for count in (rows, cols) if count > 1] or [1]
    return tuple(step for step in legal_steps(axes[0]) if all((count - 1) % step == 0 for count in axes))


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit()


def _refusal(text: str, rows: int, cols: int) -> SettingError:
    steps = ", ".join(map(str, _common_steps(rows, cols)))
    expected = (
        f"corners, all, every:K with K one of {steps}, "
        f"or rows ({_listed(rows)}) x cols ({_listed(cols)}) for this {rows}x{cols} grid"
    )
    return SettingError("real", text or "nothing", expected)


def _listed(count: int) -> str:
    """The choices along one axis; a wide grid's densest are left out to keep the line readable."""
    texts = [",".join(map(str, choice)) for choice in _choices(count)]
    shown = texts[:_SHOWN_PER_AXIS]
    return " or ".join(shown + ["..."] * (len(texts) > len(shown)))

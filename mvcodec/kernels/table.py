"""The kernels of matching and rendering by name, and who implements them.

Matching and rendering call no kernel but by `kernel(name)`. Another processor's implementations are another
column of `COLUMNS`: they take and give what the ones here do. What a column lacks stays with `DEFAULT`.
"""

from __future__ import annotations

import contextvars
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from typing import Any

from mvcodec.errors import SettingError

DEFAULT = "numba"

Implementation = Callable[[], Callable[..., Any]]
"""Loads it: a module that nobody asks for is not imported."""


@cache
def _here(name: str) -> Callable[..., Any]:
    module, function = name.split(".")
    found: Callable[..., Any] = getattr(import_module(f"mvcodec.kernels.{module}"), function)
    return found


MATCHING = (
    "census.census_rows",
    "matching_costs.sampling_interval",
    "matching_costs.joint_costs",
    "semiglobal.turned_path",
    "semiglobal.sum_downwards",
    "semiglobal.decide_upwards",
    "completion.confirmed",
    "completion.completion_costs",
    "completion.seen_through",
    "completion.unseen",
    "subpixel_pull.add_pull",
    "geodesic.carry",
    "contours.widen",
    "enlargement.enlarge",
    "specks.smooth_over",
    "matching_rows.consistent",
    "matching_rows.fill_rows",
    "matching_rows.fuse_maps",
)
RENDERING = (
    "view_sweep.disparity_rows",
    "view_colour.blend",
    "view_quick.blend",
    "camera_mixing.mix",
    "view_holes.paint_holes",
)

COLUMNS: dict[str, Mapping[str, Implementation]] = {
    DEFAULT: {name: partial(_here, name) for name in (*MATCHING, *RENDERING)}
}
"""Implementations by the column's and the kernel's name."""

_column: contextvars.ContextVar[str] = contextvars.ContextVar("kernels", default=DEFAULT)


@contextmanager
def implemented_by(column: str) -> Iterator[None]:
    """Inside of the block kernels come from this column, on whichever thread.

    Raises:
        SettingError: there is none of that name.
    """
    if column not in COLUMNS:
        raise SettingError("kernels", column, "one of " + ", ".join(COLUMNS))
    before = _column.set(column)
    try:
        yield
    finally:
        _column.reset(before)


def kernel(name: str) -> Any:
    """The implementation of a kernel that is in use.

    Args:
        name: of `COLUMNS[DEFAULT]`.
    """
    chosen = COLUMNS[_column.get()].get(name) or COLUMNS[DEFAULT][name]
    return chosen()

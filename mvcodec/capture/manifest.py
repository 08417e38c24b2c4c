"""`array.json`: what an array folder says about itself, read and checked."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mvcodec.array import MAX_GRID_SIDE, Calibration, Position
from mvcodec.capture.file_patterns import pattern_files, pattern_names
from mvcodec.capture.given_maps import GivenFiles, read_given
from mvcodec.capture.stated_times import read_times_ns
from mvcodec.capture.truth import TruthFiles
from mvcodec.errors import InputError, SettingError
from mvcodec.fields import Fields

DEFAULT_FPS = 15.0
MANIFEST_NAME = "array.json"
_MAX_FRAMES = 10_000_000
_VIEW_NAME = re.compile(r"r(\d+)_c(\d+)")
_CALIBRATION_KEYS = ("fx_px", "fy_px", "cx_px", "cy_px", "baseline_m")

ViewFiles = tuple[Path, ...] | Path
"""The pictures of a view, one for each frame, or its video file."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """A checked `array.json`.

    Attributes:
        path: the file.
        rows, cols: the grid.
        views: the files of every grid position.
        fps: frame sets a second; None where the file states none.
        times_ns: when the pictures of a view were taken, where the file states that.
        name: of the scene; the folder's where the file states none.
        rho, calibration, disparity_per_step_px: as in CameraArray; None where not stated.
        truth: ground truth by view.
        given: disparity or depth of the views' pictures, to be coded in place of what matching finds.
        real: the coded views, where `decode` wrote the folder.
        first_frame: index in the original of frame 0.
    """

    path: Path
    rows: int
    cols: int
    views: dict[Position, ViewFiles]
    fps: float | None
    name: str
    times_ns: dict[Position, tuple[int, ...]] = field(default_factory=dict)
    rho: float = 1.0
    calibration: Calibration | None = None
    disparity_per_step_px: tuple[float, float] | None = None
    truth: dict[Position, TruthFiles] = field(default_factory=dict)
    given: GivenFiles | None = None
    real: tuple[Position, ...] | None = None
    first_frame: int = 0


def read_manifest(path: Path) -> Manifest:
    """Read `array.json`; no picture is opened.

    Raises:
        InputError: unreadable, malformed, or a field that is missing or wrong (named).
    """
    fields = Fields.load(path)
    rows = fields.integer("rows", 1, MAX_GRID_SIDE)
    cols = fields.integer("cols", 1, MAX_GRID_SIDE)
    if ("views" in fields) == ("pattern" in fields):
        found = "both views and pattern" if "views" in fields else "neither views nor pattern"
        raise InputError(path, found, "one of them")
    views = _listed_views(fields, rows, cols) if "views" in fields else _pattern_views(fields, rows, cols)
    return Manifest(
        path=path,
        rows=rows,
        cols=cols,
        views=views,
        fps=fields.number("fps", positive=True) if "fps" in fields else None,
        name=fields.text("name", path.resolve().parent.name),
        times_ns=read_times_ns(fields, rows, cols),
        rho=fields.number("rho", 1.0, positive=True),
        calibration=_calibration(fields),
        disparity_per_step_px=_disparity_range(fields),
        truth=_truth(fields, rows, cols),
        real=_real(fields, rows, cols),
        given=read_given(fields, rows, cols),
        first_frame=fields.integer("first_frame", 0, _MAX_FRAMES, 0),
    )


def _listed_views(fields: Fields, rows: int, cols: int) -> dict[Position, ViewFiles]:
    grid = _list_of(fields, "views", fields.get("views", "a list"), rows, "one list for each row")
    views: dict[Position, ViewFiles] = {}
    for row, columns in enumerate(grid):
        key = f"views[{row}]"
        for col, files in enumerate(_list_of(fields, key, columns, cols, "one entry for each column")):
            views[row, col] = _view_files(fields, f"{key}[{col}]", files)
    return views


def _list_of(fields: Fields, key: str, value: Any, length: int, what: str) -> list[Any]:
    if not isinstance(value, list):
        raise fields.wrong(key, type(value).__name__, f"a list of {length}, {what}")
    if len(value) != length:
        raise fields.wrong(key, f"a list of {len(value)}", f"a list of {length}, {what}")
    return value


def _view_files(fields: Fields, key: str, files: Any) -> ViewFiles:
    if isinstance(files, str) and files:
        return Path(fields.source).parent / files
    expected = "a list of picture files, or one video file"
    if not isinstance(files, list):
        raise fields.wrong(key, type(files).__name__, expected)
    if not files or not all(isinstance(file, str) and file for file in files):
        raise fields.wrong(key, "an empty list" if not files else "a list with other things in it", expected)
    return tuple(Path(fields.source).parent / file for file in files)


def _pattern_views(fields: Fields, rows: int, cols: int) -> dict[Position, ViewFiles]:
    pattern = fields.text("pattern")
    names = pattern_names(fields, "pattern", pattern, {"row", "col", "frame"})
    for name, count in (("row", rows), ("col", cols)):
        if count > 1 and name not in names:
            raise fields.wrong("pattern", pattern, f"{{{name}}} in it")
    frames = fields.integer("frames", 1, _MAX_FRAMES) if "frame" in names else None
    return pattern_files(Path(fields.source), pattern, names, rows, cols, frames)


def read_calibration(path: Path) -> Calibration:
    """Read a JSON file with the fields of `array.json`'s calibration.

    Raises:
        InputError: unreadable, malformed, or a field that is missing or wrong (named).
    """
    return _calibration_of(Fields.load(path))


def _calibration(fields: Fields) -> Calibration | None:
    return _calibration_of(fields.inner("calibration")) if "calibration" in fields else None


def _calibration_of(inner: Fields) -> Calibration:
    fx_px, fy_px, cx_px, cy_px, baseline_m = (inner.number(key) for key in _CALIBRATION_KEYS)
    d_inf_px = inner.number("d_inf_px_per_step", 0.0)
    try:
        return Calibration(fx_px, fy_px, cx_px, cy_px, baseline_m, d_inf_px)
    except SettingError as error:
        raise InputError(inner.source, f"{error.setting} = {error.found}", error.expected) from None


def _disparity_range(fields: Fields) -> tuple[float, float] | None:
    if "disparity_per_step_px" not in fields:
        return None
    key, expected = "disparity_per_step_px", "[lo, hi] with lo < hi"
    value = fields.get(key, expected)
    if not isinstance(value, list) or len(value) != 2:
        raise fields.wrong(key, value, expected)
    low, high = (fields.check_number(key, end, expected) for end in value)
    if low >= high:
        raise fields.wrong(key, value, expected)
    return low, high


def _truth(fields: Fields, rows: int, cols: int) -> dict[Position, TruthFiles]:
    if "truth" not in fields:
        return {}
    views = fields.inner("truth")
    truth = {}
    for name in views.values:
        match = _VIEW_NAME.fullmatch(name)
        position = (int(match[1]), int(match[2])) if match else (rows, cols)
        if position[0] >= rows or position[1] >= cols:
            raise InputError(
                fields.source, f"truth of {name!r}", f"a view of the {rows}x{cols} grid, rNN_cNN"
            )
        inner = views.inner(name)
        scale = inner.number("scale", 1.0, positive=True)
        invalid = inner.number("invalid") if inner.values.get("invalid") is not None else None
        steps = inner.integer("steps", -MAX_GRID_SIDE, MAX_GRID_SIDE, 1)
        if steps == 0:
            raise inner.wrong("steps", steps, "a number of grid steps, not 0")
        truth[position] = TruthFiles(Path(fields.source).parent, _truth_names(inner), scale, invalid, steps)
    return truth


def _truth_names(inner: Fields) -> tuple[str, ...]:
    expected = "a file, a list of files, or a pattern with {frame}"
    files = inner.get("file", expected)
    names = files if isinstance(files, list) else [files]
    if not names or not all(isinstance(name, str) and name for name in names):
        raise inner.wrong("file", files, expected)
    if len(names) == 1:
        pattern_names(inner, "file", names[0], {"frame"})
    return tuple(names)


def _real(fields: Fields, rows: int, cols: int) -> tuple[Position, ...] | None:
    if "real" not in fields:
        return None
    expected = f"a list of [row, col] of the {rows}x{cols} grid"
    value = fields.get("real", expected)
    if not isinstance(value, list):
        raise fields.wrong("real", type(value).__name__, expected)
    positions = []
    for pair in value:
        is_pair = isinstance(pair, list) and len(pair) == 2 and all(type(number) is int for number in pair)
        if not is_pair or not (0 <= pair[0] < rows and 0 <= pair[1] < cols):
            raise fields.wrong("real", pair, expected)
        positions.append((pair[0], pair[1]))
    return tuple(positions)

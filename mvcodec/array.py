"""The camera array: its grid, its real cameras, the cells between them and its calibration.

Conventions (used everywhere): positions are (row, col), row 0 on top, col 0 left, seen from
behind the cameras. A *cell* is the span between neighbouring real cameras. Disparity d (px)
belongs to the horizontal baseline of one cell; a pixel (x, y) of disparity d in a camera is
seen at ``(x - b_col * d, y - rho * b_row * d)`` from a view at offset (b_row, b_col) cells.
In a grid of one column d belongs to the vertical baseline and rho is 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from mvcodec.errors import SettingError

Position = tuple[int, int]
"""(row, col) of a view of the dense grid."""

NOMINAL_BASELINE_M = 0.1
MAX_GRID_SIDE = 1024
MAX_PICTURE_SIDE = 16384
MIN_FPS, MAX_FPS = 1e-6, 1e6
"""A picture in twelve days, and more than any camera takes: what codecs and containers can say."""

LISTED_SIDE = 32
"""Up to here a message lists rows (columns) one by one."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A place on the plane of the cameras, in steps of the dense grid; fractions are legal."""

    row: float
    col: float

    @property
    def position(self) -> Position | None:
        """The grid position here, or None between the positions."""
        if float(self.row).is_integer() and float(self.col).is_integer():
            return int(self.row), int(self.col)
        return None


@dataclass(frozen=True, slots=True)
class Calibration:
    """Pinhole calibration shared by every view (the pictures are rectified).

    Attributes:
        fx_px, fy_px: focal lengths, px.
        cx_px, cy_px: principal point, px.
        baseline_m: distance of one horizontal grid step (vertical in a one-column grid), m.
        d_inf_px_per_step: disparity of infinitely distant points per grid step, px.
        given: False where the input stated none and nominal values stand in.
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    baseline_m: float
    d_inf_px_per_step: float = 0.0
    given: bool = True

    def __post_init__(self) -> None:
        for name in ("fx_px", "fy_px", "baseline_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise SettingError(f"calibration.{name}", value, "a positive number")
        for name in ("cx_px", "cy_px", "d_inf_px_per_step"):
            value = getattr(self, name)
            if not math.isfinite(value):
                raise SettingError(f"calibration.{name}", value, "a finite number")

    @classmethod
    def nominal(cls, width: int, height: int) -> Calibration:
        """Stand-in calibration for an input that states none: f = picture width, 0.1 m a step."""
        return cls(width, width, (width - 1) / 2, (height - 1) / 2, NOMINAL_BASELINE_M, given=False)


@dataclass(frozen=True, slots=True)
class Cell:
    """The span between neighbouring real cameras: up to 2 x 2 of them.

    top == bottom in an array of one row, left == right in an array of one column.
    """

    top: int
    left: int
    bottom: int
    right: int

    @property
    def cameras(self) -> tuple[Position, ...]:
        """The real cameras at its corners, row order, without repetition."""
        rows = dict.fromkeys((self.top, self.bottom))
        cols = dict.fromkeys((self.left, self.right))
        return tuple((row, col) for row in rows for col in cols)


@dataclass(frozen=True, slots=True)
class CameraArray:
    """A dense rectified grid of views, some of which are real (coded) cameras.

    Attributes:
        rows, cols: the dense grid.
        width, height: picture size, px.
        fps: frame sets a second.
        real_rows, real_cols: the rows and columns whose crossings are real cameras. Equally
            spaced, including the first and the last.
        rho: (vertical step * fy) / (horizontal step * fx) of the grid; 1 in a one-column grid.
        calibration: of every view.
        disparity_per_step_px: (lo, hi) hint between neighbouring views of the grid, or None.
        name: of the scene; may be empty.

    Raises:
        SettingError: a field is outside its range.
    """

    rows: int
    cols: int
    width: int
    height: int
    fps: float
    real_rows: tuple[int, ...]
    real_cols: tuple[int, ...]
    calibration: Calibration
    rho: float = 1.0
    disparity_per_step_px: tuple[float, float] | None = None
    name: str = ""

    def __post_init__(self) -> None:
        for name, value, top in (
            ("rows", self.rows, MAX_GRID_SIDE),
            ("cols", self.cols, MAX_GRID_SIDE),
            ("width", self.width, MAX_PICTURE_SIDE),
            ("height", self.height, MAX_PICTURE_SIDE),
        ):
            if not 1 <= value <= top:
                raise SettingError(f"array.{name}", value, f"1..{top}")
        if not MIN_FPS <= self.fps <= MAX_FPS:
            raise SettingError("array.fps", self.fps, f"{MIN_FPS:g}..{MAX_FPS:g}")
        if not (math.isfinite(self.rho) and self.rho > 0):
            raise SettingError("array.rho", self.rho, "a positive number")
        _check_real("rows", self.real_rows, self.rows)
        _check_real("cols", self.real_cols, self.cols)
        if self.cols == 1 and self.rho != 1.0:
            raise SettingError("array.rho", self.rho, "1 in a grid of one column")
        hint = self.disparity_per_step_px
        if hint is not None and not (math.isfinite(hint[0]) and math.isfinite(hint[1]) and hint[0] < hint[1]):
            raise SettingError("array.disparity_per_step_px", list(hint), "[lo, hi] with lo < hi")

    @property
    def positions(self) -> tuple[Position, ...]:
        """Every view of the dense grid, row order."""
        return tuple((row, col) for row in range(self.rows) for col in range(self.cols))

    @property
    def real(self) -> tuple[Position, ...]:
        """The real cameras, row order."""
        return tuple((row, col) for row in self.real_rows for col in self.real_cols)

    @property
    def row_step(self) -> int:
        """Grid steps between vertically neighbouring real cameras; 0 in a grid of one row."""
        return self.real_rows[1] - self.real_rows[0] if len(self.real_rows) > 1 else 0

    @property
    def col_step(self) -> int:
        """Grid steps between horizontally neighbouring real cameras; 0 in a grid of one column."""
        return self.real_cols[1] - self.real_cols[0] if len(self.real_cols) > 1 else 0

    @property
    def baseline_steps(self) -> int:
        """Grid steps of the baseline that disparity belongs to (horizontal where there is one)."""
        return self.col_step or self.row_step or 1

    @property
    def cell_rho(self) -> float:
        """rho of a cell: px of vertical shift for each px of disparity across one cell."""
        if self.col_step and self.row_step:
            return self.rho * self.row_step / self.col_step
        return 1.0

    @property
    def disparity_hint_px(self) -> tuple[float, float] | None:
        """`disparity_per_step_px` between neighbouring real cameras, or None."""
        if self.disparity_per_step_px is None:
            return None
        low, high = self.disparity_per_step_px
        return low * self.baseline_steps, high * self.baseline_steps

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Every cell, row order; they share their cameras."""
        row_spans = list(pairwise(self.real_rows)) or [(self.real_rows[0],) * 2]
        col_spans = list(pairwise(self.real_cols)) or [(self.real_cols[0],) * 2]
        return tuple(Cell(top, left, bottom, right) for top, bottom in row_spans for left, right in col_spans)

    def cell_at(self, viewpoint: Viewpoint) -> Cell:
        """The cell that a viewpoint lies in (the upper left one where it lies on a border).

        Raises:
            SettingError: the viewpoint lies outside the span of the real cameras.
        """
        self.check_viewpoint(viewpoint)
        for cell in self.cells:
            if viewpoint.row <= cell.bottom and viewpoint.col <= cell.right:
                return cell
        raise AssertionError("the cells cover the grid")

    def check_viewpoint(self, viewpoint: Viewpoint) -> None:
        """Raise SettingError where a viewpoint lies outside the span of the real cameras."""
        if not (0 <= viewpoint.row <= self.rows - 1 and 0 <= viewpoint.col <= self.cols - 1):
            raise SettingError(
                "viewpoint",
                f"{viewpoint.row:g},{viewpoint.col:g}",
                f"row 0..{self.rows - 1}, col 0..{self.cols - 1}",
            )

    def shift_per_disparity(self, camera: Position, viewpoint: Viewpoint) -> tuple[float, float]:
        """(b_col, rho * b_row): what a pixel moves, per px of disparity, from a camera to a view.

        A pixel (x, y) of disparity d in `camera` is seen at ``(x - sx * d, y - sy * d)`` from
        `viewpoint`, where ``(sx, sy)`` is returned (ALGORITHMS section 0).
        """
        b_col = (viewpoint.col - camera[1]) / self.col_step if self.col_step else 0.0
        b_row = (viewpoint.row - camera[0]) / self.row_step if self.row_step else 0.0
        return b_col, self.cell_rho * b_row

    def camera_position_m(self, position: tuple[float, float]) -> tuple[float, float, float]:
        """Where a view stands in optical axes (x right, y down, z forward), metres; fractions are legal."""
        row, col = position
        calibration = self.calibration
        vertical = self.rho * calibration.fx_px / calibration.fy_px
        return col * calibration.baseline_m, row * vertical * calibration.baseline_m, 0.0

    def principal_point_px(self, position: tuple[float, float]) -> tuple[float, float]:
        """(x, y) of the optical axis in a view's picture; fractions are legal.

        The calibration has view (0, 0)'s. Each step moves it by the disparity of infinity, which is
        what that disparity comes from.
        """
        row, col = position
        c = self.calibration
        vertical = 1.0 if self.cols == 1 else self.rho
        return c.cx_px - col * c.d_inf_px_per_step, c.cy_px - row * vertical * c.d_inf_px_per_step

    def viewpoints(self, rows: int, cols: int) -> tuple[Viewpoint, ...]:
        """A rows x cols grid of viewpoints over the span of the real cameras, row order.

        Raises:
            SettingError: more than one row (column) asked of an array with one, or none at all.
        """
        if rows < 1 or cols < 1 or (self.rows == 1 and rows > 1) or (self.cols == 1 and cols > 1):
            down, across = "1" if self.rows == 1 else "R", "1" if self.cols == 1 else "C"
            free = ", ".join(name for name in (down, across) if name != "1")
            expected = f"{down}x{across}{' with ' + free + ' >= 1' if free else ''}"
            raise SettingError("grid", f"{rows}x{cols}", expected)
        return tuple(
            Viewpoint(_spread(row, rows, self.rows), _spread(col, cols, self.cols))
            for row in range(rows)
            for col in range(cols)
        )


def _spread(index: int, count: int, span: int) -> float:
    """Place `index` of `count` equally spaced places over 0..span-1 (the middle if there is one)."""
    return (span - 1) / 2 if count == 1 else index * (span - 1) / (count - 1)


def _check_real(axis: str, real: tuple[int, ...], count: int) -> None:
    steps = {b - a for a, b in pairwise(real)}
    ends_match = bool(real) and real[0] == 0 and real[-1] == count - 1
    if not ends_match or len(steps) > 1 or any(step <= 0 for step in steps):
        spacings = [range(0, count, step) for step in legal_steps(count)]
        legal = " or ".join(
            ",".join(map(str, places)) if count <= LISTED_SIDE else f"every {places.step}"
            for places in spacings
        )
        raise SettingError(
            f"real {axis}",
            ",".join(map(str, real[:LISTED_SIDE])) or "none",
            f"equally spaced {axis} from first to last: {legal}",
        )


def legal_steps(count: int) -> tuple[int, ...]:
    """The spacings of real cameras that a row (or column) of `count` views allows."""
    if count == 1:
        return (1,)
    return tuple(step for step in range(1, count) if (count - 1) % step == 0)

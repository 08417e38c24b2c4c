"""Styles of take-away pictures: which views a picture is made of, and how.

Each style makes a `Shot`; `take` renders the views that it needs.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice, tee

import numpy as np

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet, Picture, RenderedView
from mvcodec.output import light_field, stereoscopic
from mvcodec.output.mosaic import mosaic
from mvcodec.settings import check_settings, setting
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.workers import Job, submit

AHEAD = 3
"""Views rendered or being rendered that nobody has taken yet."""

MAX_VIEWS = 1024
"""Of one picture."""

QUILT_GRID = (6, 8)
"""Rows and columns, as most of the displays take them."""

SLICE_VIEWS = 96
APERTURE_SHIFT_PX = 1.0
"""Between neighbouring views of a refocused picture: more shows as ghosts of what is out of focus."""

STEREO_SHARE = 0.03
"""Of the picture's width: the largest parallax, either way of the plane of the screen, by default."""

EXTREMES = (1, 99)
"""Per cent of the pixels that are farther than what counts as the farthest, and the nearest."""

Grid = tuple[int, int]


@dataclass(frozen=True, slots=True)
class ShotSettings:
    """What the user chose, and what follows from the file.

    Attributes:
        array: of the file.
        eye_steps: distance of two eyes in steps of its grid.
        median_px: a disparity in the middle of the scene, px for one step.
        extremes_px: those of what is far and near, px for one step.
        grid, focus_px, convergence_px: explained by their fields; None: the style's own, none, the median.
    """

    array: CameraArray
    eye_steps: float
    median_px: float
    extremes_px: tuple[float, float]
    grid: Grid | None = setting(
        None, "views of a mosaic, quilt or refocused picture; 1xN: of an epipolar slice"
    )
    focus_px: float | None = setting(
        None,
        "disparity in focus, px for one step of the input's grid: the others blur, as through a lens as"
        " large as the array",
    )
    convergence_px: float | None = setting(
        None,
        "disparity in the plane of the screen, px for one step, for pictures of several views (default: the"
        f" scene's median; eyes stand so that nothing is farther than {STEREO_SHARE:.0%} of the width from"
        " it)",
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if self.grid is not None and self.grid[0] * self.grid[1] > MAX_VIEWS:
            raise SettingError(
                "grid", f"{self.grid[0]}x{self.grid[1]}", f"{MAX_VIEWS} views in one picture at most"
            )
        for option, px in (("focus_px", self.focus_px), ("convergence_px", self.convergence_px)):
            if px is not None and not abs(px) <= self.array.width:
                expected = f"at most {self.array.width} px, a picture's width, either way"
                raise SettingError(option, f"{px:g}", expected)

    @property
    def screen_px(self) -> float:
        """The disparity in the plane of the screen, px for one step."""
        return self.median_px if self.convergence_px is None else self.convergence_px

    @classmethod
    def of(
        cls,
        decoded: DecodedSet,
        grid: Grid | None = None,
        focus_px: float | None = None,
        convergence_px: float | None = None,
    ) -> ShotSettings:
        """The settings that suit a scene: two eyes are as far apart as its depth allows."""
        array = decoded.array
        maps = np.stack([disparity.values_px for disparity in decoded.disparities.values()])
        far, median, near = np.percentile(maps, [EXTREMES[0], 50, EXTREMES[1]]) / array.baseline_steps
        settings = cls(array, 0.0, float(median), (float(far), float(near)), grid, focus_px, convergence_px)
        depth = max(abs(px - settings.screen_px) for px in settings.extremes_px)
        eyes = min(array.cols - 1.0, STEREO_SHARE * array.width / depth) if depth else array.cols - 1.0
        return replace(settings, eye_steps=eyes)


@dataclass(frozen=True, slots=True)
class Shot:
    """How one picture is made.

    Attributes:
        places: viewpoint -> the viewpoints to render.
        compose: viewpoint, and all those views in order -> picture.
        moves: whether the picture follows the viewpoint, so that a path makes sense.
        grid: rows and columns of the views, or None where they form none.
    """

    places: Callable[[Viewpoint], tuple[Viewpoint, ...]]
    compose: Callable[[Viewpoint, Iterator[RenderedView]], Picture]
    moves: bool = True
    grid: Grid | None = None


def _mono(settings: ShotSettings) -> Shot:
    if settings.focus_px is not None:
        return _refocused(settings, settings.focus_px)
    _refuse_grid(settings, "mono without `focus_px`")
    return Shot(lambda viewpoint: (viewpoint,), lambda _, views: next(views).pixels)


def _refocused(settings: ShotSettings, px: float) -> Shot:
    array = settings.array
    grid = settings.grid or _aperture_grid(settings, px)
    lens = array.viewpoints(*grid)
    if settings.grid is None:
        lens = tuple(place for place in lens if _in_round_aperture(array, place))
    return Shot(
        lambda _: lens, lambda viewpoint, views: light_field.refocus(array, views, viewpoint, px), grid=grid
    )


def _aperture_grid(settings: ShotSettings, px: float) -> Grid:
    """Views so dense that nothing jumps from one to the next; less dense where there would be too many."""
    array = settings.array
    blur = max(abs(extreme - px) for extreme in settings.extremes_px) / APERTURE_SHIFT_PX
    rows = 1 + math.ceil(blur * array.rho * (array.rows - 1))
    cols = 1 + math.ceil(blur * (array.cols - 1))
    while rows * cols > MAX_VIEWS:
        rows, cols = max(1, rows - (rows > 1)), max(1, cols - (cols > 1))
    return rows, cols


def _in_round_aperture(array: CameraArray, place: Viewpoint) -> bool:
    offsets = [
        2 * at / (count - 1) - 1 if count > 1 else 0.0
        for at, count in ((place.row, array.rows), (place.col, array.cols))
    ]
    return offsets[0] ** 2 + offsets[1] ** 2 <= 1 + 1e-9


def _side_by_side(settings: ShotSettings) -> Shot:
    return _two_eyes(settings, "side-by-side", lambda left, right: np.hstack([left, right]))


def _anaglyph(settings: ShotSettings) -> Shot:
    return _two_eyes(settings, "anaglyph", stereoscopic.anaglyph)


def _two_eyes(settings: ShotSettings, style: str, join: Callable[[Picture, Picture], Picture]) -> Shot:
    _refuse_grid(settings, style)
    _want_columns(settings, style)

    def places(viewpoint: Viewpoint) -> tuple[Viewpoint, ...]:
        return stereoscopic.two_eyes(settings.array, viewpoint, settings.eye_steps)

    return _converging(settings, Shot(places, lambda _, views: join(next(views).pixels, next(views).pixels)))


def _mosaic(settings: ShotSettings) -> Shot:
    array, grid = settings.array, settings.grid
    if grid is None:
        return _converging(
            settings,
            Shot(
                lambda viewpoint: stereoscopic.nine_places(array, viewpoint, settings.eye_steps),
                lambda _, views: stereoscopic.nine([view.pixels for view in views]),
            ),
        )
    everywhere = array.viewpoints(*grid)

    def compose(_: Viewpoint, views: Iterator[RenderedView]) -> Picture:
        return mosaic([[view.pixels for view in islice(views, grid[1])] for _ in range(grid[0])])

    shot = Shot(lambda _: everywhere, compose, moves=False, grid=grid)
    # Such a mosaic shows the views as they are.
    return shot if settings.convergence_px is None else _converging(settings, shot)


def _quilt(settings: ShotSettings) -> Shot:
    _want_columns(settings, "quilt")
    rows, cols = settings.grid or QUILT_GRID
    shot = Shot(
        lambda viewpoint: _along_row(settings.array, viewpoint, rows * cols),
        lambda _, views: light_field.quilt([view.pixels for view in views], rows, cols),
        moves=False,
        grid=(rows, cols),
    )
    return _converging(settings, shot)


def _epipolar(settings: ShotSettings) -> Shot:
    array, grid = settings.array, settings.grid
    along_column = array.cols == 1
    if grid is not None and 1 not in grid:
        raise SettingError("grid", f"{grid[0]}x{grid[1]}", "1xN for `style` epipolar")
    count = max(grid) if grid else SLICE_VIEWS

    def places(viewpoint: Viewpoint) -> tuple[Viewpoint, ...]:
        return array.viewpoints(count, 1) if along_column else _along_row(array, viewpoint, count)

    def compose(_: Viewpoint, views: Iterator[RenderedView]) -> Picture:
        return light_field.epipolar_slice((view.pixels for view in views), along_column=along_column)

    shot = Shot(places, compose, moves=False)
    # A slice shows the slopes of lines; they are sheared only where that is asked for.
    return shot if settings.convergence_px is None else _converging(settings, shot)


STYLES: dict[str, Callable[[ShotSettings], Shot]] = {
    "mono": _mono,
    "side-by-side": _side_by_side,
    "anaglyph": _anaglyph,
    "mosaic": _mosaic,
    "quilt": _quilt,
    "epipolar": _epipolar,
}


def take(
    shot: Shot, moments: Iterable[tuple[DecodedSet, Viewpoint]], synthesizer: Synthesizer
) -> Iterator[Picture]:
    """The picture of each moment, in order; views are rendered ahead, side by side.

    Raises:
        SettingError: a viewpoint outside the array; and what `moments` raises.
    """
    to_render, to_compose = tee(moments)
    jobs = ((decoded, place) for decoded, viewpoint in to_render for place in shot.places(viewpoint))
    views = _rendered(synthesizer, jobs)
    for _, viewpoint in to_compose:
        yield shot.compose(viewpoint, islice(views, len(shot.places(viewpoint))))


def _rendered(
    synthesizer: Synthesizer, jobs: Iterable[tuple[DecodedSet, Viewpoint]]
) -> Iterator[RenderedView]:
    waiting: deque[Job[RenderedView]] = deque()
    for decoded, place in jobs:
        waiting.append(submit(synthesizer.render, decoded, place))
        if len(waiting) >= AHEAD:
            yield waiting.popleft().result()
    while waiting:
        yield waiting.popleft().result()


def _converging(settings: ShotSettings, shot: Shot) -> Shot:
    """The shot with the disparity of the screen's plane at the same place in all its views.

    The cameras are parallel: as they are, everything would float before the screen.
    """
    px, array = settings.screen_px, settings.array

    def compose(viewpoint: Viewpoint, views: Iterator[RenderedView]) -> Picture:
        places = shot.places(viewpoint)
        rows, cols = [place.row for place in places], [place.col for place in places]
        centre = Viewpoint((min(rows) + max(rows)) / 2, (min(cols) + max(cols)) / 2)
        moved = (replace(view, pixels=light_field.converge(array, view, centre, px)) for view in views)
        return shot.compose(viewpoint, moved)

    return replace(shot, compose=compose)


def _along_row(array: CameraArray, viewpoint: Viewpoint, count: int) -> tuple[Viewpoint, ...]:
    return tuple(Viewpoint(viewpoint.row, place.col) for place in array.viewpoints(1, count))


def _refuse_grid(settings: ShotSettings, style: str) -> None:
    if settings.grid is not None:
        expected = f"none for `style` {style}, which is not made of a grid of views"
        raise SettingError("grid", f"{settings.grid[0]}x{settings.grid[1]}", expected)


def _want_columns(settings: ShotSettings, style: str) -> None:
    if settings.array.cols == 1:
        raise SettingError(
            "style", style, "another one: this array has one column, its views lie above each other"
        )

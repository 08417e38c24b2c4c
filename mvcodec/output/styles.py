"""Styles of take-away pictures: which views a picture is made of, and how.

Each style makes a `Shot`; `take` renders the views that it needs.
"""

from __future__ import annotations

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
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.workers import Job, submit

AHEAD = 3
"""Views rendered or being rendered that nobody has taken yet."""

MAX_VIEWS = 1024
"""Of one picture."""

QUILT_GRID = (6, 8)
"""Rows and columns, as most of the displays take them."""

SLICE_VIEWS = 96
APERTURE_SIDE = 5
"""Fewer views on a side show as ghosts in a refocused picture."""

STEREO_SHARE = 1 / 30
"""Of the picture's width: the largest disparity between two eyes by default, a rule of thumb."""

Grid = tuple[int, int]


@dataclass(frozen=True, slots=True)
class ShotSettings:
    """What the user chose, and what follows from the file.

    Attributes:
        array: of the file.
        eye_steps: distance of two eyes in steps of its grid.
        median_px: a disparity in the middle of the scene, px for one step.
        grid: (rows, cols) of views, or None for the style's own.
        focus_px: the disparity in focus, px for one step, or None.
    """

    array: CameraArray
    eye_steps: float
    median_px: float
    grid: Grid | None = None
    focus_px: float | None = None

    def __post_init__(self) -> None:
        if self.grid is not None and self.grid[0] * self.grid[1] > MAX_VIEWS:
            raise SettingError(
                "grid", f"{self.grid[0]}x{self.grid[1]}", f"{MAX_VIEWS} views in one picture at most"
            )
        if self.focus_px is not None and not abs(self.focus_px) <= self.array.width:
            expected = f"at most {self.array.width} px, a picture's width, either way"
            raise SettingError("focus_px", f"{self.focus_px:g}", expected)

    @classmethod
    def of(cls, decoded: DecodedSet, grid: Grid | None = None, focus_px: float | None = None) -> ShotSettings:
        """The settings that suit a scene."""
        array = decoded.array
        largest = max(map(abs, decoded.disparity_range_px)) / array.baseline_steps
        eyes = min(array.cols - 1, STEREO_SHARE * array.width / largest) if largest else 0.0
        maps = [disparity.values_px for disparity in decoded.disparities.values()]
        return cls(array, eyes, float(np.median(np.stack(maps))) / array.baseline_steps, grid, focus_px)


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
    sides = (max(size, APERTURE_SIDE) if size > 1 else 1 for size in (array.rows, array.cols))
    grid = settings.grid or (next(sides), next(sides))
    lens = array.viewpoints(*grid)
    return Shot(
        lambda _: lens, lambda viewpoint, views: light_field.refocus(array, views, viewpoint, px), grid=grid
    )


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

    return _converging(settings, Shot(lambda _: everywhere, compose, moves=False, grid=grid))


def _quilt(settings: ShotSettings) -> Shot:
    _want_columns(settings, "quilt")
    rows, cols = settings.grid or QUILT_GRID
    # The cameras are parallel: as they are, everything would float before the display.
    focused = replace(settings, focus_px=settings.median_px) if settings.focus_px is None else settings
    shot = Shot(
        lambda viewpoint: _along_row(settings.array, viewpoint, rows * cols),
        lambda _, views: light_field.quilt([view.pixels for view in views], rows, cols),
        moves=False,
        grid=(rows, cols),
    )
    return _converging(focused, shot)


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

    return _converging(settings, Shot(places, compose, moves=False))


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
    """The shot with the disparity in focus, if there is one, at the same place in all its views."""
    px, array = settings.focus_px, settings.array
    if px is None:
        return shot

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

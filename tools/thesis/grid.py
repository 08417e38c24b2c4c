"""Tables 6.5 - 6.10: views within a cell of cameras by MLVS, on a grid of 17 x 17 views like Lego's.

The thesis's cells are 5 x 5 and 9 x 9 views wide (1-to-5 and 1-to-9 matching); 17 x 17 is ours. Scored are
the rows and columns that the thesis prints, in the first cell that they cross, at a quarter, half and three
quarters of the way between its cameras. Level 3 goes by both routes; the thesis's goes from left to right.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from pathlib import Path
from threading import Lock
from typing import Self

from mvcodec.array import Position, Viewpoint
from mvcodec.capture import ArraySource, open_input
from mvcodec.errors import InputError
from mvcodec.frames import DecodedSet, DisparityMap, Picture
from mvcodec.layers.splits import LAYER_SPLITS
from mvcodec.stereo.fixed_window import FixedWindow
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.pairwise import Pairwise
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.linear import Linear, LinearSettings
from mvcodec.synthesis.mlvs import Route
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.workers import thread_count
from thesis.lines import BETAS, LINES, SPANS, Line
from thesis.thesis_figures import LayerFigures, Step, ThesisTables, ViewFigures, no_step

FOLDER = "shop_17x17"
LEVELS = (1, 2, 3)
THESIS_METHOD, THESIS_METHOD_WITH_HOLES, THESIS_ROUTE = "DILS", "DILS, holes left", Route.LEFT_RIGHT


@dataclass(frozen=True, slots=True)
class Method:
    """A way to render a cell.

    Attributes:
        name: as printed.
        split: of DILS, or ``linear``.
        filled: whether holes are.
        matched_again: every pair is matched anew, synthesised ones too (the thesis's way); else each
            camera's map is fused from both its neighbours and carried along (the codec's way).
        levels: where it is measured.
    """

    name: str
    split: str
    filled: bool
    matched_again: bool
    levels: tuple[int, ...] = LEVELS

    def synthesizer(self, matcher: PairMatcher, route: Route) -> Synthesizer:
        """What renders."""
        rematch = matcher if self.matched_again else None
        if self.split == "linear":
            return Linear(LinearSettings(self.filled, route, rematch))
        return Dils(DilsSettings(self.split, fill=self.filled, route=route, rematch=rematch))


METHODS = (
    Method("LI", "linear", filled=False, matched_again=True, levels=(1, 2)),
    Method("DILS", "runs", filled=True, matched_again=True),
    Method("DILS, holes left", "runs", filled=False, matched_again=True),
    Method("DILS, carried along", "runs", filled=True, matched_again=False),
    Method("DILS, a layer a level", "levels", filled=True, matched_again=True),
    Method("DILS, a layer a level, holes left", "levels", filled=False, matched_again=True),
    Method("DILS, a layer a level, carried along", "levels", filled=True, matched_again=False),
)


@dataclass(frozen=True, slots=True)
class GridRow:
    """One method at one place of a line.

    Attributes:
        span: a name of SPANS.
        level: of MLVS.
        line: the row or column.
        route: ``ul`` or ``lr`` at level 3; else empty.
        method: a name of METHODS.
        beta: place between the cameras, along the line.
        figures: ours.
        thesis_psnr, thesis_ssim: what the thesis has for the same place of Lego, by the same method and
            route, or None. Its PSNR is psnr_saturated.
    """

    span: str
    level: int
    line: str
    route: str
    method: str
    beta: float
    figures: ViewFigures
    thesis_psnr: float | None
    thesis_ssim: float | None


@dataclass(frozen=True, slots=True)
class GridTable:
    """Tables 6.5 - 6.10.

    Attributes:
        rows: by span, line, route, method and beta.
        layers: by (span, name of the split), of the left map of the upper left cell's upper pair.
    """

    rows: tuple[GridRow, ...]
    layers: Mapping[tuple[str, str], LayerFigures]

    def mean(
        self,
        method: str,
        spans: Iterable[str] = tuple(SPANS),
        levels: Iterable[int] = LEVELS,
        route: str | None = None,
    ) -> ViewFigures:
        """Mean over the rows of a method; over both routes where none is given."""
        spans, levels = tuple(spans), tuple(levels)
        chosen = [r for r in self.rows if r.method == method and r.span in spans and r.level in levels]
        return ViewFigures.mean([row.figures for row in chosen if route in (None, row.route)])


@dataclass(slots=True)
class RememberingMatcher:
    """PairMatcher that matches each pair once, however often it is asked."""

    matcher: PairMatcher
    _found: dict[bytes, tuple[DisparityMap, DisparityMap]] = field(default_factory=dict)
    _lock: Lock = field(default_factory=Lock)

    def match_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[DisparityMap, DisparityMap]:
        """See `PairMatcher.match_pair`."""
        digest = blake2b(repr((left.shape, range_px)).encode())
        digest.update(left.tobytes())
        digest.update(right.tobytes())
        key = digest.digest()
        with self._lock:
            found = self._found.get(key)
        if found is None:
            found = self.matcher.match_pair(left, right, range_px)
            with self._lock:
                self._found[key] = found
        return found


def measure_grid(
    data: Path, thesis: ThesisTables, spans: Sequence[str] = tuple(SPANS), step: Step = no_step
) -> GridTable:
    """Render and compare the scored views of every span.

    Args:
        data: folder with the set.
        spans: names of SPANS.

    Raises:
        InputError: the set is missing, smaller, or has no disparity hint.
    """
    source = open_input([data / FOLDER])
    rows: list[GridRow] = []
    layers: dict[tuple[str, str], LayerFigures] = {}
    for span in spans:
        for top in sorted({line.top for line in LINES if line.span == span}):
            lines = [line for line in LINES if (line.span, line.top) == (span, top)]
            cell = _Cell.read(source, span, top, lines)
            rows += _measure_cell(cell, lines, thesis, step)
            if top == 0:
                left_map = cell.left_map()
                layers |= {(span, split): LayerFigures.measure(left_map, split) for split in LAYER_SPLITS}
    return GridTable(tuple(rows), layers)


def steps(spans: Sequence[str] = tuple(SPANS)) -> int:
    """How often `measure_grid` calls its step."""
    lines = [line for line in LINES if line.span in spans]
    return sum(len(line.routes) for line in lines for method in METHODS if line.level in method.levels)


@dataclass(frozen=True, slots=True, eq=False)
class _Cell:
    """Four cameras at the left edge of the grid as an array of their own, and what is scored between them."""

    decoded: DecodedSet
    originals: Mapping[Position, Picture]
    matcher: RememberingMatcher

    @classmethod
    def read(cls, source: ArraySource, span: str, top: int, lines: Sequence[Line]) -> Self:
        side = SPANS[span]
        if source.array.rows <= top + side or source.array.cols <= side:
            found = f"{source.array.rows}x{source.array.cols} views"
            raise InputError(source.name, found, f"at least {top + side + 1}x{side + 1}")
        ends = (0, side)
        array = replace(source.array, rows=side + 1, cols=side + 1, real_rows=ends, real_cols=ends)
        range_px = array.disparity_hint_px
        if range_px is None:
            raise InputError(source.name, "no disparity_per_step_px", "one, as the search range")
        places = sorted({*array.real, *(line.place(beta) for line in lines for beta in BETAS)})
        (frames,) = source.frame_sets(slice(0, 1), [(top + row, col) for row, col in places])
        originals = {(row, col): frames.pictures[top + row, col] for row, col in places}
        pictures = {camera: originals[camera] for camera in array.real}
        matcher = RememberingMatcher(FixedWindow())
        maps = Pairwise(matcher).match(array, pictures, range_px)
        decoded = DecodedSet(array, frames.index, frames.time_ns, pictures, maps, range_px)
        return cls(decoded, originals, matcher)

    def left_map(self) -> DisparityMap:
        """Of the upper pair."""
        array, pictures = self.decoded.array, self.decoded.pictures
        pair = pictures[0, 0], pictures[0, array.cols - 1]
        return self.matcher.match_pair(*pair, self.decoded.disparity_range_px)[0]


def _measure_cell(cell: _Cell, lines: Sequence[Line], thesis: ThesisTables, step: Step) -> list[GridRow]:
    jobs = [
        (line, method, route)
        for line in lines
        for route in line.routes
        for method in METHODS
        if line.level in method.levels
    ]

    def measure(job: tuple[Line, Method, Route | None]) -> list[GridRow]:
        line, method, route = job
        synthesizer = method.synthesizer(cell.matcher, route or Route.UPPER_LOWER)
        rows = []
        for beta in BETAS:
            place = line.place(beta)
            view = synthesizer.render(cell.decoded, Viewpoint(*place))
            figures = ViewFigures.measure(cell.originals[place], view.pixels, view.seen_by == 0)
            printed = [line.thesis(thesis, entry, beta) for entry in _entries(line, method, route)]
            shown = route.value if route else ""
            rows.append(
                GridRow(line.span, line.level, line.name, shown, method.name, beta, figures, *printed)
            )
        return rows

    found = []
    with ThreadPoolExecutor(thread_count()) as pool:
        for rows in pool.map(measure, jobs):
            found += rows
            step()
    return found


def _entries(line: Line, method: Method, route: Route | None) -> tuple[str | None, str | None]:
    """The thesis's entries of PSNR and SSIM for a method: of what it did itself only."""
    if route not in (None, THESIS_ROUTE):
        return None, None
    if method.name == THESIS_METHOD_WITH_HOLES:
        return None, line.ssim_with_holes
    return (line.psnr, line.ssim) if method.name == THESIS_METHOD else (None, None)

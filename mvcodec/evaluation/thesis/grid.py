"""Tables 6.5 - 6.10: views within a cell of cameras by MLVS, on a grid of 17 x 17 views like Lego's.

The thesis's cells are 5 x 5 and 9 x 9 views wide (1-to-5 and 1-to-9 matching); 17 x 17 is ours. Of each, the
views at a quarter, half and three quarters are scored: at level 1 in the top and bottom row, at level 2
in the left and right column, at level 3 in the middle row, by both routes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from pathlib import Path
from threading import Lock

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import open_input
from mvcodec.errors import InputError
from mvcodec.evaluation.thesis.figures import ThesisTables, ViewFigures
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture
from mvcodec.stereo.fixed_window import FixedWindow
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.pairwise import Pairwise
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.linear import Linear, LinearSettings
from mvcodec.synthesis.mlvs import Route
from mvcodec.synthesis.synthesizer import Synthesizer

FOLDER = "shop_17x17"
SPANS = {"1-to-5": 4, "1-to-9": 8, "1-to-17": 16}
"""Grid steps between the cameras of a cell, by the thesis's name."""

BETAS = (0.25, 0.5, 0.75)
LEVELS = (1, 2, 3)
THREADS = 2


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
        return Dils(DilsSettings(self.split, fill_holes=self.filled, route=route, rematch=rematch))


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
    """One method at one place of a cell.

    Attributes:
        span: a name of SPANS.
        level: of MLVS.
        route: ``ul`` or ``lr`` at level 3; else empty.
        method: a name of METHODS.
        beta: place between the cameras.
        figures: mean over the two rows (level 1) or columns (level 2).
        thesis_ssim: what the thesis has for Lego, or None.
    """

    span: str
    level: int
    route: str
    method: str
    beta: float
    figures: ViewFigures
    thesis_ssim: float | None


@dataclass(frozen=True, slots=True)
class GridTable:
    """Tables 6.5 - 6.10."""

    rows: tuple[GridRow, ...]

    def mean(
        self, method: str, spans: Iterable[str] = tuple(SPANS), levels: Iterable[int] = LEVELS
    ) -> ViewFigures:
        """Mean over the rows of a method."""
        spans, levels = tuple(spans), tuple(levels)
        chosen = [r for r in self.rows if r.method == method and r.span in spans and r.level in levels]
        return ViewFigures.mean([row.figures for row in chosen])


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


def measure_grid(data: Path, thesis: ThesisTables, spans: Sequence[str] = tuple(SPANS)) -> GridTable:
    """Render and compare the scored views of the upper left cell, for every span.

    Args:
        data: folder with the set.
        spans: names of SPANS.

    Raises:
        InputError: the set is missing, smaller, or has no disparity hint.
    """
    source = open_input([data / FOLDER])
    widest = max(SPANS[span] for span in spans) + 1
    if min(source.array.rows, source.array.cols) < widest:
        found = f"{source.array.rows}x{source.array.cols} views"
        raise InputError(source.name, found, f"at least {widest}x{widest}")
    rows: list[GridRow] = []
    for span in spans:
        cell = _cell(source.array, SPANS[span])
        (frames,) = source.frame_sets(slice(0, 1), sorted(set(cell.real) | set(_places(cell))))
        rows += _measure_cell(span, cell, frames, thesis)
    return GridTable(tuple(rows))


def _cell(array: CameraArray, span: int) -> CameraArray:
    """The upper left cell as an array of its own."""
    return replace(array, rows=span + 1, cols=span + 1, real_rows=(0, span), real_cols=(0, span))


def _places(cell: CameraArray) -> list[Position]:
    return [place for level in LEVELS for beta in BETAS for place in _scored(cell, level, beta)]


def _scored(cell: CameraArray, level: int, beta: float) -> list[Position]:
    last = cell.rows - 1
    between = round(beta * last)
    if level == 1:
        return [(0, between), (last, between)]
    return [(between, 0), (between, last)] if level == 2 else [(last // 2, between)]


def _measure_cell(span: str, cell: CameraArray, frames: FrameSet, thesis: ThesisTables) -> list[GridRow]:
    range_px = cell.disparity_hint_px
    if range_px is None:
        raise InputError(FOLDER, "no disparity_per_step_px", "one, as the search range")
    matcher = RememberingMatcher(FixedWindow())
    pictures = {camera: frames.pictures[camera] for camera in cell.real}
    maps = Pairwise(matcher).match(cell, pictures, range_px)
    decoded = DecodedSet(cell, frames.index, frames.time_ns, pictures, maps, range_px)
    jobs = [
        (method, level, route)
        for method in METHODS
        for level in method.levels
        for route in (Route if level == 3 else (Route.UPPER_LOWER,))
    ]

    def measure(job: tuple[Method, int, Route]) -> list[GridRow]:
        method, level, route = job
        synthesizer = method.synthesizer(matcher, route)
        rows = []
        for beta in BETAS:
            figures = [
                ViewFigures.measure(
                    frames.pictures[place], synthesizer.render(decoded, Viewpoint(*place)).pixels
                )
                for place in _scored(cell, level, beta)
            ]
            shown = route.value if level == 3 else ""
            printed = _thesis_ssim(thesis, span, level, method.name, beta)
            rows.append(GridRow(span, level, shown, method.name, beta, ViewFigures.mean(figures), printed))
        return rows

    with ThreadPoolExecutor(THREADS) as pool:
        return [row for rows in pool.map(measure, jobs) for row in rows]


_THESIS_ENTRIES = {
    ("1-to-5", 1, "DILS"): ("table_6_5_lego_level1_1to5", "row1_ssim"),
    ("1-to-5", 1, "DILS, holes left"): ("table_6_5_lego_level1_1to5", "row1_ssim_without_filling"),
    ("1-to-5", 2, "DILS"): ("table_6_6_lego_level2_1to5", "col1_ssim"),
    ("1-to-5", 3, "DILS"): ("table_6_7_lego_level3_1to5", "row7_ssim"),
    ("1-to-9", 1, "DILS"): ("table_6_8_lego_1to9_level1_ssim", "row1"),
    ("1-to-9", 2, "DILS"): ("table_6_9_lego_1to9_level2_ssim", "col1"),
    ("1-to-9", 3, "DILS"): ("table_6_10_lego_1to9_level3_ssim", "row7"),
}
_THESIS_BETAS = {"1-to-5": (0.25, 0.5, 0.75), "1-to-9": (0.25, 0.75)}
"""Of the entries' items; the third item of 1-to-9 is of column 9, a camera."""


def _thesis_ssim(thesis: ThesisTables, span: str, level: int, method: str, beta: float) -> float | None:
    entry = _THESIS_ENTRIES.get((span, level, method))
    if entry is None or beta not in _THESIS_BETAS[span]:
        return None
    return float(thesis.at(*entry, _THESIS_BETAS[span].index(beta)))

"""Table 5.2: bad pixels of disparity maps on the four pairs of the second Middlebury benchmark."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean

import numpy as np

from mvcodec.capture import ArraySource, open_input
from mvcodec.errors import InputError
from mvcodec.evaluation.regions import BadPixels, bad_pixels, regions
from mvcodec.frames import DisparityMap, Picture
from mvcodec.layers import dlr, dlr_thesis
from mvcodec.layers.dlr_thesis import ThesisDlrSettings
from mvcodec.stereo.adcensus import AdCensus
from mvcodec.stereo.consistency import median
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings
from mvcodec.stereo.sgbm import Sgbm
from thesis.thesis_figures import LayerFigures, Step, ThesisTables, no_step

THRESHOLDS_PX = (0.5, 1.0, 2.0)
_MEDIAN_SIZE = 11


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A rectified pair with truth.

    Attributes:
        name: as in the thesis.
        folder: of the data.
        columns: of the left and the right view.
        window: the thesis's SAD window.
    """

    name: str
    folder: str
    columns: tuple[int, int]
    window: int


PAIRS = (
    Pair("Tsukuba", "tsukuba", (2, 3), 11),
    Pair("Venus", "venus", (0, 1), 25),
    Pair("Teddy", "teddy", (0, 1), 21),
    Pair("Cones", "cones", (0, 2), 21),
)

Find = Callable[[Picture, Picture, tuple[float, float], int], DisparityMap]
"""(left, right, range in px, window) -> the left map; valid where a value is the pixel's own, not filled."""


def fixed_window(measure: str) -> Find:
    """One direction, no check, and an 11 x 11 median: the thesis's FW-SAD."""

    def find(left: Picture, right: Picture, range_px: tuple[float, float], window: int) -> DisparityMap:
        (values, _), _ = FixedWindow(FixedWindowSettings(measure, window)).raw_pair(left, right, range_px)
        return DisparityMap(median(values, _MEDIAN_SIZE, range_px), np.ones(values.shape, np.bool_))

    return find


def thesis_dlr(split: str) -> Find:
    """FW-SAD, refined by the thesis's steps, with layers of this split."""

    def find(left: Picture, right: Picture, range_px: tuple[float, float], window: int) -> DisparityMap:
        raw = fixed_window("sad")(left, right, range_px, window)
        return dlr_thesis.refine(left, raw, settings=ThesisDlrSettings(split))

    return find


def our_dlr(left: Picture, right: Picture, range_px: tuple[float, float], window: int) -> DisparityMap:
    """FW-SAD, refined by our DLR."""
    return dlr.refine(left, fixed_window("sad")(left, right, range_px, window))


RAW = "FW-SAD"
THESIS_DLR = "DLR, the thesis's steps"
THESIS_DLR_LEVELS = "DLR, the thesis's steps, a layer a level"
OUR_DLR = "DLR, ours"

METHODS: dict[str, Find] = {
    RAW: fixed_window("sad"),
    THESIS_DLR: thesis_dlr("runs"),
    THESIS_DLR_LEVELS: thesis_dlr("levels"),
    OUR_DLR: our_dlr,
    "SSD+MF": fixed_window("ssd"),
    "ADCensus": lambda left, right, range_px, _: AdCensus().match_pair(left, right, range_px)[0],
    "SGBM": lambda left, right, range_px, _: Sgbm().match_pair(left, right, range_px)[0],
}
"""The thesis's rows, and what it has no counterpart for: a layer a level, our DLR, and SGBM, the codec's."""

THESIS_ROWS = {RAW: "FW-SAD", THESIS_DLR: "SAD-DLR", "SSD+MF": "SSD+MF", "ADCensus": "ADCensus"}
"""The thesis's names of its rows."""

STEPS = len(PAIRS) * len(METHODS)
"""How often `measure_maps` calls its step."""


@dataclass(frozen=True, slots=True)
class MapRow:
    """One method on one pair.

    Attributes:
        method, pair: which.
        rates: by threshold of THRESHOLDS_PX.
        own_share: of the pixels (0..1) whose value is their own, not filled in.
        thesis_percent: (non-occluded, all, discontinuity) at 1 px, or None where it has no such row.
    """

    method: str
    pair: str
    rates: tuple[BadPixels, ...]
    own_share: float
    thesis_percent: tuple[float, float, float] | None

    @property
    def bad1(self) -> BadPixels:
        """Rates at 1 px."""
        return self.rates[THRESHOLDS_PX.index(1.0)]


@dataclass(frozen=True, slots=True)
class MapTable:
    """Table 5.2.

    Attributes:
        rows: by pair and method.
        layers: by pair, the thesis's split of FW-SAD's map.
    """

    rows: tuple[MapRow, ...]
    layers: Mapping[str, LayerFigures]

    def of(self, method: str) -> tuple[MapRow, ...]:
        """The rows of a method, by pair."""
        return tuple(row for row in self.rows if row.method == method)

    def average_percent(self, method: str) -> float:
        """Mean of the twelve figures at 1 px, the last column of the thesis's table."""
        rates = [row.bad1 for row in self.of(method)]
        return 100 * fmean(
            [share for rate in rates for share in (rate.non_occluded, rate.all, rate.discontinuity)]
        )


def measure_maps(data: Path, thesis: ThesisTables, step: Step = no_step) -> MapTable:
    """Match the four pairs by every method and score the left maps.

    Args:
        data: folder with the sets.

    Raises:
        InputError: a set is missing, or has no truth or disparity hint.
    """
    columns = list(thesis.at("table_5_2_bad1_percent", "columns"))
    rows = []
    layers = {}
    for pair in PAIRS:
        source = open_input([data / pair.folder])
        truth, range_px = _truth(source, pair, 0), _range(source, pair)
        if truth is None:
            raise InputError(source.name, f"no truth of column {pair.columns[0]}", "one")
        scored = regions(truth, _truth(source, pair, 1))
        (frames,) = source.frame_sets(slice(0, 1), [(0, column) for column in pair.columns])
        left, right = (frames.pictures[0, column] for column in pair.columns)
        first = columns.index(f"{pair.name} nonocc")
        for method, find in METHODS.items():
            found = find(left, right, range_px, pair.window)
            rates = tuple(bad_pixels(scored, found.values_px, threshold) for threshold in THRESHOLDS_PX)
            theirs = None
            if method in THESIS_ROWS:
                printed = thesis.at("table_5_2_bad1_percent", THESIS_ROWS[method])
                theirs = tuple(printed[first : first + 3])
            rows.append(MapRow(method, pair.name, rates, float(found.valid.mean()), theirs))
            if method == RAW:
                layers[pair.name] = LayerFigures.measure(found, "runs")
            step()
    return MapTable(tuple(rows), layers)


def _truth(source: ArraySource, pair: Pair, end: int) -> DisparityMap | None:
    truth = source.truth((0, pair.columns[end]), 0)
    if truth is None:
        return truth
    steps = np.float32(pair.columns[1] - pair.columns[0])
    return replace(truth, values_px=truth.values_px * steps)


def _range(source: ArraySource, pair: Pair) -> tuple[float, float]:
    hint = source.array.disparity_per_step_px
    if hint is None:
        raise InputError(source.name, "no disparity_per_step_px", "one, as the search range")
    steps = pair.columns[1] - pair.columns[0]
    return hint[0] * steps, hint[1] * steps

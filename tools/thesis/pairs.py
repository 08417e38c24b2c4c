"""Tables 4.2 - 4.5: views between the two ends of a Middlebury set, by linear interpolation and by DILS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mvcodec.array import Position, Viewpoint
from mvcodec.capture import ArraySource, open_input
from mvcodec.errors import InputError
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet
from mvcodec.layers.splits import LAYER_SPLITS
from mvcodec.stereo.adcensus import AdCensus
from mvcodec.stereo.fixed_window import FixedWindow, FixedWindowSettings
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.pairwise import Pairwise
from mvcodec.synthesis.dils import Dils, DilsSettings
from mvcodec.synthesis.linear import Linear, LinearSettings
from mvcodec.synthesis.synthesizer import Synthesizer
from thesis.thesis_figures import LayerFigures, Step, ThesisTables, ViewFigures, no_step

WINDOWS = {"Tsukuba": 11, "Cones": 21}
"""The thesis's SAD windows, of the sets that have a view in between here; Teddy and Venus have none."""


@dataclass(frozen=True, slots=True)
class Method:
    """A row of the tables.

    Attributes:
        name: as printed.
        map_name: ``SAD`` (checked from left and right, holes left) or ``AD-Census`` (dense).
        synthesizer: what renders.
        thesis: name of the thesis's rows, or None for ours.
    """

    name: str
    map_name: str
    synthesizer: Callable[[], Synthesizer]
    thesis: str | None = None


METHODS = (
    Method("LI, SAD", "SAD", Linear, "LI"),
    Method("LI, SAD, holes filled", "SAD", lambda: Linear(LinearSettings(fill=True))),
    Method("DILS, SAD", "SAD", Dils, "DILS_SAD"),
    Method("DILS, SAD, a layer a level", "SAD", lambda: Dils(DilsSettings("levels"))),
    Method("DILS, AD-Census", "AD-Census", Dils, "DILS_ADCensus"),
    Method("DILS, AD-Census, a layer a level", "AD-Census", lambda: Dils(DilsSettings("levels"))),
)


@dataclass(frozen=True, slots=True)
class PairRow:
    """One view by one method.

    Attributes:
        set_name, method, beta: which.
        figures: ours.
        thesis_psnr, thesis_ssim: the thesis's, or None where it has no such row. Its PSNR is psnr_saturated.
    """

    set_name: str
    method: str
    beta: float
    figures: ViewFigures
    thesis_psnr: float | None
    thesis_ssim: float | None


@dataclass(frozen=True, slots=True)
class PairTable:
    """Tables 4.2 - 4.5.

    Attributes:
        rows: by set, method and beta.
        layers: by (set, map name, name of the split), of the left map.
    """

    rows: tuple[PairRow, ...]
    layers: Mapping[tuple[str, str, str], LayerFigures]

    def mean(self, set_name: str, method: str) -> ViewFigures:
        """Mean over the betas."""
        return ViewFigures.mean(
            [row.figures for row in self.rows if (row.set_name, row.method) == (set_name, method)]
        )


STEPS = len(WINDOWS) * len(METHODS)
"""How often `measure_pairs` calls its step."""


def measure_pairs(data: Path, thesis: ThesisTables, step: Step = no_step) -> PairTable:
    """Synthesise and compare every view between the ends of Tsukuba and Cones.

    Args:
        data: folder with the sets.

    Raises:
        InputError: a set is missing, or has no disparity hint.
    """
    rows: list[PairRow] = []
    layers: dict[tuple[str, str, str], LayerFigures] = {}
    for set_name, window in WINDOWS.items():
        source = open_input([data / set_name.lower()])
        (frames,) = source.frame_sets(slice(0, 1), source.array.positions)
        decoded = {
            "SAD": _decoded(source, FixedWindow(FixedWindowSettings("sad", window)), dense=False),
            "AD-Census": _decoded(source, AdCensus(), dense=True),
        }
        for map_name, decoded_set in decoded.items():
            for split in LAYER_SPLITS:
                figures = LayerFigures.measure(decoded_set.disparities[0, 0], split, DilsSettings().threshold)
                layers[set_name, map_name, split] = figures
        for method in METHODS:
            rows += _measure_method(set_name, method, frames, decoded[method.map_name], thesis)
            step()
    return PairTable(tuple(rows), layers)


def _measure_method(
    set_name: str, method: Method, frames: FrameSet, decoded: DecodedSet, thesis: ThesisTables
) -> list[PairRow]:
    betas = list(thesis.at("table_4_2_4_3", "beta"))
    last = decoded.array.cols - 1
    rows = []
    for col in range(1, last):
        view = method.synthesizer().render(decoded, Viewpoint(0, col))
        figures = ViewFigures.measure(frames.pictures[0, col], view.pixels, view.seen_by == 0)
        printed: list[float | None] = [None, None]
        if method.thesis is not None:
            place = ("table_4_2_4_3", method.thesis)
            printed = [thesis.at(*place, f, set_name, betas.index(col / last)) for f in ("psnr", "ssim")]
        rows.append(PairRow(set_name, method.name, col / last, figures, *printed))
    return rows


def _decoded(source: ArraySource, matcher: PairMatcher, *, dense: bool) -> DecodedSet:
    """The two ends and their maps, uncoded.

    Args:
        dense: trust the matcher's own repair of what it could not match (AD-Census, as in the thesis).
    """
    array, range_px = source.array, source.array.disparity_hint_px
    if range_px is None:
        raise InputError(source.name, "no disparity_per_step_px", "one, as the search range")
    (frames,) = source.frame_sets(slice(0, 1))
    maps: Mapping[Position, DisparityMap] = Pairwise(matcher).match(array, frames.pictures, range_px)
    if dense:
        maps = {
            camera: replace(disparity, valid=np.ones_like(disparity.valid))
            for camera, disparity in maps.items()
        }
    return DecodedSet(array, frames.index, frames.time_ns, frames.pictures, maps, range_px)

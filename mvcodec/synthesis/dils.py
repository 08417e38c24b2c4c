"""View synthesis by depth layers, as the thesis has it (DILS, 4.3.2.4 - 4.3.2.9).

Each layer is one rigid plane: the right picture is moved onto the left one by the layer's average
disparity (equation 4.15), masked (4.16), blended (4.17) and moved to the virtual camera (4.18); the layers
are laid over each other, far to near (4.20). Occluded pixels (layer 0) are left out and their places filled
along the row (4.3.2.9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Viewpoint
from mvcodec.frames import DecodedSet, LayerStack, RenderedView
from mvcodec.layers.dils_split import THRESHOLD, average_px
from mvcodec.layers.splits import LAYER_SPLITS
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.matchers import make_pair_matcher
from mvcodec.synthesis import mlvs
from mvcodec.synthesis.mlvs import ROUTE_HELP, Route, View
from mvcodec.synthesis.rematch import REMATCH_HELP, Rematched
from mvcodec.synthesis.rows import forward_pair


@dataclass(frozen=True, slots=True)
class DilsSettings:
    """Settings of DILS; the defaults are the thesis's, but that the decoded maps are carried along.

    Raises:
        SettingError: a setting is outside its range.
    """

    split: str = setting("runs", "how a map is split into layers; runs: the thesis's", choices=LAYER_SPLITS)
    threshold: int = setting(THRESHOLD, "T of the split (equation 4.9), pixels", low=0)
    alpha: float = setting(0.5, "share of the left picture in the blend (4.17)", low=0, high=1)
    fill: bool = setting(True, "fill holes along the row; no: leave them black")
    route: Route = setting(Route.UPPER_LOWER, ROUTE_HELP)
    rematch: PairMatcher | None = setting(None, REMATCH_HELP, parse=make_pair_matcher)

    def __post_init__(self) -> None:
        check_settings(self, "DilsSettings.")


class Dils:
    """DILS through MLVS levels 1 - 3: a Synthesizer, and a PairSynthesizer for one pair."""

    def __init__(self, settings: DilsSettings | None = None) -> None:
        self.settings = settings or DilsSettings()

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """See `Synthesizer.render`; `disparity_px` is the pixels' own, not their layers' average."""
        matcher = self.settings.rematch
        pairs = Rematched(self, matcher, decoded.disparity_range_px) if matcher else self
        return mlvs.render(decoded, viewpoint, pairs, self.settings.route)

    def synthesize_pair(self, left: View, right: View, beta: float, px_per_disparity: float) -> View:
        """See `PairSynthesizer.synthesize_pair`. Shifts are whole px, halves rounded to even."""
        layers = LAYER_SPLITS[self.settings.split](left.disparity, self.settings.threshold)
        return forward_pair(
            left,
            right,
            shift_px=_shifts(layers, beta * px_per_disparity),
            right_shift_px=_shifts(layers, px_per_disparity),
            nearness=layers.labels.astype(np.float32),
            usable=layers.labels > 0,
            left_weight=self.settings.alpha,
            fill_holes=self.settings.fill,
        )


def _shifts(layers: LayerStack, px_per_disparity: float) -> NDArray[np.int32]:
    # Halves go to the even shift: to one side, they would move the whole picture by a quarter px.
    by_layer = [round(px_per_disparity * average_px(bounds)) for bounds in layers.bounds_px]
    return np.array([0, *by_layer], np.int32)[layers.labels]

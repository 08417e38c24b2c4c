"""Conventional linear interpolation between two views: the thesis's baseline (equation 4.4).

A forward mapping with holes: left pixel x of disparity d goes to ``x - round(beta * d)``, nearest last,
invalid pixels skipped, holes left black; its colour is ``(1 - beta) * L(x) + beta * R(x - round(d))``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import MAX_PICTURE_SIDE, Viewpoint
from mvcodec.frames import DecodedSet, FloatMap, RenderedView
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.matchers import make_pair_matcher
from mvcodec.synthesis import mlvs
from mvcodec.synthesis.mlvs import ROUTE_HELP, Route, View
from mvcodec.synthesis.rematch import REMATCH_HELP, Rematched
from mvcodec.synthesis.rows import forward_pair


@dataclass(frozen=True, slots=True)
class LinearSettings:
    """Settings of linear interpolation; the defaults are the thesis's, but that the decoded maps are used.

    Raises:
        SettingError: a setting is outside its range.
    """

    fill: bool = setting(False, "fill holes along the row, as DILS does; no: leave them black")
    route: Route = setting(Route.UPPER_LOWER, ROUTE_HELP)
    rematch: PairMatcher | None = setting(None, REMATCH_HELP, parse=make_pair_matcher)

    def __post_init__(self) -> None:
        check_settings(self, "LinearSettings.")


class Linear:
    """Linear interpolation through MLVS levels 1 - 3: a Synthesizer, and a PairSynthesizer for one pair."""

    def __init__(self, settings: LinearSettings | None = None) -> None:
        self.settings = settings or LinearSettings()

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """See `Synthesizer.render`."""
        matcher = self.settings.rematch
        pairs = Rematched(self, matcher, decoded.disparity_range_px) if matcher else self
        return mlvs.render(decoded, viewpoint, pairs, self.settings.route)

    def synthesize_pair(self, left: View, right: View, beta: float, px_per_disparity: float) -> View:
        """See `PairSynthesizer.synthesize_pair`. Shifts are whole px, halves rounded to even."""
        disparity = left.disparity
        return forward_pair(
            left,
            right,
            shift_px=_shifts(disparity.values_px, beta * px_per_disparity),
            right_shift_px=_shifts(disparity.values_px, px_per_disparity),
            nearness=disparity.values_px,
            usable=disparity.valid,
            left_weight=1 - beta,
            fill_holes=self.settings.fill,
        )


def _shifts(disparity_px: FloatMap, px_per_disparity: float) -> NDArray[np.int32]:
    # Halves go to the even shift: to one side, they would move the whole picture by a quarter px. A shift
    # past the widest picture leads nowhere, whatever its size; cut there, it fits the integer.
    limit = MAX_PICTURE_SIDE
    shifts: NDArray[np.int32] = np.rint(np.clip(disparity_px * px_per_disparity, -limit, limit)).astype(
        np.int32
    )
    return shifts

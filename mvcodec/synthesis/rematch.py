"""MLVS as the thesis has it: the two pictures of every pair are matched, synthesised ones too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvcodec.frames import DisparityMap
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.synthesis.mlvs import PairSynthesizer, View

REMATCH_HELP = (
    "matches the pictures of every pair anew, as the thesis does; none: decoded maps are carried along"
)


@dataclass(frozen=True, slots=True)
class Rematched:
    """PairSynthesizer that matches the pair before another one synthesises from it.

    Whatever map the left view brought is replaced: at levels 1 and 2 by that of the pair of cameras alone,
    at level 3 (6.5.3) by that of the synthesised pictures, where the codec carries disparity along.

    Attributes:
        pairs: what synthesises.
        matcher: of rectified pairs.
        range_px: (lo, hi) of disparity between neighbouring real cameras.
    """

    pairs: PairSynthesizer
    matcher: PairMatcher
    range_px: tuple[float, float]

    def synthesize_pair(self, left: View, right: View, beta: float, px_per_disparity: float) -> View:
        """See `PairSynthesizer.synthesize_pair`."""
        span = self.range_px[0] * px_per_disparity, self.range_px[1] * px_per_disparity
        matched, _ = self.matcher.match_pair(left.pixels, right.pixels, span)
        values = matched.values_px / np.float32(px_per_disparity)
        again = View(left.pixels, DisparityMap(values, matched.valid), left.seen_by)
        return self.pairs.synthesize_pair(again, right, beta, px_per_disparity)

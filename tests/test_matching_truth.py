"""Bad pixels against the ground truth of the Middlebury pairs."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask, Picture
from mvcodec.stereo.adcensus import AdCensus
from mvcodec.stereo.fixed_window import FixedWindow
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.stereo.sgbm import Sgbm

DATA = Path(__file__).parents[2] / "shared" / "data"

pytestmark = [
    pytest.mark.shared_data,
    pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is absent"),
]


class Pair:
    """First and last view of a linear array, with the truth of both."""

    def __init__(self, name: str) -> None:
        self._folder = DATA / name
        self._listed = json.loads((self._folder / "array.json").read_text())
        self._last = self._listed["cols"] - 1

    def picture(self, last: bool) -> Picture:
        read = cv2.imread(str(self._folder / self._listed["views"][0][self._last * last][0]))
        assert read is not None
        return np.asarray(cv2.cvtColor(read, cv2.COLOR_BGR2RGB), np.uint8)

    def truth(self, last: bool) -> tuple[FloatMap, Mask]:
        entry = self._listed["truth"][f"r00_c{self._last * last:02d}"]
        read = cv2.imread(str(self._folder / entry["file"]), cv2.IMREAD_GRAYSCALE)
        assert read is not None
        assert abs(entry["steps"]) == self._last
        return (read / entry["scale"]).astype(np.float32), np.asarray(read != entry["invalid"])

    def seen_by_both(self, last: bool) -> NDArray[np.bool_]:
        """Where the two truth maps agree within 1 px."""
        values, known = self.truth(last)
        other, other_known = self.truth(not last)
        columns = np.arange(values.shape[1])[None] + np.rint(values).astype(int) * (1 if last else -1)
        inside = (columns >= 0) & (columns < values.shape[1])
        columns = columns.clip(0, values.shape[1] - 1)
        rows = np.arange(len(values))[:, None]
        agree = np.abs(values - other[rows, columns]) <= 1
        return np.asarray(known & inside & other_known[rows, columns] & agree)


@pytest.mark.parametrize(
    ("matcher", "name", "most_bad_percent"),
    [
        (Sgbm(), "cones", 4.6),
        (Sgbm(), "teddy", 9.5),
        (FixedWindow(), "cones", 15.0),
        (FixedWindow(), "teddy", 20.0),
        (AdCensus(), "cones", 3.7),
        (AdCensus(), "teddy", 6.0),
    ],
    ids=["sgbm-cones", "sgbm-teddy", "sad-cones", "sad-teddy", "adcensus-cones", "adcensus-teddy"],
)
def test_bad_pixels_where_both_cameras_see(matcher: PairMatcher, name: str, most_bad_percent: float) -> None:
    pair = Pair(name)
    maps = matcher.match_pair(pair.picture(False), pair.picture(True), (4.0, 56.0))
    for last, disparity in enumerate(maps):
        error = np.abs(disparity.values_px - pair.truth(bool(last))[0])
        counted = pair.seen_by_both(bool(last))
        assert counted.mean() > 0.6
        assert 100 * np.mean(error[counted] > 1) <= most_bad_percent

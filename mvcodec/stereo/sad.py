"""Fixed-window matching of a pair: the thesis's own matcher (equations 3.4, 4.5, 4.6)."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.stereo.consistency import cross_check

_BANDS = 2


@dataclass(frozen=True, slots=True)
class SadSettings:
    """Settings of `Sad`. The thesis: 21 for Cones and Teddy, 11 for Tsukuba, 25 for Venus.

    Attributes:
        window: side of the square window, px, odd.
        tolerance_px: of the left-right check.
        median_size: side of the final median, odd, or 0 for none.
        subpixel: whether a parabola refines the winner (the thesis has whole pixels).
    """

    window: int = 21
    tolerance_px: float = 1.0
    median_size: int = 11
    subpixel: bool = False

    def __post_init__(self) -> None:
        if self.window % 2 == 0 or not 1 <= self.window <= 101:
            raise SettingError("sad.window", self.window, "an odd number 1..101")
        if self.median_size and (self.median_size % 2 == 0 or not 1 <= self.median_size <= 101):
            raise SettingError("sad.median_size", self.median_size, "0 or an odd number 1..101")
        if not self.tolerance_px >= 0:
            raise SettingError("sad.tolerance_px", self.tolerance_px, "0 or more")


@dataclass(frozen=True, slots=True)
class Sad:
    """PairMatcher by SAD over a fixed window, winner takes all, both directions."""

    settings: SadSettings = SadSettings()

    def match_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[DisparityMap, DisparityMap]:
        """See `PairMatcher.match_pair`. Whole pixels are tried; a range without any, rounded out."""
        from mvcodec.kernels.sad import sad_band  # noqa: PLC0415  (Numba is slow to import)

        settings = self.settings
        height, width = left.shape[:2]
        low = min(max(math.floor(range_px[0]), 1 - width), width - 1)
        levels = max(min(math.ceil(range_px[1]), width - 1) - low + 1, 1)
        maps = np.empty((2, height, width), np.float32)
        left, right = np.ascontiguousarray(left), np.ascontiguousarray(right)
        edges = np.linspace(0, height, _BANDS + 1).astype(int).tolist()
        with ThreadPoolExecutor(_BANDS) as pool:
            list(
                pool.map(
                    lambda start, stop: sad_band(
                        left, right, low, levels, settings.window // 2, settings.subpixel, start, stop, *maps
                    ),
                    edges[:-1],
                    edges[1:],
                )
            )
        return cross_check(
            _known(maps[0]),
            _known(maps[1]),
            range_px,
            tolerance_px=settings.tolerance_px,
            median_size=settings.median_size,
        )


def _known(values: FloatMap) -> tuple[FloatMap, Mask]:
    known = np.isfinite(values)
    return np.where(known, values, np.float32(0)), known

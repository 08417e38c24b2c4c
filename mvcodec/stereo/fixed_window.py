"""Fixed-window matching of a pair, winner takes all: the thesis's own matchers (equations 3.4 - 3.7, 4.6)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.consistency import cross_check

_CENSUS_RADIUS = 2
_LEAST_VARIANCE = 1.0
"""Grey levels squared; flatter windows count as having this much, since correlation is undefined there."""

_Pixel = TypeVar("_Pixel", bound=np.generic)

Costs = NDArray[np.float32]
"""float32 (H, W), of the left picture's pixels at one whole disparity; smaller is better."""


def sad(left: Picture, right: Picture, window: int) -> Callable[[int], Costs]:
    """Sum of absolute differences (3.4), over the channels too."""

    def costs(disparity: int) -> Costs:
        return _over_channels(_window_sum(cv2.absdiff(left, _moved(right, disparity)), window))

    return costs


def ssd(left: Picture, right: Picture, window: int) -> Callable[[int], Costs]:
    """Sum of squared differences (3.5), over the channels too."""

    def costs(disparity: int) -> Costs:
        difference = cv2.absdiff(left, _moved(right, disparity)).astype(np.float32)
        return _over_channels(_window_sum(difference * difference, window))

    return costs


def ncc(left: Picture, right: Picture, window: int) -> Callable[[int], Costs]:
    """Normalised cross correlation (3.6) of luma less the windows' means, negated.

    Without the means every bright window correlates with every other one.
    """
    first, second = (
        cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32) for picture in (left, right)
    )

    def mean(plane: Costs) -> Costs:
        return _window_sum(plane, window) / np.float32(window * window)

    first_mean = mean(first)
    first_variance = mean(first * first) - first_mean * first_mean

    def costs(disparity: int) -> Costs:
        moved = _moved(second, disparity)
        moved_mean = mean(moved)
        variance = mean(moved * moved) - moved_mean * moved_mean
        covariance = mean(first * moved) - first_mean * moved_mean
        product = np.maximum(first_variance, _LEAST_VARIANCE) * np.maximum(variance, _LEAST_VARIANCE)
        return np.asarray(-covariance / np.sqrt(product), np.float32)

    return costs


def census(left: Picture, right: Picture, window: int) -> Callable[[int], Costs]:
    """Sum of Hamming distances (3.7) of 5 x 5 census transforms of luma."""
    from mvcodec.kernels.census import census_transform

    first, second = (
        census_transform(
            np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8), _CENSUS_RADIUS, _CENSUS_RADIUS
        )
        for picture in (left, right)
    )

    def costs(disparity: int) -> Costs:
        return _window_sum(np.bitwise_count(first ^ _moved(second, disparity)), window)

    return costs


MEASURES: dict[str, Callable[[Picture, Picture, int], Callable[[int], Costs]]] = {
    "sad": sad,
    "ssd": ssd,
    "ncc": ncc,
    "census": census,
}


@dataclass(frozen=True, slots=True)
class FixedWindowSettings:
    """Settings of `FixedWindow`; the thesis's map of SAD: 21 (Cones, Teddy), 11 (Tsukuba), 25 (Venus).

    Attributes:
        measure: a name of MEASURES.

    Raises:
        SettingError: a setting is outside its range.
    """

    measure: str = "sad"
    window: int = setting(
        21, "side of the square window, px", choices=range(1, 102, 2), expected="an odd number 1..101"
    )
    tolerance_px: float = setting(1.0, "of the left-right check, px", low=0)
    median_size: int = setting(
        11,
        "side of the final median, px; 0: none",
        choices=(0, *range(1, 102, 2)),
        expected="0 or an odd number 1..101",
    )
    subpixel: bool = setting(False, "a parabola refines the winner (the thesis has whole pixels)")

    def __post_init__(self) -> None:
        if self.measure not in MEASURES:
            raise SettingError("fixed window.measure", self.measure, "one of " + ", ".join(MEASURES))
        check_settings(self, f"{self.measure}.")


@dataclass(frozen=True, slots=True)
class FixedWindow:
    """PairMatcher by costs over a fixed window, winner takes all, both directions from one cost."""

    settings: FixedWindowSettings = FixedWindowSettings()

    def match_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[DisparityMap, DisparityMap]:
        """See `PairMatcher.match_pair`. Whole pixels are tried; a range without any, rounded out."""
        settings = self.settings
        return cross_check(
            *self.raw_pair(left, right, range_px),
            range_px,
            tolerance_px=settings.tolerance_px,
            median_size=settings.median_size,
        )

    def raw_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[tuple[FloatMap, Mask], tuple[FloatMap, Mask]]:
        """The winners, unchecked: (values in px, where there is one) of left and right.

        Pixels have none where every candidate lies outside the other picture.
        """
        width = left.shape[1]
        low = min(max(math.floor(range_px[0]), 1 - width), width - 1)
        high = max(min(math.ceil(range_px[1]), width - 1), low)
        costs_at = MEASURES[self.settings.measure](left, right, self.settings.window)
        left_winners, right_winners = _Winners(left.shape[:2]), _Winners(left.shape[:2])
        for disparity in range(low, high + 1):
            costs = costs_at(disparity)
            in_left = slice(max(disparity, 0), width + min(disparity, 0))
            in_right = slice(max(-disparity, 0), width + min(-disparity, 0))
            left_winners.push(disparity, in_left, costs[:, in_left])
            right_winners.push(disparity, in_right, costs[:, in_left])
        subpixel = self.settings.subpixel
        return left_winners.result(subpixel), right_winners.result(subpixel)


class _Winners:
    """The cheapest whole disparity of each pixel (the lowest of equals) and the costs beside it."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._cheapest, self._below, self._above, self._last = (
            np.full(shape, np.inf, np.float32) for _ in range(4)
        )
        self._winner = np.zeros(shape, np.int32)

    def push(self, disparity: int, columns: slice, costs: Costs) -> None:
        """Take the costs of the next disparity; pixels outside `columns` cannot have it."""
        here = np.full_like(self._last, np.inf)
        here[:, columns] = costs
        follows = np.isfinite(self._cheapest) & (self._winner == disparity - 1)
        np.copyto(self._above, here, where=follows)
        wins = here < self._cheapest
        np.copyto(self._below, self._last, where=wins)
        np.copyto(self._above, np.float32(np.inf), where=wins)
        np.copyto(self._cheapest, here, where=wins)
        np.copyto(self._winner, np.int32(disparity), where=wins)
        self._last = here

    def result(self, subpixel: bool) -> tuple[FloatMap, Mask]:
        """The winners in px, refined by a parabola if wanted, and where there is one."""
        values = self._winner.astype(np.float32)
        if subpixel:
            sure = np.isfinite(self._below) & np.isfinite(self._above)
            below, above = np.where(sure, self._below, 0), np.where(sure, self._above, 0)
            bend = below + above - 2 * np.where(sure, self._cheapest, 0)
            bent = sure & (bend > 0)
            values += np.where(bent, 0.5 * (below - above) / np.where(bent, bend, 1), 0)
        return values, np.isfinite(self._cheapest)


def _moved(pixels: NDArray[_Pixel], disparity: int) -> NDArray[_Pixel]:
    """``result(x) = pixels(x - disparity)``, repeated beyond the border."""
    width = pixels.shape[1]
    return pixels.take((np.arange(width) - disparity).clip(0, width - 1), axis=1)


def _window_sum(plane: NDArray[Any], window: int) -> NDArray[np.float32]:
    """Sum over a window; costs (not pixels) are repeated beyond the border."""
    sums = cv2.boxFilter(
        plane, cv2.CV_32F, (window, window), normalize=False, borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray(sums, np.float32)


def _over_channels(windows: NDArray[np.float32]) -> Costs:
    return np.asarray(cv2.transform(windows, np.ones((1, 3), np.float32)), np.float32)

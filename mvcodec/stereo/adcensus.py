"""AD-Census: colour and census costs, crosses, scanlines, and repair in several steps.

Mei, Sun, Zhou, Jiao, Wang, Zhang: On building an accurate stereo matching system on graphics hardware,
ICCV Workshops 2011. Section and symbol names below are the paper's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.consistency import median
from mvcodec.workers import run_in_bands

_CENSUS_RADIUS_X, _CENSUS_RADIUS_Y = 4, 3
_OUTSIDE_COST = 1.0
"""Where a pixel would lie outside the other picture: half of the largest cost, since nothing is known."""

_EDGE_SHARES = (1.0, 1 / 4, 1 / 10)
"""Of the scanlines' penalties, where no, one or both pictures change colour."""

_VOTING_ROUNDS = 5
_DIRECTIONS = 16
_MAP_EDGE = 5
"""Sobel response, |x| + |y|, above which a pixel lies on an edge of the map; a step of 2 px gives 8."""

_MEDIAN_SIZE = 3

_Levels = NDArray[np.int32]
_Volume = NDArray[np.float32]
_Arms = NDArray[np.int16]


@dataclass(frozen=True, slots=True)
class AdCensusSettings:
    """Settings of `AdCensus`; the defaults are the paper's, but for the tolerance (0 there).

    Raises:
        SettingError: a setting is outside its range.
    """

    lambda_difference: float = setting(10.0, "what the cost of colour is truncated by", low=1e-3)
    lambda_census: float = setting(30.0, "what the cost of census is truncated by", low=1e-3)
    reach: int = setting(34, "L1 of the crosses, px", low=1, high=1000)
    near_reach: int = setting(17, "L2 of the crosses, px, at most reach", low=1, high=1000)
    colour: int = setting(20, "tau1 of the crosses, grey levels", low=0, high=256)
    far_colour: int = setting(6, "tau2 of the crosses, grey levels", low=0, high=256)
    rounds: int = setting(4, "of aggregation, rows first and columns first in turn", low=0)
    step_penalty: float = setting(1.0, "pi1 of the scanlines, at most jump_penalty", low=0)
    jump_penalty: float = setting(3.0, "pi2 of the scanlines", low=0)
    edge_colour: int = setting(15, "tau_SO of the scanlines, grey levels", low=0, high=256)
    least_votes: int = setting(20, "tau_S of region voting", low=0)
    least_share: float = setting(0.4, "tau_H of region voting", low=0, high=1)
    tolerance_px: int = setting(1, "of the left-right check, px", low=0)

    def __post_init__(self) -> None:
        check_settings(self, "adcensus.")
        if not self.near_reach <= self.reach:
            found = f"{self.near_reach}, {self.reach}"
            raise SettingError("adcensus.near_reach, reach", found, "1 <= near_reach <= reach <= 1000")
        if not self.step_penalty <= self.jump_penalty:
            found = f"{self.step_penalty}, {self.jump_penalty}"
            raise SettingError("adcensus.step_penalty, jump_penalty", found, "0 <= step <= jump")


@dataclass(frozen=True, slots=True)
class AdCensus:
    """PairMatcher by AD-Census, both directions in full, to parts of a pixel.

    At work it holds three volumes of 4 bytes for each pixel and disparity.
    """

    settings: AdCensusSettings = AdCensusSettings()

    def match_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[DisparityMap, DisparityMap]:
        """See `PairMatcher.match_pair`. Whole pixels are tried; a range without any, rounded out."""
        width = left.shape[1]
        low = min(max(math.floor(range_px[0]), 1 - width), width - 1)
        count = max(min(math.ceil(range_px[1]), width - 1) - low + 1, 1)
        # Seen in a mirror, the right camera is the left one, with the same signs.
        first = _Direction(left, right, low, count, self.settings)
        second = _Direction(_mirror(right), _mirror(left), low, count, self.settings)
        left_map = first.repaired(_mirror(second.winners), range_px)
        right_map = second.repaired(_mirror(first.winners), range_px)
        return left_map, DisparityMap(_mirror(right_map.values_px), _mirror(right_map.valid))


class _Direction:
    """The optimised costs of one picture against its right neighbour, and their winners.

    Attributes:
        volume: float32 (H, W, count).
        arms: int16 (H, W, 4), of the crosses.
        winners: int32 (H, W), levels: whole disparity less `low`.
    """

    def __init__(
        self, first: Picture, second: Picture, low: int, count: int, settings: AdCensusSettings
    ) -> None:
        from mvcodec.kernels import cost_volume as kernels

        first, second = np.ascontiguousarray(first), np.ascontiguousarray(second)
        self._picture, self._low, self._settings = first, low, settings
        self.arms: _Arms = kernels.cross_arms(
            first, settings.reach, settings.near_reach, settings.colour, settings.far_colour
        )
        costs = _costs(first, second, low, count, settings)
        spare = np.empty_like(costs)
        _aggregate(costs, spare, self.arms, settings.rounds)
        _follow_scanlines(costs, spare, (first, second), low, settings)
        self.volume = spare
        self.winners: _Levels = np.empty(first.shape[:2], np.int32)
        _in_bands(len(first), partial(kernels.cheapest_levels, self.volume), self.winners)

    def repaired(self, others: _Levels, range_px: tuple[float, float]) -> DisparityMap:
        """Section 2.4: outliers out, votes, interpolation, edges, sub-pixels, median.

        Args:
            others: int32 (H, W), winners of the second picture.
        """
        from mvcodec.kernels import disparity_repair as kernels

        settings, count = self._settings, self.volume.shape[2]
        valid, hidden = self._check(others)
        levels = np.where(valid, self.winners, np.int32(-1))
        for _ in range(_VOTING_ROUNDS):
            levels = kernels.vote(levels, self.arms, count, settings.least_votes, settings.least_share)
        angles = np.arange(_DIRECTIONS) * (2 * np.pi / _DIRECTIONS)
        directions = np.stack([np.sin(angles), np.cos(angles)], axis=1)
        levels = kernels.interpolate(levels, hidden, self._picture, directions)
        levels = np.maximum(levels, 0)  # of a map without any valid pixel
        levels = kernels.settle_edges(levels, _map_edges(levels), self.volume)
        values: FloatMap = kernels.parabola_peaks(levels, self.volume) + np.float32(self._low)
        return DisparityMap(median(values.clip(*range_px), _MEDIAN_SIZE, range_px), valid)

    def _check(self, others: _Levels) -> tuple[Mask, Mask]:
        """Which winners the other picture confirms, and which pixels nothing in it points to."""
        width = self.winners.shape[1]
        columns, rows = np.arange(width)[None], np.arange(len(self.winners))[:, None]
        target = columns - self.winners - self._low
        seen = (target >= 0) & (target < width)
        said = others[rows, target.clip(0, width - 1)]
        valid = seen & (np.abs(said - self.winners) <= self._settings.tolerance_px)
        back = columns + others + self._low
        inside = (back >= 0) & (back < width)
        hidden = np.ones_like(valid)
        hidden[np.broadcast_to(rows, back.shape)[inside], back[inside]] = False
        return valid, hidden


def _costs(first: Picture, second: Picture, low: int, count: int, settings: AdCensusSettings) -> _Volume:
    from mvcodec.kernels.census import census_transform
    from mvcodec.kernels.cost_volume import ad_census_costs

    by_difference = _truncated(np.arange(3 * 255 + 1) / 3, settings.lambda_difference)
    by_distance = _truncated(np.arange(65), settings.lambda_census)
    census, second_census = (
        census_transform(
            np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8),
            _CENSUS_RADIUS_X,
            _CENSUS_RADIUS_Y,
        )
        for picture in (first, second)
    )
    costs = np.empty((*first.shape[:2], count), np.float32)
    work = partial(
        ad_census_costs, first, second, census, second_census, low, by_difference, by_distance, _OUTSIDE_COST
    )
    _in_bands(len(first), work, costs)
    return costs


def _truncated(distances: NDArray[Any], scale: float) -> NDArray[np.float32]:
    """Equation 2: 0..1, linear at first, flat for outliers."""
    return np.asarray(1 - np.exp(-distances / scale), np.float32)


def _aggregate(costs: _Volume, spare: _Volume, arms: _Arms, rounds: int) -> None:
    """Section 2.2: mean over each pixel's cross region, `rounds` times; `costs` is overwritten."""
    ones = np.ones(costs.shape[:2], np.float32)
    sizes = []
    for rows_first in (True, False):
        size = ones[..., None].copy()
        _sum_region(size, np.empty_like(size), arms, ones, rows_first)
        sizes.append(size[..., 0])
    for turn in range(rounds):
        _sum_region(costs, spare, arms, sizes[turn % 2], rows_first=turn % 2 == 0)


def _sum_region(
    volume: _Volume, spare: _Volume, arms: _Arms, divisor: NDArray[np.float32], rows_first: bool
) -> None:
    from mvcodec.kernels.cost_volume import sum_along_columns, sum_along_rows

    height, width = volume.shape[:2]
    ones = np.ones((height, width), np.float32)
    passes = [(sum_along_rows, height), (sum_along_columns, width)]
    (first, first_length), (second, second_length) = passes if rows_first else passes[::-1]
    _in_bands(first_length, partial(first, volume, arms, ones), spare)
    _in_bands(second_length, partial(second, spare, arms, divisor), volume)


def _follow_scanlines(
    costs: _Volume, total: _Volume, pair: tuple[Picture, Picture], low: int, settings: AdCensusSettings
) -> None:
    """Section 2.3: `total` becomes the sum of the path costs from left, right, top and bottom."""
    from mvcodec.kernels.cost_volume import follow_columns, follow_rows

    penalties = np.outer(_EDGE_SHARES, (settings.step_penalty, settings.jump_penalty)).astype(np.float32)
    total[:] = 0
    for follow, axis, length in ((follow_rows, 1, costs.shape[0]), (follow_columns, 0, costs.shape[1])):
        first, second = (_colour_edges(picture, axis, settings.edge_colour) for picture in pair)
        for backward in (False, True):
            _in_bands(length, partial(follow, costs, first, second, low, penalties, backward), total)


def _colour_edges(picture: Picture, axis: int, step: int) -> Mask:
    """Where any channel changes by `step` or more from the pixel before, along the axis."""
    edges = np.zeros(picture.shape[:2], np.bool_)
    change = np.abs(np.diff(picture.astype(np.int16), axis=axis)).max(axis=2) >= step
    edges[1 - axis :, axis:] = change
    return edges


def _map_edges(levels: _Levels) -> Mask:
    values = levels.astype(np.float32)
    slopes = [np.abs(cv2.Sobel(values, cv2.CV_32F, dx, 1 - dx)) for dx in (1, 0)]
    return np.asarray(slopes[0] + slopes[1] > _MAP_EDGE)


def _mirror(pixels: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(pixels[:, ::-1])


def _in_bands(length: int, work: Callable[..., object], output: NDArray[Any]) -> None:
    """Run `work(start, stop, output)` over bands of 0..length-1, side by side."""
    run_in_bands(length, lambda start, stop: work(start, stop, output))

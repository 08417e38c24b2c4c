"""Disparity of every real camera of an array from a matcher of pairs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, Picture
from mvcodec.stereo.consistency import MEDIAN_SIZE, median
from mvcodec.stereo.fusion import fuse, row_texture
from mvcodec.stereo.matcher import PairMatcher
from mvcodec.workers import run_all


@dataclass(frozen=True, slots=True)
class CameraPair:
    """Two neighbouring real cameras.

    Attributes:
        first: the left or the upper one.
        second: the right or the lower one.
        vertical: whether `second` stands below `first`.
    """

    first: Position
    second: Position
    vertical: bool


def camera_pairs(array: CameraArray) -> tuple[CameraPair, ...]:
    """Every pair of neighbouring real cameras, horizontal ones first."""
    horizontal = [
        CameraPair((row, left), (row, right), vertical=False)
        for row in array.real_rows
        for left, right in pairwise(array.real_cols)
    ]
    vertical = [
        CameraPair((upper, col), (lower, col), vertical=True)
        for upper, lower in pairwise(array.real_rows)
        for col in array.real_cols
    ]
    return (*horizontal, *vertical)


@dataclass(frozen=True, slots=True)
class Pairwise:
    """Matcher that matches all neighbouring pairs and fuses what each camera's partners say.

    Attributes:
        pair_matcher: of rectified pairs.
        vertical: whether upper and lower neighbours are asked too. Without it an array of
            more than one column is matched along its rows alone.
    """

    pair_matcher: PairMatcher
    vertical: bool = True

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`. A lone camera's map is flat, at range_px[0], and nowhere valid."""
        pairs = [
            pair for pair in camera_pairs(array) if self.vertical or not pair.vertical or array.cols == 1
        ]
        matched = run_all(lambda pair: self._match(pair, array.cell_rho, pictures, range_px), pairs)
        said: dict[Position, list[tuple[bool, DisparityMap]]] = {camera: [] for camera in array.real}
        for pair, (first, second) in zip(pairs, matched, strict=True):
            said[pair.first].append((pair.vertical, first))
            said[pair.second].append((pair.vertical, second))
        fused = run_all(lambda camera: _fuse(pictures[camera], said[camera], range_px), said)
        return dict(zip(said, fused, strict=True))

    def _match(
        self,
        pair: CameraPair,
        rho: float,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
    ) -> tuple[DisparityMap, DisparityMap]:
        first, second = pictures[pair.first], pictures[pair.second]
        if not pair.vertical:
            return self.pair_matcher.match_pair(first, second, range_px)
        upper, lower = self.pair_matcher.match_pair(
            transposed(first), transposed(second), (range_px[0] * rho, range_px[1] * rho)
        )
        return _upright(upper, rho), _upright(lower, rho)


def transposed(picture: Picture) -> Picture:
    """The picture with rows and columns swapped, so that a vertical pair becomes a horizontal one."""
    return np.ascontiguousarray(picture.transpose(1, 0, 2))


def _upright(disparity: DisparityMap, rho: float) -> DisparityMap:
    values = np.ascontiguousarray(disparity.values_px.T) / np.float32(rho)
    return DisparityMap(values, np.ascontiguousarray(disparity.valid.T))


def _fuse(
    picture: Picture, said: list[tuple[bool, DisparityMap]], range_px: tuple[float, float]
) -> DisparityMap:
    """One map from what partners said, each with whether it stands above or below."""
    if not said:
        shape = picture.shape[:2]
        return DisparityMap(np.full(shape, range_px[0], np.float32), np.zeros(shape, np.bool_))
    candidates = [disparity for _, disparity in said]
    if len(candidates) == 1:
        return candidates[0]
    texture = {False: row_texture(picture), True: row_texture(transposed(picture)).T}
    fused = fuse(candidates, [texture[vertical] for vertical, _ in said])
    # Switching between partners from pixel to pixel leaves specks.
    return DisparityMap(median(fused.values_px, MEDIAN_SIZE, range_px), fused.valid)

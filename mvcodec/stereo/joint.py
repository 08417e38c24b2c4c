"""The default matcher: each camera against all its partners in one cost volume, then all maps together.

One disparity explains a camera's horizontal and its vertical partner (ALGORITHMS section 0), so that
their costs are added before any decision is taken, after cameras of unequal exposure have been made
equally bright. Semi-global matching decides; what no other camera's map confirms is decided again from
its surroundings alone, except that a place which another camera sees through is ruled out. What no
partner can see, beyond the borders of their pictures, takes the disparity of the confirmed surface that it
is connected with best.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.consistency import drop_speckles, median
from mvcodec.stereo.exposure import camera_gains
from mvcodec.stereo.matching_view import MatchingView, prepare_views
from mvcodec.stereo.partners import neighbours, outside, partners, steps, unseen_border
from mvcodec.stereo.subpixel import refine
from mvcodec.workers import run_all

LEVELS_MULTIPLE = 8


@dataclass(frozen=True, slots=True)
class JointSettings:
    """Settings of the joint matcher. Costs are in units of 8-bit grey levels.

    Raises:
        SettingError: a setting is outside its range.
    """

    colour_limit: float = setting(
        60, "most that the colour difference (sum of three channels) counts", low=0, high=120
    )
    bit_cost: float = setting(4, "cost of each bit of census distance", low=0, high=1e6)
    bit_limit: float = setting(82, "most that the census distance counts", low=0, high=130)
    lone_cost: int = setting(12, "added where one partner alone must see the pixel", low=0, high=100)
    outside_cost: int = setting(100, "of a disparity that leaves every partner's picture", low=0, high=254)
    small_step: float = setting(35, "penalty P1 of semi-global matching", low=0, high=600)
    jump: float = setting(170, "penalty P2 of semi-global matching", low=0, high=600)
    least_jump: float = setting(50, "what is left of P2 at an edge of the picture", low=0, high=600)
    contrast: float = setting(8, "grey levels that halve P2", low=1e-3, high=255)
    completion_small_step: float = setting(20, "P1 when the rest is completed", low=0, high=600)
    completion_jump: float = setting(80, "P2 when the rest is completed", low=0, high=600)
    completion_least_jump: float = setting(7, "what is left of it at an edge", low=0, high=600)
    hold_per_px: float = setting(
        7, "how firmly confirmed pixels hold when the rest is completed, for each px", low=0, high=1e6
    )
    hold_limit: float = setting(40, "the most that counts of it", low=0, high=254)
    through_cost: float = setting(40, "of a disparity that another camera sees through", low=0, high=254)
    # What stands in the world lies on floors and tables, whose disparity is the same along rows.
    edge_cost: float = setting(
        3,
        "where no partner can see: px of detour along a row that a grey level of contrast is worth",
        low=0,
        high=1e6,
    )
    row_cost: float = setting(50, "the same that a step to the next row is worth", low=1, high=1e6)
    tolerance_px: float = setting(1.0, "maps agree within this, px", low=1e-3, high=255)
    border_speckle_px: int = setting(
        50, "smallest patch that counts where no partner sees the whole range, pixels", low=0, high=1e6
    )
    median_size: int = setting(5, "window of the median after completion, px; 0: none", choices=(0, 3, 5))
    thin_px: float = setting(
        3,
        "the median leaves confirmed surfaces alone that are nearer by more than this than all that it leaves"
        " around them, px",
        low=0,
        high=1e6,
    )
    thin_area_px: int = setting(16, "and that have at least this many pixels", low=0, high=1e6)
    subpixel_steps: int = setting(3, "steps of sub-pixel refinement", low=0, high=20)

    def __post_init__(self) -> None:
        check_settings(self, "JointSettings.")


class Joint:
    """The `joint` matcher."""

    def __init__(self, settings: JointSettings | None = None) -> None:
        self.settings = settings or JointSettings()

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`. `valid` is where another camera's map confirms the pixel.

        A lone camera's map is flat, at range_px[0], and nowhere valid.
        """
        if len(array.real) == 1:
            shape = (array.height, array.width)
            flat = DisparityMap(np.full(shape, range_px[0], np.float32), np.zeros(shape, np.bool_))
            return dict.fromkeys(array.real, flat)
        ones = {camera: np.ones(3, np.float32) for camera in array.real}

        def matched(
            array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> tuple[dict[Position, FloatMap], dict[Position, Mask]]:
            return self._matched(array, prepare_views(array, pictures, ones), range_px)

        gains = camera_gains(array, pictures, range_px, matched)
        views = prepare_views(array, pictures, gains)
        maps, valid = self._refined_maps(array, views, range_px)
        extended = run_all(
            lambda camera: self._beyond_partners(
                array, camera, views[camera], valid[camera], np.clip(maps[camera], *range_px)
            ),
            array.real,
        )
        return {
            camera: DisparityMap(values, valid[camera])
            for camera, values in zip(array.real, extended, strict=True)
        }

    def _refined_maps(
        self,
        array: CameraArray,
        views: Mapping[Position, MatchingView],
        range_px: tuple[float, float],
    ) -> tuple[dict[Position, FloatMap], dict[Position, Mask]]:
        """Maps that are complete and sub-pixel, and where another camera confirms them."""
        low, levels = _levels(range_px)
        raw, valid = self._matched(array, views, range_px)
        completed = run_all(
            lambda camera: self._complete(array, camera, views[camera], raw, valid, low, levels),
            array.real,
        )
        maps = {
            camera: self._smoothed(np.clip(values, *range_px), valid[camera], range_px)
            for camera, values in zip(array.real, completed, strict=True)
        }
        for _ in range(self.settings.subpixel_steps):
            refined = run_all(partial(_refined, array, views, maps, valid), array.real)
            maps = dict(zip(array.real, refined, strict=True))
        return maps, valid

    def _matched(
        self,
        array: CameraArray,
        views: Mapping[Position, MatchingView],
        range_px: tuple[float, float],
    ) -> tuple[dict[Position, FloatMap], dict[Position, Mask]]:
        """The disparity of every camera by its own pictures, and where another camera confirms it."""
        low, levels = _levels(range_px)
        decided = run_all(lambda camera: self._decide(array, camera, views, low, levels), array.real)
        raw = dict(zip(array.real, decided, strict=True))
        return raw, {camera: self._confirmed(array, camera, raw, range_px) for camera in array.real}

    def _decide(
        self,
        array: CameraArray,
        camera: Position,
        views: Mapping[Position, MatchingView],
        low: int,
        levels: int,
    ) -> FloatMap:
        """The disparity of a camera by its own pictures."""
        from mvcodec.kernels import semiglobal

        settings = self.settings
        beside = partners(array, camera)
        bounds = [views[p].across if p[0] == camera[0] else views[p].down for p in beside]
        view = views[camera]
        costs = np.empty((*view.grey.shape, levels), np.uint8)
        semiglobal.joint_costs(
            view.planes,
            view.census,
            np.stack([bound for bound in bounds if bound is not None]),
            np.stack([views[partner].census for partner in beside]),
            steps(array, camera, beside),
            low,
            settings.colour_limit,
            settings.bit_cost,
            settings.bit_limit,
            settings.lone_cost,
            settings.outside_cost,
            costs,
        )
        return self._solve(costs, view, low, settings.small_step, settings.jump, settings.least_jump)

    def _solve(
        self, costs: NDArray[np.uint8], view: MatchingView, low: int, small: float, large: float, least: float
    ) -> FloatMap:
        from mvcodec.kernels import semiglobal

        sums = np.empty(costs.shape, np.uint16)
        for downwards in (True, False):
            semiglobal.aggregate(
                costs, view.grey, small, large, least, self.settings.contrast, sums, downwards
            )
        disparity = np.empty(costs.shape[:2], np.float32)
        semiglobal.winners(sums, low, disparity)
        return disparity

    def _confirmed(
        self,
        array: CameraArray,
        camera: Position,
        raw: Mapping[Position, FloatMap],
        range_px: tuple[float, float],
    ) -> Mask:
        """Pixels that other cameras confirm, less specks where no partner sees the whole range."""
        from mvcodec.kernels import completion

        others = neighbours(array, camera)
        kept: Mask = completion.confirmed(
            raw[camera],
            np.stack([raw[other] for other in others]),
            steps(array, camera, others),
            self.settings.tolerance_px,
        )
        border = unseen_border(array, camera, range_px)
        firm = drop_speckles(raw[camera], kept & border, self.settings.border_speckle_px)
        return np.where(border, firm, kept)

    def _complete(
        self,
        array: CameraArray,
        camera: Position,
        view: MatchingView,
        raw: Mapping[Position, FloatMap],
        valid: Mapping[Position, Mask],
        low: int,
        levels: int,
    ) -> FloatMap:
        """Decide again what nobody confirms, from its surroundings."""
        from mvcodec.kernels import completion

        settings = self.settings
        others = neighbours(array, camera)
        costs = np.empty((*view.grey.shape, levels), np.uint8)
        completion.completion_costs(
            raw[camera],
            valid[camera],
            np.stack([raw[other] for other in others]),
            np.stack([valid[other] for other in others]),
            steps(array, camera, others),
            low,
            settings.hold_per_px,
            settings.hold_limit,
            settings.through_cost,
            costs,
        )
        completed = self._solve(
            costs,
            view,
            low,
            settings.completion_small_step,
            settings.completion_jump,
            settings.completion_least_jump,
        )
        holds = valid[camera] & (np.abs(completed - raw[camera]) <= 1.5)
        return np.where(holds, raw[camera], completed)

    def _smoothed(self, disparity: FloatMap, valid: Mask, range_px: tuple[float, float]) -> FloatMap:
        """The median, but poles and wires that it would take away stay where another camera confirms them.

        At the contours of what is left the median has its way: there it is noise that stands out.
        """
        settings = self.settings
        smooth = median(disparity, settings.median_size, range_px)
        around = np.asarray(cv2.dilate(smooth, np.ones((3, 3), np.uint8)), np.float32)
        thin = valid & (disparity - around > settings.thin_px)
        thin &= drop_speckles(disparity, valid, settings.thin_area_px)
        return np.where(thin, disparity, smooth)

    def _beyond_partners(
        self, array: CameraArray, camera: Position, view: MatchingView, valid: Mask, disparity: FloatMap
    ) -> FloatMap:
        """Replace what no partner can see: scanlines alone leave streaks there."""
        from mvcodec.kernels import geodesic

        carried = disparity.copy()
        geodesic.carry(view.planes, valid, self.settings.edge_cost, self.settings.row_cost, carried)
        return np.where(outside(array, camera, carried) & ~valid, carried, disparity)


def _refined(
    array: CameraArray,
    views: Mapping[Position, MatchingView],
    maps: Mapping[Position, FloatMap],
    valid: Mapping[Position, Mask],
    camera: Position,
) -> FloatMap:
    beside = partners(array, camera)
    said = [(views[partner].grey, maps[partner]) for partner in beside]
    return refine(maps[camera], valid[camera], views[camera].grey, said, steps(array, camera, beside))


def _levels(range_px: tuple[float, float]) -> tuple[int, int]:
    """The lowest level, px, and how many."""
    low = int(np.floor(range_px[0])) - 1
    levels = int(np.ceil(range_px[1])) + 2 - low
    return low, levels + -levels % LEVELS_MULTIPLE

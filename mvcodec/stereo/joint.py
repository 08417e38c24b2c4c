"""The default matcher: each camera against all its partners in one cost volume, then all maps together.

One disparity explains a camera's horizontal and its vertical partner (ALGORITHMS section 0), so that
their costs are added before any decision is taken, after cameras of unequal exposure have been made
equally bright. Semi-global matching decides; what no other camera's map confirms is decided again from
its surroundings alone, except that a place which another camera sees through is ruled out. What no
partner can see, beyond the borders of their pictures, takes the disparity of the confirmed surface that it
is connected with best.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.stereo.consistency import (
    confirmed_range,
    drop_speckles,
    fill_from_farther,
    median,
    median_but_thin,
    without_specks,
)
from mvcodec.stereo.doubts import Blocks
from mvcodec.stereo.exposure import camera_gains
from mvcodec.stereo.joint_settings import JointSettings
from mvcodec.stereo.matching_view import (
    CameraPartners,
    MatchingViews,
    comparison,
    equal_grey,
    prepare_views,
)
from mvcodec.stereo.partners import neighbours, outside, steps, unseen_border
from mvcodec.stereo.scanlines import MAX_SUM, ScratchPool, decide
from mvcodec.stereo.second_look import look_again
from mvcodec.stereo.soft_edges import widen
from mvcodec.stereo.subpixel import refine_maps
from mvcodec.workers import run_all


class Joint:
    """The `joint` matcher."""

    def __init__(self, settings: JointSettings | None = None) -> None:
        self.settings = settings or JointSettings()
        self._census = self.settings.census_x, self.settings.census_y
        self._scratch = ScratchPool()
        self._gains: dict[Position, NDArray[np.float32]] = {}

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher.match`. `valid` is where another camera's map confirms the pixel.

        A lone camera's map is flat, at range_px[0], and nowhere valid.
        """
        return self.maps_of(array, pictures, range_px, array.real, fresh=True)

    def maps_of(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
        fresh: bool,
    ) -> dict[Position, DisparityMap]:
        """The maps of these real cameras, as `match` gives them; only they confirm each other.

        Args:
            fresh: measure unequal exposure in these pictures, not take what was measured last.
        """
        if len(array.real) == 1:
            shape = (array.height, array.width)
            flat = DisparityMap(np.full(shape, range_px[0], np.float32), np.zeros(shape, np.bool_))
            return dict.fromkeys(array.real, flat)
        if fresh or self._gains.keys() != set(array.real):
            self._gains = self._measured_gains(array, pictures, range_px)
        blind_cost = self.settings.blind_cost_within(range_px)
        views = prepare_views(array, pictures, self._gains, cameras, self._census, blind_cost)
        maps, valid = self._refined_maps(array, views, range_px, cameras)
        if self.settings.beyond_partners:
            extended = run_all(
                lambda camera: self._beyond_partners(
                    array, camera, pictures[camera], valid[camera], maps[camera]
                ),
                cameras,
            )
            maps = dict(zip(cameras, extended, strict=True))
        if not self.settings.full_size_steps:
            maps = self._widened(array, maps, views.grey)
        return self._finished(maps, valid)

    def _widened(
        self, array: CameraArray, maps: Mapping[Position, FloatMap], greys: NDArray[np.uint8]
    ) -> dict[Position, FloatMap]:
        """Surfaces reach further over plain ground where all real cameras' greys, uint8 (N, H, W), say so."""
        levels = self.settings.plain_levels
        widened = run_all(
            lambda camera: widen(maps[camera], greys, CameraPartners.of(array, camera), levels), maps
        )
        return dict(zip(maps, widened, strict=True))

    def _finished(
        self, maps: Mapping[Position, FloatMap], valid: Mapping[Position, Mask]
    ) -> dict[Position, DisparityMap]:
        clean = run_all(lambda values: without_specks(values, self.settings.speck_area_px), maps.values())
        return {
            camera: DisparityMap(values, valid[camera]) for camera, values in zip(maps, clean, strict=True)
        }

    def _measured_gains(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        range_px: tuple[float, float],
    ) -> dict[Position, NDArray[np.float32]]:
        """What makes the cameras equally bright."""
        ones = {camera: np.ones(3, np.float32) for camera in array.real}

        def matched(
            array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
        ) -> tuple[dict[Position, FloatMap], dict[Position, Mask]]:
            blind_cost = self.settings.blind_cost_within(range_px)
            views = prepare_views(array, pictures, ones, array.real, self._census, blind_cost)
            return self._matched(array, views, range_px, array.real)

        return camera_gains(array, pictures, range_px, matched)

    def _refined_maps(
        self,
        array: CameraArray,
        views: MatchingViews,
        range_px: tuple[float, float],
        cameras: Sequence[Position],
    ) -> tuple[dict[Position, FloatMap], dict[Position, Mask]]:
        """Maps that are complete and sub-pixel, and where another camera confirms them."""
        raw, valid = self._matched(array, views, range_px, cameras)
        if not self.settings.completion:
            filled = run_all(lambda camera: self._filled(raw[camera], valid[camera], range_px), cameras)
            return dict(zip(cameras, filled, strict=True)), valid
        # What nobody confirms has no other disparities than what somebody does.
        low, levels = _levels(confirmed_range([(raw[c], valid[c]) for c in cameras], range_px))

        def completed(camera: Position) -> FloatMap:
            found = self._complete(array, camera, views.grey_of(camera), raw, valid, low, levels)
            return self._smoothed(np.clip(found, *range_px), valid[camera], range_px)

        maps = dict(zip(cameras, run_all(completed, cameras), strict=True))
        greys = {camera: views.grey_of(camera) for camera in cameras}
        return refine_maps(array, greys, maps, valid, range_px, self.settings.subpixel_steps), valid

    def equal_greys(self, pictures: Mapping[Position, Picture]) -> dict[Position, NDArray[np.uint8]]:
        """uint8 (H, W) of each camera, as bright as matching last made them."""
        return {camera: equal_grey(picture, self._gains[camera]) for camera, picture in pictures.items()}

    def looked_at_again(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        maps: Mapping[Position, DisparityMap],
        blocks: Mapping[Position, Blocks],
        range_px: tuple[float, float],
    ) -> dict[Position, DisparityMap]:
        """Maps that small copies of these pictures gave last, with these blocks searched at full size."""
        # Colours, and which partners are blind, make no difference beside contours: time saved.
        gains = self._gains
        views = prepare_views(array, pictures, gains, array.real, self._census, 0, colours=False)
        return look_again(array, views, maps, blocks, range_px, self.settings, self._scratch)

    def refined(
        self,
        array: CameraArray,
        pictures: Mapping[Position, Picture],
        maps: Mapping[Position, DisparityMap],
        range_px: tuple[float, float],
        cameras: Sequence[Position],
    ) -> dict[Position, DisparityMap]:
        """Maps that small copies of these pictures gave last, sub-pixel by the pictures: of these cameras."""
        count = self.settings.full_size_steps
        if not count or self._gains.keys() != set(array.real):
            return {camera: maps[camera] for camera in cameras}
        greys = self.equal_greys(pictures)
        values = {camera: found.values_px for camera, found in maps.items()}
        valid = {camera: found.valid for camera, found in maps.items()}
        moved = refine_maps(array, greys, values, valid, range_px, count, cameras)
        stacked = np.stack([greys[camera] for camera in array.real])
        return self._finished(self._widened(array, moved, stacked), valid)

    def _matched(
        self,
        array: CameraArray,
        views: MatchingViews,
        range_px: tuple[float, float],
        cameras: Sequence[Position],
    ) -> tuple[dict[Position, FloatMap], dict[Position, Mask]]:
        """The disparity of every camera by its own pictures, and where another camera confirms it."""
        low, levels = _levels(range_px)
        decided = run_all(lambda camera: self._decide(array, camera, views, low, levels), cameras)
        raw = {camera: found for camera, (found, _) in zip(cameras, decided, strict=True)}
        if self.settings.self_check:
            return raw, {camera: valid for camera, (_, valid) in zip(cameras, decided, strict=True)}
        checked = run_all(lambda camera: self._confirmed(array, camera, raw, range_px), cameras)
        return raw, dict(zip(cameras, checked, strict=True))

    def _decide(
        self,
        array: CameraArray,
        camera: Position,
        views: MatchingViews,
        low: int,
        levels: int,
    ) -> tuple[FloatMap, Mask]:
        """The disparity of a camera by its own pictures, and what its own costs confirm, where asked."""
        from mvcodec.kernels.byte_vectors import LANES
        from mvcodec.kernels.table import kernel

        settings, those = self.settings, CameraPartners.of(array, camera)
        compare = comparison(array, those, views, low, settings)
        columns = range(0, array.width, LANES)

        def costs_of(first: int, costs: NDArray[np.uint8]) -> None:
            compare(np.array([(first, column) for column in columns]), costs)

        asked = those.steps if settings.self_check else None
        with self._scratch.lend() as scratch:
            found = decide(
                costs_of, views.grey_of(camera), low, levels, settings.matching_penalties, scratch, asked
            )
        seen = np.ones(found.disparity.shape, np.bool_)
        if asked is None:
            return found.disparity, seen
        return found.disparity, kernel("completion.confirmed")(
            found.disparity, seen, found.partners, asked, settings.tolerance_px
        )

    def _confirmed(
        self,
        array: CameraArray,
        camera: Position,
        raw: Mapping[Position, FloatMap],
        range_px: tuple[float, float],
    ) -> Mask:
        """Pixels that other cameras confirm, less specks where no partner sees the whole range."""
        from mvcodec.kernels.table import kernel

        others = [other for other in neighbours(array, camera) if other in raw]
        kept: Mask = kernel("completion.confirmed")(
            raw[camera],
            np.ones(raw[camera].shape, np.bool_),
            np.stack([raw[other] for other in others]),
            steps(array, camera, others),
            self.settings.tolerance_px,
        )
        if not self.settings.border_speckle_px:
            return kept
        border = unseen_border(array, camera, range_px)
        firm = drop_speckles(raw[camera], kept & border, self.settings.border_speckle_px)
        return np.where(border, firm, kept)

    def _complete(
        self,
        array: CameraArray,
        camera: Position,
        grey: NDArray[np.uint8],
        raw: Mapping[Position, FloatMap],
        valid: Mapping[Position, Mask],
        low: int,
        levels: int,
    ) -> FloatMap:
        """Decide again what nobody confirms, from its surroundings."""
        from mvcodec.kernels.completion import NOWHERE
        from mvcodec.kernels.table import kernel

        settings = self.settings
        penalties = settings.completion_penalties
        others = [other for other in neighbours(array, camera) if other in raw]
        own = _parts(raw[camera])
        # None, where a row's neighbours send no map: its surroundings alone decide.
        behind = np.empty((len(others), *own.shape), own.dtype)
        for other, out in zip(others, behind, strict=True):
            out[:] = np.where(valid[other], _parts(raw[other]), NOWHERE)
        most = MAX_SUM - max(penalties.jump, penalties.least_jump) - penalties.small_step

        def costs_of(first: int, costs: NDArray[np.uint8]) -> None:
            kernel("completion.completion_costs")(
                own,
                valid[camera],
                behind,
                steps(array, camera, others),
                low,
                settings.hold_per_px,
                settings.hold_limit,
                settings.through_cost,
                most,
                first,
                costs,
            )

        with self._scratch.lend() as scratch:
            completed = decide(costs_of, grey, low, levels, penalties, scratch).disparity
        holds = valid[camera] & (np.abs(completed - raw[camera]) <= 1.5)
        return np.where(holds, raw[camera], completed)

    def _filled(self, disparity: FloatMap, valid: Mask, range_px: tuple[float, float]) -> FloatMap:
        """What nobody confirms from the farther side of its row."""
        filled = fill_from_farther(disparity, valid, range_px[0])
        return median(np.clip(filled, *range_px), self.settings.median_size, range_px)

    def _smoothed(self, disparity: FloatMap, valid: Mask, range_px: tuple[float, float]) -> FloatMap:
        settings = self.settings
        firm = valid & drop_speckles(disparity, valid, settings.thin_area_px)
        limits = settings.tolerance_px, settings.thin_px
        return median_but_thin(disparity, firm, settings.median_size, limits, range_px)

    def _beyond_partners(
        self, array: CameraArray, camera: Position, picture: Picture, valid: Mask, disparity: FloatMap
    ) -> FloatMap:
        """Replace what no partner can see: scanlines alone leave streaks there."""
        from mvcodec.kernels.table import kernel

        carried = disparity.copy()
        kernel("geodesic.carry")(
            np.ascontiguousarray(picture.transpose(2, 0, 1), np.float32),
            valid,
            self.settings.edge_cost,
            self.settings.row_cost,
            carried,
        )
        return np.where(outside(array, camera, carried) & ~valid, carried, disparity)


def _parts(disparity: FloatMap) -> NDArray[np.int16]:
    """A map in the parts of a px that completion counts in."""
    from mvcodec.kernels.completion import PARTS

    return np.rint(disparity * PARTS).astype(np.int16)


def _levels(range_px: tuple[float, float]) -> tuple[int, int]:
    """The lowest level, px, and how many."""
    low = int(np.floor(range_px[0])) - 1
    return low, int(np.ceil(range_px[1])) + 2 - low

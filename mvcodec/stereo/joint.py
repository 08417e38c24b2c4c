"""The default matcher: each camera against all its partners in one cost volume, then all maps together.

One disparity explains a camera's horizontal and its vertical partner (ALGORITHMS section 0), so that
their costs are added before any decision is taken. Semi-global matching decides; what no other camera's
map confirms is decided again from its surroundings alone, except that a place which another camera
sees through is ruled out. What no partner can see, beyond the borders of their pictures, takes the
disparity of the confirmed surface that it is connected with best.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.stereo.consistency import drop_speckles, median
from mvcodec.stereo.subpixel import refine

THREADS = 2
LEVELS_MULTIPLE = 8


@dataclass(frozen=True, slots=True)
class JointSettings:
    """Settings of the joint matcher. Costs are in units of 8-bit grey levels.

    Attributes:
        colour_limit: most that the colour difference (sum of three channels) counts, 0..120.
        bit_cost, bit_limit: cost of each bit of census distance, and the most it counts, 0..130.
        lone_cost: added where one partner alone must see the pixel, 0..100.
        outside_cost: of a disparity that leaves every partner's picture, 0..254.
        small_step, jump, least_jump: penalties P1 and P2 of semi-global matching, and what is left of
            P2 at an edge of the picture, at least 0.
        contrast: grey levels that halve P2, above 0.
        hold_per_px, hold_limit: how firmly confirmed pixels hold when the rest is completed.
        through_cost: of a disparity that another camera sees through, 0..254.
        edge_cost, row_cost: where no partner can see, px of detour along a row that a grey level of contrast
            is worth, at least 0, and a step to the next row, at least 1: what stands in the world
            lies on floors and tables, whose disparity is the same along rows.
        tolerance_px: maps agree within this, px, above 0.
        border_speckle_px: smallest patch that counts where no partner sees the whole range, pixels.
        median_size: window of the median after completion, 0 (none), 3 or 5.
        subpixel_steps: steps of sub-pixel refinement, see `mvcodec.stereo.subpixel`.

    Raises:
        SettingError: a setting is outside its range.
    """

    colour_limit: float = 60
    bit_cost: float = 4
    bit_limit: float = 90
    lone_cost: int = 12
    outside_cost: int = 100
    small_step: float = 35
    jump: float = 170
    least_jump: float = 50
    contrast: float = 8
    completion_small_step: float = 20
    completion_jump: float = 80
    completion_least_jump: float = 7
    hold_per_px: float = 7
    hold_limit: float = 40
    through_cost: float = 40
    edge_cost: float = 3
    row_cost: float = 50
    tolerance_px: float = 1.0
    border_speckle_px: int = 50
    median_size: int = 5
    subpixel_steps: int = 3

    def __post_init__(self) -> None:
        limits = {
            "colour_limit": (0, 120),
            "bit_limit": (0, 130),
            "lone_cost": (0, 100),
            "outside_cost": (0, 254),
            "through_cost": (0, 254),
            "hold_limit": (0, 254),
            "contrast": (1e-3, 255),
            "row_cost": (1, 1e6),
            "tolerance_px": (1e-3, 255),
            "subpixel_steps": (0, 20),
        }
        for name in self.__slots__:
            low, high = limits.get(name, (0, 1e6))
            value = getattr(self, name)
            if not low <= value <= high:
                raise SettingError(f"JointSettings.{name}", value, f"{low:g}..{high:g}")
        if self.median_size not in {0, 3, 5}:
            raise SettingError("JointSettings.median_size", self.median_size, "0, 3 or 5")


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """What matching needs of a picture: float32 (3, H, W) planes, grey, census, intervals by baseline."""

    planes: NDArray[np.float32]
    grey: FloatMap
    census: NDArray[np.uint64]
    across: NDArray[np.float32] | None
    down: NDArray[np.float32] | None


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
        low = int(np.floor(range_px[0])) - 1
        levels = int(np.ceil(range_px[1])) + 2 - low
        levels += -levels % LEVELS_MULTIPLE
        with ThreadPoolExecutor(THREADS) as pool:
            prepared = pool.map(lambda camera: _prepare(array, pictures[camera]), array.real)
            views = dict(zip(array.real, prepared, strict=True))
            raw = dict(
                zip(
                    array.real,
                    pool.map(lambda camera: self._decide(array, camera, views, low, levels), array.real),
                    strict=True,
                )
            )
            valid = {camera: self._confirmed(array, camera, raw, range_px) for camera in array.real}
            completed = pool.map(
                lambda camera: self._complete(array, camera, views[camera], raw, valid, low, levels),
                array.real,
            )
            maps = {
                camera: median(np.clip(values, *range_px), self.settings.median_size, range_px)
                for camera, values in zip(array.real, completed, strict=True)
            }
            for _ in range(self.settings.subpixel_steps):
                refined = pool.map(partial(_refined, array, views, maps, valid), array.real)
                maps = dict(zip(array.real, refined, strict=True))
            extended = pool.map(
                lambda camera: self._beyond_partners(
                    array, camera, views[camera], valid[camera], np.clip(maps[camera], *range_px)
                ),
                array.real,
            )
            return {
                camera: DisparityMap(values, valid[camera])
                for camera, values in zip(array.real, extended, strict=True)
            }

    def _decide(
        self, array: CameraArray, camera: Position, views: Mapping[Position, _View], low: int, levels: int
    ) -> FloatMap:
        """The disparity of a camera by its own pictures."""
        from mvcodec.kernels import semiglobal

        settings = self.settings
        partners = _partners(array, camera)
        bounds = [views[p].across if p[0] == camera[0] else views[p].down for p in partners]
        view = views[camera]
        costs = np.empty((*view.grey.shape, levels), np.uint8)
        semiglobal.joint_costs(
            view.planes,
            view.census,
            np.stack([bound for bound in bounds if bound is not None]),
            np.stack([views[partner].census for partner in partners]),
            _steps(array, camera, partners),
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
        self, costs: NDArray[np.uint8], view: _View, low: int, small: float, large: float, least: float
    ) -> FloatMap:
        from mvcodec.kernels import semiglobal

        sums = np.empty(costs.shape, np.float32)
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
        from mvcodec.kernels import semiglobal

        others = _neighbours(array, camera)
        kept: Mask = semiglobal.confirmed(
            raw[camera],
            np.stack([raw[other] for other in others]),
            _steps(array, camera, others),
            self.settings.tolerance_px,
        )
        border = _unseen_border(array, camera, range_px)
        firm = drop_speckles(raw[camera], kept & border, self.settings.border_speckle_px)
        return np.where(border, firm, kept)

    def _complete(
        self,
        array: CameraArray,
        camera: Position,
        view: _View,
        raw: Mapping[Position, FloatMap],
        valid: Mapping[Position, Mask],
        low: int,
        levels: int,
    ) -> FloatMap:
        """Decide again what nobody confirms, from its surroundings."""
        from mvcodec.kernels import semiglobal

        settings = self.settings
        others = _neighbours(array, camera)
        costs = np.empty((*view.grey.shape, levels), np.uint8)
        semiglobal.completion_costs(
            raw[camera],
            valid[camera],
            np.stack([raw[other] for other in others]),
            np.stack([valid[other] for other in others]),
            _steps(array, camera, others),
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

    def _beyond_partners(
        self, array: CameraArray, camera: Position, view: _View, valid: Mask, disparity: FloatMap
    ) -> FloatMap:
        """Replace what no partner can see: scanlines alone leave streaks there."""
        from mvcodec.kernels import geodesic

        carried = disparity.copy()
        geodesic.carry(view.planes, valid, self.settings.edge_cost, self.settings.row_cost, carried)
        return np.where(_outside(array, camera, carried) & ~valid, carried, disparity)


def _refined(
    array: CameraArray,
    views: Mapping[Position, _View],
    maps: Mapping[Position, FloatMap],
    valid: Mapping[Position, Mask],
    camera: Position,
) -> FloatMap:
    partners = _partners(array, camera)
    said = [(views[partner].grey, maps[partner]) for partner in partners]
    return refine(maps[camera], valid[camera], views[camera].grey, said, _steps(array, camera, partners))


def _prepare(array: CameraArray, picture: Picture) -> _View:
    from mvcodec.kernels import census, semiglobal

    planes = np.ascontiguousarray(picture.transpose(2, 0, 1)).astype(np.float32)
    grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)
    return _View(
        planes,
        grey.astype(np.float32),
        census.census_transform(grey, 4, 3),
        semiglobal.sampling_interval(planes, 1, 0) if array.col_step else None,
        semiglobal.sampling_interval(planes, 0, 1) if array.row_step else None,
    )


def _around(array: CameraArray, camera: Position, *, diagonal: bool) -> list[Position]:
    row, col = array.real_rows.index(camera[0]), array.real_cols.index(camera[1])
    found = []
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            beside = (down == 0) != (across == 0) or (diagonal and down != 0 and across != 0)
            if beside and 0 <= row + down < len(array.real_rows) and 0 <= col + across < len(array.real_cols):
                found.append((array.real_rows[row + down], array.real_cols[col + across]))
    return found


def _partners(array: CameraArray, camera: Position) -> list[Position]:
    """The real cameras beside, above and below a camera."""
    return _around(array, camera, diagonal=False)


def _neighbours(array: CameraArray, camera: Position) -> list[Position]:
    """The partners of a camera and those across the corners of its cells."""
    return _around(array, camera, diagonal=True)


def _steps(array: CameraArray, camera: Position, others: list[Position]) -> NDArray[np.float32]:
    """float32 (P, 2): what a pixel moves (left, up) for each px of disparity, from camera to each other."""
    return np.array([array.shift_per_disparity(camera, Viewpoint(*other)) for other in others], np.float32)


def _unseen_border(array: CameraArray, camera: Position, range_px: tuple[float, float]) -> Mask:
    """bool (H, W): where the nearest disparity leaves every partner's picture."""
    return _outside(array, camera, np.full((array.height, array.width), range_px[1], np.float32))


def _outside(array: CameraArray, camera: Position, disparity: FloatMap) -> Mask:
    """bool (H, W): where a pixel of this disparity leaves every partner's picture."""
    unseen = np.ones((array.height, array.width), np.bool_)
    x, y = np.arange(array.width)[None], np.arange(array.height)[:, None]
    for by_x, by_y in _steps(array, camera, _partners(array, camera)):
        there_x, there_y = x - by_x * disparity, y - by_y * disparity
        unseen &= (there_x < 0) | (there_x >= array.width) | (there_y < 0) | (there_y >= array.height)
    return unseen

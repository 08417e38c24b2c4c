"""The default synthesizer: every real camera of the cell, sub-pixel, depth-ordered, edge-aware.

A view is made in two steps. Its disparity: the maps of the cell's cameras are moved to it, nearest
surface last, and put to the vote. Its colour: each pixel is fetched from the cameras whose own maps
agree that they see it, weighted by how near they stand; contours are blended between the surfaces that
meet there, and what no camera saw is filled from the background side.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Cell, Position, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet, FloatMap, Picture, RenderedView
from mvcodec.synthesis.camera_spread import measure_spread

THREADS = 2
FADE = 0.25
"""Cells over which a camera fades out before a border that it does not stand on."""


@dataclass(frozen=True, slots=True)
class LayeredSettings:
    """Settings of the layered synthesizer.

    Attributes:
        tolerance_px: disparities this close are one surface, px, above 0.
        ratio: cameras behind a farther surface must weigh this many times those of a nearer one to
            outvote it, at least 1.
        contrast: grey levels; a camera that sees something farther denies a nearer surface when its
            picture differs by more than this, 0..255.
        denial: how much such a camera counts against that surface, as a share of its weight, 0..10.
        reach_px: how far a moved pixel covers its surroundings, px, 0.5..1.
        spread: squared cells; a camera at distance b counts 1 / (spread + b^2), so that more cameras are
            averaged (less noise, more blur) with a larger one, above 0. None: as the pictures ask for,
            see `mvcodec.synthesis.camera_spread`.
        edge_trust: weight of pixels fetched at a camera's contours, above 0 and at most 1.
        sharpness: Keys' parameter a of the cubic fetch, -1..0.
        hole_reach_px: how far holes are painted from, px, at least 1.

    Raises:
        SettingError: a setting is outside its range.
    """

    tolerance_px: float = 1.5
    ratio: float = 1.3
    contrast: float = 10.0
    denial: float = 0.6
    reach_px: float = 0.54
    spread: float | None = None
    edge_trust: float = 0.5
    sharpness: float = -0.7
    hole_reach_px: int = 64

    def __post_init__(self) -> None:
        for name, low, high in (
            ("tolerance_px", 1e-3, 1e3),
            ("ratio", 1.0, 1e3),
            ("contrast", 0.0, 255.0),
            ("denial", 0.0, 10.0),
            ("reach_px", 0.5, 1.0),
            ("spread", 1e-3, 1e3),
            ("edge_trust", 1e-3, 1.0),
            ("sharpness", -1.0, 0.0),
            ("hole_reach_px", 1, 4096),
        ):
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise SettingError(f"LayeredSettings.{name}", value, f"{low}..{high}")


class _Sources:
    """The real cameras of one decoded set, prepared for fetching when a view first needs them.

    The arrays are those of `kernels.view_colour.blend`, indexed by place in `array.real`.
    """

    def __init__(self, decoded: DecodedSet, spread: float | None) -> None:
        from mvcodec.kernels.view_fetch import BORDER

        height, width, count = decoded.array.height, decoded.array.width, len(decoded.array.real)
        padded = (count, height + 2 * BORDER, width + 2 * BORDER)
        self.decoded = decoded
        self.spread = measure_spread(decoded) if spread is None else spread
        self.lumas = np.empty(padded, np.float32)
        self.colours = np.empty((*padded, 2), np.float32)
        self.disparities = np.empty((count, height, width), np.float32)
        self.fetchable = np.empty(padded, np.float32)
        self._ready: set[Position] = set()
        self._lock = threading.Lock()

    def indices(self, cameras: Sequence[Position], tolerance_px: float, pool: Executor) -> NDArray[np.int64]:
        """Prepare these cameras, side by side; their places in the arrays."""
        with self._lock:
            missing = [camera for camera in cameras if camera not in self._ready]
            for _ in pool.map(partial(self._prepare, tolerance_px=tolerance_px), missing):
                pass
            self._ready.update(missing)
        return np.array([self.decoded.array.real.index(camera) for camera in cameras])

    def _prepare(self, camera: Position, tolerance_px: float) -> None:
        from mvcodec.kernels.view_planes import mark_contours, split_luma

        place = self.decoded.array.real.index(camera)
        split_luma(self.decoded.pictures[camera], self.lumas[place], self.colours[place])
        values = self.decoded.disparities[camera].values_px
        self.disparities[place] = values
        mark_contours(values, tolerance_px, self.fetchable[place])

    @property
    def planes(self) -> tuple[FloatMap, FloatMap, FloatMap, FloatMap]:
        """The arrays in the order of `kernels.view_colour.blend`."""
        return self.lumas, self.colours, self.disparities, self.fetchable


def _contours(disparity: FloatMap, tolerance_px: float) -> NDArray[np.uint8]:
    """uint8 (H, W), 1 where the 3 x 3 window holds more than one surface."""
    nearest, farthest = (
        change(disparity, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_REPLICATE)
        for change in (cv2.dilate, cv2.erode)
    )
    return (nearest - farthest > tolerance_px).view(np.uint8)


def _weight(array: CameraArray, cell: Cell, camera: Position, viewpoint: Viewpoint, spread: float) -> float:
    """How much a camera of the cell counts, by its distance.

    Towards a border to another cell the cameras across this cell fade out, so that the picture
    does not jump where other cameras take over.
    """
    across = abs(viewpoint.col - camera[1]) / array.col_step if array.col_step else 0.0
    down = abs(viewpoint.row - camera[0]) / array.row_step if array.row_step else 0.0
    weight = 1 / (spread + across**2 + down**2)
    if camera[1] == cell.left and cell.right < array.cols - 1:
        weight *= min(1.0, (1 - across) / FADE)
    if camera[1] == cell.right and cell.left > 0:
        weight *= min(1.0, (1 - across) / FADE)
    if camera[0] == cell.top and cell.bottom < array.rows - 1:
        weight *= min(1.0, (1 - down) / FADE)
    if camera[0] == cell.bottom and cell.top > 0:
        weight *= min(1.0, (1 - down) / FADE)
    return weight


class Layered:
    """The `layered` synthesizer. Thread-safe; keeps what it prepared for the last decoded set."""

    def __init__(self, settings: LayeredSettings | None = None) -> None:
        self.settings = settings or LayeredSettings()
        self._pool = ThreadPoolExecutor(THREADS, "layered")
        self._lock = threading.Lock()
        self._sources: _Sources | None = None

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """See `Synthesizer.render`. `seen_by` counts the cameras that agree on the pixel's surface."""
        decoded.array.cell_at(viewpoint)  # outside the array it raises
        position = viewpoint.position
        if position is not None and position in decoded.pictures:
            pixels = decoded.pictures[position]
            own = decoded.disparities[position].values_px
            return RenderedView(viewpoint, pixels.copy(), own.copy(), np.ones(own.shape, np.uint8))
        sources, places, shifts, weight = self._cameras(decoded, viewpoint)
        disparity = self._view_disparity(sources, places, shifts, weight)
        pixels, seen_by = self._colour(sources, places, shifts, weight, disparity)
        return RenderedView(viewpoint, pixels, disparity, seen_by)

    def prepare(self, decoded: DecodedSet, viewpoint: Viewpoint) -> None:
        """See `Preparing.prepare`."""
        self._cameras(decoded, viewpoint)

    def _cameras(
        self, decoded: DecodedSet, viewpoint: Viewpoint
    ) -> tuple[_Sources, NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
        """The cameras that see a view, prepared: their places in the sources, shifts and weights."""
        array = decoded.array
        cell = array.cell_at(viewpoint)
        sources = self._prepared(decoded)
        weights = {camera: _weight(array, cell, camera, viewpoint, sources.spread) for camera in cell.cameras}
        cameras = [camera for camera in cell.cameras if weights[camera] > 0 and camera in decoded.pictures]
        if not cameras:
            raise SettingError("decoded.pictures", "no camera of the view's cell", "at least one")
        shifts = np.array([array.shift_per_disparity(camera, viewpoint) for camera in cameras], np.float32)
        weight = np.array([weights[camera] for camera in cameras], np.float32)
        places = sources.indices(cameras, self.settings.tolerance_px, self._pool)
        return sources, places, shifts, weight

    def _prepared(self, decoded: DecodedSet) -> _Sources:
        with self._lock:
            if self._sources is None or self._sources.decoded is not decoded:
                self._sources = _Sources(decoded, self.settings.spread)
            return self._sources

    def _view_disparity(
        self,
        sources: _Sources,
        places: NDArray[np.int64],
        shifts: NDArray[np.float32],
        weights: NDArray[np.float32],
    ) -> FloatMap:
        from mvcodec.kernels import view_depth

        settings = self.settings
        _, height, width = sources.disparities.shape
        moved = np.empty((len(places), height + 2, width + 2), np.float32)
        jobs = [
            self._pool.submit(
                view_depth.splat, sources.disparities[place], shift[0], shift[1], settings.reach_px, out
            )
            for place, shift, out in zip(places, shifts, moved, strict=True)
        ]
        for job in jobs:
            job.result()
        voted = np.empty((height, width), np.float32)
        self._bands(
            height,
            view_depth.vote,
            moved,
            places,
            sources.disparities,
            sources.lumas,
            shifts,
            weights,
            settings.tolerance_px,
            settings.contrast,
            settings.ratio,
            settings.denial,
            voted,
        )
        cleaned = np.asarray(cv2.medianBlur(voted, 3), np.float32)
        self._bands(height, view_depth.fill_background, cleaned, sources.decoded.disparity_range_px[0])
        return cleaned

    def _colour(
        self,
        sources: _Sources,
        places: NDArray[np.int64],
        shifts: NDArray[np.float32],
        weights: NDArray[np.float32],
        disparity: FloatMap,
    ) -> tuple[Picture, NDArray[np.uint8]]:
        from mvcodec.kernels import view_colour, view_holes

        settings = self.settings
        pixels: Picture = np.empty((*disparity.shape, 3), np.uint8)
        seen_by = np.empty(disparity.shape, np.uint8)
        self._bands(
            disparity.shape[0],
            view_colour.blend,
            places,
            sources.planes,
            shifts,
            weights,
            disparity,
            _contours(disparity, settings.tolerance_px),
            settings.tolerance_px,
            settings.edge_trust,
            settings.sharpness,
            pixels,
            seen_by,
        )
        view_holes.paint_holes(pixels, disparity, seen_by, settings.tolerance_px, settings.hole_reach_px)
        return pixels, seen_by

    def _bands(self, height: int, kernel: Callable[..., None], *arguments: object) -> None:
        """Run a kernel over bands of rows, one a thread."""
        edges = [height * band // THREADS for band in range(THREADS + 1)]
        jobs = [self._pool.submit(kernel, *arguments, first, last) for first, last in pairwise(edges)]
        for job in jobs:
            job.result()

"""The default synthesizer: every real camera of the cell, sub-pixel, depth-ordered, edge-aware.

A view is made in two steps. Its disparity: the maps of the cell's cameras are moved to it, nearest
surface last, and put to the vote. Its colour: each pixel is fetched from the cameras whose own maps
agree that they see it, weighted by how near they stand; contours are blended between the surfaces that
meet there, and what no camera saw is filled from the background side.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Viewpoint
from mvcodec.frames import DecodedSet, FloatMap, Picture, RenderedView
from mvcodec.settings import check_settings, setting
from mvcodec.synthesis.cell_cameras import CellCameras, find_cameras, real_view
from mvcodec.synthesis.cross_view import STRENGTH, can_be_filtered, filter_picture
from mvcodec.synthesis.fetch_sources import Sources
from mvcodec.synthesis.view_disparity import Ballot, view_disparity
from mvcodec.workers import check_threads, run_in_bands, threads


@dataclass(frozen=True, slots=True)
class LayeredSettings:
    """Settings of the layered synthesizer.

    Raises:
        SettingError: a setting is outside its range.
    """

    tolerance_px: float = setting(1.5, "disparities this close are one surface, px", low=1e-3, high=1e3)
    ratio: float = setting(
        1.3,
        "cameras behind a farther surface must weigh this many times those of a nearer one to outvote it",
        low=1,
        high=1e3,
    )
    contrast: float = setting(
        10.0,
        "a camera that sees something farther denies a nearer surface when its picture differs by more than"
        " this, grey levels",
        low=0,
        high=255,
    )
    denial: float = setting(
        0.6, "how much such a camera counts against that surface, as a share of its weight", low=0, high=10
    )
    reach_px: float = setting(0.54, "how far a moved pixel covers its surroundings, px", low=0.5, high=1)
    spread: float | None = setting(
        None,
        "a camera at distance b (cells) counts 1 / (spread + b^2): larger averages more cameras; none: as the"
        " pictures ask for",
        low=1e-3,
        high=1e3,
    )
    speck_area_px: int = setting(
        30,
        "smaller pieces of a view that contradict all around them give way to that, pixels; 1: none",
        low=1,
        high=1000,
    )
    edge_trust: float = setting(0.5, "weight of pixels fetched at a camera's contours", low=1e-3, high=1)
    sharpness: float = setting(-0.7, "Keys' parameter a of the cubic fetch", low=-1, high=0)
    hole_reach_px: int = setting(64, "how far holes are painted from, px", low=1, high=4096)
    filter: float = setting(
        STRENGTH,
        "how much of a real camera's coding noise counts where other cameras are asked what it is: 0: its"
        " picture stays as it was decoded",
        low=0,
        high=2,
    )

    def __post_init__(self) -> None:
        check_settings(self, "LayeredSettings.")


class Layered:
    """The `layered` synthesizer. Thread-safe; keeps what it prepared for the last decoded set.

    Args:
        settings: LayeredSettings() by default.
        thread_count: how many threads make a view; by default as set for the process.
    """

    def __init__(self, settings: LayeredSettings | None = None, thread_count: int | None = None) -> None:
        self.settings = settings or LayeredSettings()
        self._ballot = Ballot(
            self.settings.tolerance_px,
            self.settings.ratio,
            self.settings.contrast,
            self.settings.denial,
            self.settings.reach_px,
            self.settings.speck_area_px,
        )
        check_threads(thread_count)
        self._threads = thread_count
        self._lock = threading.Lock()
        self._sources: Sources | None = None

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """See `Synthesizer.render`. `seen_by` counts the cameras that agree on the pixel's surface."""
        own = real_view(decoded, viewpoint)
        if own is not None:
            return self._filtered(decoded, own)
        with threads(self._threads):
            sources, cameras = self._prepared(decoded, viewpoint)
            disparity = view_disparity(
                sources.planes[2],
                sources.extents,
                sources.planes[0],
                cameras,
                self._ballot,
                decoded.disparity_range_px[0],
            )
            pixels, seen_by = self._colour(sources, cameras, disparity)
        return RenderedView(viewpoint, pixels, disparity, seen_by)

    def prepare(self, decoded: DecodedSet, viewpoint: Viewpoint) -> None:
        """See `Preparing.prepare`."""
        with threads(self._threads):
            self._prepared(decoded, viewpoint)

    def _filtered(self, decoded: DecodedSet, own: RenderedView) -> RenderedView:
        """A real camera's view with what the other cameras say of its coding noise."""
        camera = own.viewpoint.position
        enhanced = camera in decoded.enhanced
        if camera is None or enhanced or not self.settings.filter or not can_be_filtered(decoded, camera):
            return own
        with threads(self._threads):
            pixels = filter_picture(decoded, camera, self._sources_of(decoded), self.settings.filter)
        return replace(own, pixels=pixels)

    def _sources_of(self, decoded: DecodedSet) -> Sources:
        with self._lock:
            if self._sources is None or self._sources.decoded is not decoded:
                self._sources = Sources(decoded, self.settings.spread)
            return self._sources

    def _prepared(self, decoded: DecodedSet, viewpoint: Viewpoint) -> tuple[Sources, CellCameras]:
        """The cameras that see a view, and the sources with these prepared."""
        sources = self._sources_of(decoded)
        cameras = find_cameras(decoded, viewpoint, sources.spread)
        sources.prepare(cameras.cameras, self.settings.tolerance_px)
        return sources, cameras

    def _colour(
        self, sources: Sources, cameras: CellCameras, disparity: FloatMap
    ) -> tuple[Picture, NDArray[np.uint8]]:
        from mvcodec.kernels import view_vectors
        from mvcodec.kernels.table import kernel

        settings = self.settings
        pixels: Picture = np.empty((*disparity.shape, 3), np.uint8)
        seen_by = np.empty(disparity.shape, np.uint8)
        run_in_bands(
            disparity.shape[0],
            kernel("view_colour.blend"),
            cameras.places,
            sources.planes,
            cameras.shifts,
            cameras.weights,
            disparity,
            settings.tolerance_px,
            settings.edge_trust,
            settings.sharpness,
            view_vectors.fetch_weights(settings.sharpness),
            pixels,
            seen_by,
        )
        painting = pixels, disparity, seen_by, settings.tolerance_px, settings.hole_reach_px
        run_in_bands(disparity.shape[0], kernel("view_holes.paint_holes"), *painting)
        return pixels, seen_by

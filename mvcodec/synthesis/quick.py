"""A synthesizer for pictures that move: the default one's geometry, its colour at a third of the cost.

What it leaves out: the vote asks no camera whether it sees through a surface, colour is fetched linearly and
in whole numbers, and contours are not blended. `mvcodec play` draws with it while the viewpoint or the video
moves and the default would be too slow; a picture that stands is the default's again.
"""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position, Viewpoint
from mvcodec.frames import DecodedSet, RenderedView
from mvcodec.synthesis.camera_spread import FALLBACK
from mvcodec.synthesis.cell_cameras import CellCameras, find_cameras, real_view
from mvcodec.synthesis.view_disparity import Ballot, make_rows
from mvcodec.workers import check_threads, run_all, run_in_bands, threads

TOLERANCE_PX = 1.5
BALLOT = Ballot(tolerance_px=TOLERANCE_PX, ratio=1.3, contrast=0.0, denial=0.0, reach_px=0.54)
HOLE_REACH_PX = 32

NO_LUMA = np.empty((0, 0, 0, 2), np.int16)
"""Nobody denies a surface, so that no picture is looked at for the vote."""


class Quick:
    """The `quick` synthesizer. Thread-safe, one view at a time; keeps its room from one set to the next.

    Args:
        thread_count: how many threads make a view; by default as set for the process.
    """

    def __init__(self, thread_count: int | None = None) -> None:
        check_threads(thread_count)
        self._threads = thread_count
        self._lock = threading.Lock()
        self._decoded: DecodedSet | None = None
        self._ready: set[Position] = set()
        self._packed = np.empty((0, 0, 0), np.uint32)
        self._own = np.empty((0, 0, 0), np.float32)
        self._maps = np.empty((0, 0, 0), np.float32)
        self._extents = np.empty((0, 2), np.float32)

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        """See `Synthesizer.render`. `seen_by` counts the cameras that agree on the pixel's surface."""
        own = real_view(decoded, viewpoint)
        if own is not None:
            return own
        with self._lock, threads(self._threads):
            cameras = self._prepared(decoded, viewpoint)
            return self._render(decoded, viewpoint, cameras)

    def prepare(self, decoded: DecodedSet, viewpoint: Viewpoint) -> None:
        """See `Preparing.prepare`."""
        with self._lock, threads(self._threads):
            self._prepared(decoded, viewpoint)

    def _render(self, decoded: DecodedSet, viewpoint: Viewpoint, cameras: CellCameras) -> RenderedView:
        from mvcodec.kernels.table import kernel
        from mvcodec.kernels.view_quick import WEIGHTS

        background_px = decoded.disparity_range_px[0]
        weights = _whole(cameras.weights, WEIGHTS)
        sources = self._maps, self._extents, NO_LUMA
        disparity = np.empty(self._maps.shape[1:], np.float32)
        pixels = np.empty((*disparity.shape, 3), np.uint8)
        seen_by = np.empty(disparity.shape, np.uint8)

        def make(first: int, last: int) -> None:
            make_rows(*sources, cameras, BALLOT, background_px, disparity, first, last)
            kernel("view_quick.blend")(
                cameras.places,
                self._packed,
                self._own,
                cameras.shifts,
                weights,
                disparity,
                TOLERANCE_PX,
                pixels,
                seen_by,
                first,
                last,
            )

        run_in_bands(disparity.shape[0], make)
        painting = pixels, disparity, seen_by, TOLERANCE_PX, HOLE_REACH_PX
        run_in_bands(disparity.shape[0], kernel("view_holes.paint_holes"), *painting)
        return RenderedView(viewpoint, pixels, disparity, seen_by)

    def _prepared(self, decoded: DecodedSet, viewpoint: Viewpoint) -> CellCameras:
        from mvcodec.kernels.view_planes import extent
        from mvcodec.kernels.view_quick import pack

        if decoded is not self._decoded:
            self._decoded = decoded
            self._ready.clear()
            self._make_room(decoded)
        cameras = find_cameras(decoded, viewpoint, FALLBACK)
        missing = [
            (camera, place)
            for camera, place in zip(cameras.cameras, cameras.places, strict=True)
            if camera not in self._ready
        ]

        def ready(camera: Position, place: int) -> None:
            self._maps[place] = decoded.disparities[camera].values_px
            self._extents[place] = extent(self._maps[place])
            pack(decoded.pictures[camera], self._maps[place], self._packed[place], self._own[place])

        if missing:
            run_all(ready, *zip(*missing, strict=True))
        self._ready.update(camera for camera, _ in missing)
        return cameras

    def _make_room(self, decoded: DecodedSet) -> None:
        from mvcodec.kernels.view_planes import reserve

        array = decoded.array
        count = len(array.real)
        if self._maps.shape != (count, array.height, array.width):
            self._maps = np.empty((count, array.height, array.width), np.float32)
            self._extents = np.empty((count, 2), np.float32)
            wider = count, array.height + 1, array.width + 1
            self._packed, self._own = (
                reserve(wider, np.dtype(np.uint32)),
                reserve(wider, np.dtype(np.float32)),
            )


def _whole(weights: NDArray[np.float32], most: int) -> NDArray[np.uint64]:
    """Weights as whole numbers of the same proportions, each at least 1, in all at most `most`."""
    room = most - len(weights)
    whole: NDArray[np.uint64] = np.floor(weights / weights.sum() * room).astype(np.uint64)
    return whole + np.uint64(1)

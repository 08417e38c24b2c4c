"""The real cameras of a frame set, made ready for fetching."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import partial

import numpy as np

from mvcodec.array import Position
from mvcodec.frames import DecodedSet
from mvcodec.synthesis.camera_spread import measure_spread
from mvcodec.workers import run_all


class Sources:
    """The real cameras of one decoded set, prepared for fetching when a view first needs them.

    `planes` are those of `kernels.view_planes`, indexed by place in `array.real`, as is `extents`, float32
    (R, 2): the least and the greatest disparity of each map, px.
    """

    def __init__(self, decoded: DecodedSet, spread: float | None) -> None:
        from mvcodec.kernels.view_planes import make_room

        array = decoded.array
        self.decoded = decoded
        self.spread = measure_spread(decoded) if spread is None else spread
        self.planes = make_room(len(array.real), array.height, array.width)
        self.extents = np.empty((len(array.real), 2), np.float32)
        self._ready: set[Position] = set()
        self._lock = threading.Lock()

    def prepare(self, cameras: Sequence[Position], tolerance_px: float) -> None:
        """Make these cameras ready, side by side."""
        with self._lock:
            missing = [camera for camera in cameras if camera not in self._ready]
            run_all(partial(self._prepare, tolerance_px=tolerance_px), missing)
            self._ready.update(missing)

    def _prepare(self, camera: Position, tolerance_px: float) -> None:
        from mvcodec.kernels.view_planes import extent, mark_contours, split_luma

        place = self.decoded.array.real.index(camera)
        lumas, colours, disparities, fetchable = self.planes
        split_luma(self.decoded.pictures[camera], lumas[place], colours[place])
        values = self.decoded.disparities[camera].values_px
        disparities[place], self.extents[place] = values, extent(values)
        mark_contours(values, tolerance_px, fetchable[place])

"""Small pictures of a file for the bar of time: of the nearest camera, at the keyframe before."""

from __future__ import annotations

import threading
from pathlib import Path

import cv2
import numpy as np

from mvcodec.array import Viewpoint
from mvcodec.container.limits import Limits
from mvcodec.decoding.frame_store import FrameStore
from mvcodec.frames import Picture

WIDTH_PX = 160
CACHE_BYTES = 1
"""Next to nothing: neighbouring places of the bar are other keyframes."""


class Thumbnails:
    """Reads a file beside whoever plays it, from when it is first asked. Safe to use from several threads."""

    def __init__(self, path: Path, limits: Limits) -> None:
        self._path, self._limits = path, limits
        self._store: FrameStore | None = None
        self._lock = threading.Lock()

    def picture(self, frame: int, viewpoint: Viewpoint) -> Picture | None:
        """uint8 (H, WIDTH_PX, 3) RGB; None where the frame does not exist or is damaged.

        Raises:
            InputError, StreamError: the file cannot be opened any more.
        """
        with self._lock:
            self._store = store = self._store or FrameStore(self._path, CACHE_BYTES, self._limits)
            if not 0 <= frame < store.table.count:
                return None
            decoded = store.fetch(store.table.keyframe_before(frame)).decoded
        if decoded is None:
            return None
        row, col = viewpoint.row, viewpoint.col
        near = min(decoded.pictures, key=lambda camera: (camera[0] - row) ** 2 + (camera[1] - col) ** 2)
        whole = decoded.pictures[near]
        height = max(1, round(whole.shape[0] * WIDTH_PX / whole.shape[1]))
        return np.asarray(cv2.resize(whole, (WIDTH_PX, height), interpolation=cv2.INTER_AREA), np.uint8)

    def close(self) -> None:
        """Let go of the file."""
        with self._lock:
            if self._store is not None:
                self._store.close()

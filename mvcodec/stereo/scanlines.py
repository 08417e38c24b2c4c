"""The disparity of a camera from costs of every level at every pixel, by semi-global matching."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap

BAND_ROWS = 64
"""Rows that are turned at once, for the paths along them: what fits into the caches."""

_STRAIGHT = np.array([0])
_FAN = np.array([-1, 0, 1])


MAX_SUM = 255
"""Most that a cost, a jump and a small step may add up to, since paths count in 8 bits."""
MAX_PENALTIES = 200


@dataclass(frozen=True, slots=True)
class Penalties:
    """Penalties of semi-global matching, in units of the costs.

    Attributes:
        small_step: of a step of one level (P1).
        jump: of any other (P2), halved where grey changes by `contrast` levels.
        least_jump: what is left of it at an edge of the picture.
        contrast: grey levels, above 0.
        diagonal: whether paths run along the diagonals too: eight, else four.

    Raises:
        SettingError: a penalty is negative, or both together leave no room for costs.
    """

    small_step: int
    jump: int
    least_jump: int
    contrast: float
    diagonal: bool = True

    def __post_init__(self) -> None:
        if not min(self.small_step, self.jump, self.least_jump) >= 0 or not self.contrast > 0:
            raise SettingError("Penalties", self, "penalties of at least 0, and contrast above 0")
        if self.small_step + max(self.jump, self.least_jump) > MAX_PENALTIES:
            found = self.small_step + max(self.jump, self.least_jump)
            raise SettingError("Penalties, small_step + jump", found, f"at most {MAX_PENALTIES}")

    def jumps(self) -> NDArray[np.uint8]:
        """uint8 (256,): the penalty of a jump by the difference of grey."""
        difference = np.arange(256)
        return np.asarray(
            np.maximum(self.jump / (1 + difference / self.contrast), self.least_jump) + 0.5, np.uint8
        )


class Scratch:
    """Memory for volumes that is kept from one picture to the next, since fresh memory is slow to come by.

    One matching thread at a time uses one; see `ScratchPool`.
    """

    def __init__(self) -> None:
        self._kept: dict[str, NDArray[Any]] = {}

    def array(self, name: str, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
        """Contiguous memory of that name, its content left as it is."""
        size = math.prod(shape)
        kept = self._kept.get(name)
        if kept is None or kept.size < size or kept.dtype != dtype:
            kept = self._kept[name] = np.empty(size, dtype)
        return kept[:size].reshape(shape)


class ScratchPool:
    """As many `Scratch` as threads ask for at a time."""

    def __init__(self) -> None:
        self._free: SimpleQueue[Scratch] = SimpleQueue()

    @contextmanager
    def lend(self) -> Iterator[Scratch]:
        """One for the length of a block."""
        try:
            scratch = self._free.get_nowait()
        except Empty:
            scratch = Scratch()
        try:
            yield scratch
        finally:
            self._free.put(scratch)


def added_up(
    costs: NDArray[np.uint8], grey: NDArray[np.uint8], penalties: Penalties, scratch: Scratch
) -> NDArray[np.uint16]:
    """The costs along all paths.

    Args:
        costs: uint8 (H, levels, W); see `semiglobal.add_paths`.
        grey: uint8 (H, W), of the camera.
        scratch: holds the result, until it is used again.

    Returns:
        uint16 (H, levels, W).
    """
    from mvcodec.kernels import semiglobal

    jumps, small = penalties.jumps(), penalties.small_step
    shifts = _FAN if penalties.diagonal else _STRAIGHT
    sums = scratch.array("sums", costs.shape, np.uint16)
    sums[:] = 0
    for downwards in (True, False):
        semiglobal.add_paths(costs, grey, jumps, small, shifts, False, downwards, sums)
    _add_along_rows(costs, grey, jumps, small, sums, scratch)
    return sums


def decide(
    costs: NDArray[np.uint8], grey: NDArray[np.uint8], low: int, penalties: Penalties, scratch: Scratch
) -> FloatMap:
    """The disparity of least cost: float32 (H, W), px. `low` is that of level 0; see `added_up`."""
    from mvcodec.kernels import semiglobal

    disparity = np.empty(grey.shape, np.float32)
    semiglobal.winners(added_up(costs, grey, penalties, scratch), low, disparity)
    return disparity


def _add_along_rows(
    costs: NDArray[np.uint8],
    grey: NDArray[np.uint8],
    jumps: NDArray[np.uint8],
    small: int,
    sums: NDArray[np.uint16],
    scratch: Scratch,
) -> None:
    """Paths along rows are paths from row to row of the turned picture."""
    from mvcodec.kernels import semiglobal

    height, levels, width = costs.shape
    for start in range(0, height, BAND_ROWS):
        band = slice(start, start + BAND_ROWS)
        rows = len(grey[band])
        flat = levels * width
        turned = scratch.array("turned", (flat, rows), np.uint8)
        turned_sums = scratch.array("turned sums", (flat, rows), np.uint16)
        back = scratch.array("back", (rows, flat), np.uint16)
        cv2.transpose(costs[band].reshape(rows, flat), turned)
        turned_grey = np.ascontiguousarray(grey[band].T)
        turned_sums[:] = 0
        shape = levels, width, rows
        for forwards in (True, False):
            semiglobal.add_paths(
                turned.reshape(shape),
                turned_grey,
                jumps,
                small,
                _STRAIGHT,
                True,
                forwards,
                turned_sums.reshape(shape),
            )
        cv2.transpose(turned_sums, back)
        of_band = sums[band].reshape(rows, flat)
        cv2.add(of_band, back, of_band)

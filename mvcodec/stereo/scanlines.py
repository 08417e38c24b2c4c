"""The disparity of a camera from costs of every level at every pixel, by semi-global matching."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap

BAND_ROWS, LOOK_AHEAD = 128, 64
"""Rows that are decided at once, and how many below them have a say: what fits into the caches. On pictures
of at most BAND_ROWS + LOOK_AHEAD rows, and wherever no path is longer, bands change nothing."""
TURNED_ROWS = 64
"""Rows that are turned at once, for the paths along them."""


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
        diagonals: whether paths run along the diagonals too: eight, else four.

    Raises:
        SettingError: a penalty is negative, or both together leave no room for costs.
    """

    small_step: int
    jump: int
    least_jump: int
    contrast: float
    diagonals: bool = True

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


CostsOf = Callable[[int, NDArray[np.uint8]], None]
"""Writes the costs of rows from the given one on into uint8 (rows, levels, W)."""


@dataclass(frozen=True, slots=True, eq=False)
class Decided:
    """What semi-global matching found.

    Attributes:
        disparity: float32 (H, W), px.
        partners: float32 (P, H, W), px: the disparity of the partners' pixels by the same sums; infinite
            where nothing is seen.
    """

    disparity: FloatMap
    partners: NDArray[np.float32]


def decide(
    costs_of: CostsOf,
    grey: NDArray[np.uint8],
    low: int,
    levels: int,
    penalties: Penalties,
    scratch: Scratch,
    partner_steps: NDArray[np.float32] | None = None,
) -> Decided:
    """The disparity of least cost, band by band, so that memory holds a band and not the whole volume.

    Paths from above come through all bands. Those from below begin LOOK_AHEAD rows below a band.

    Args:
        costs_of: gives the costs; see `semiglobal.add_paths`.
        grey: uint8 (H, W), of the camera.
        low, levels: disparity of level 0, px, and how many levels there are.
        partner_steps: float32 (P, 2), see `semiglobal.take_partner_winners`; None: nothing about partners.
    """
    from mvcodec.kernels import semiglobal

    height, width = grey.shape
    jumps, small, paths = penalties.jumps(), penalties.small_step, 3 if penalties.diagonals else 1
    above = semiglobal.path_state(levels, width, paths, small)
    costs = scratch.array("costs", (BAND_ROWS + LOOK_AHEAD, levels, width), np.uint8)
    disparity = np.empty((height, width), np.float32)
    steps = np.empty((0, 2), np.float32) if partner_steps is None else partner_steps
    seen = np.full((len(steps), 2, height, width), 65535, np.uint16)
    known = 0
    for start in range(0, height, BAND_ROWS):
        stop = min(start + BAND_ROWS, height)
        reach = min(stop + LOOK_AHEAD, height)
        ahead = known - start if start else 0
        costs[:ahead] = costs[BAND_ROWS : BAND_ROWS + ahead]
        costs_of(start + ahead, costs[ahead : reach - start])
        known = reach
        band = costs[: stop - start]
        sums = scratch.array("sums", band.shape, np.uint16)
        _set_along_rows(band, grey[start:stop], jumps, small, sums, scratch)
        semiglobal.add_paths(band, grey, start, jumps, small, True, start > 0, *above, sums)
        below = semiglobal.path_state(levels, width, paths, small)
        with_below = costs[: reach - start]
        semiglobal.add_paths(with_below, grey, start, jumps, small, False, False, *below, sums)
        semiglobal.winners(sums, low, disparity[start:stop])
        for (by_x, by_y), (least, best) in zip(steps, seen, strict=True):
            semiglobal.take_partner_winners(sums, start, low, by_x, by_y, least, best)
    best = seen[:, 1]
    return Decided(disparity, np.where(best == 65535, np.float32(np.inf), best.astype(np.float32) + low))


def _set_along_rows(
    costs: NDArray[np.uint8],
    grey: NDArray[np.uint8],
    jumps: NDArray[np.uint8],
    small: int,
    sums: NDArray[np.uint16],
    scratch: Scratch,
) -> None:
    """Both paths along rows: paths from row to row of turned bands."""
    from mvcodec.kernels import semiglobal

    height, levels, width = costs.shape
    flat = levels * width
    for start in range(0, height, TURNED_ROWS):
        band = slice(start, start + TURNED_ROWS)
        rows = len(grey[band])
        turned = scratch.array("turned", (flat, rows), np.uint8)
        cv2.transpose(costs[band].reshape(rows, flat), turned)
        turned_grey = np.ascontiguousarray(grey[band].T)
        path = scratch.array("path", (levels, width, rows), np.uint8)
        back = scratch.array("back", (2, rows, flat), np.uint8)
        for forwards, found in zip((True, False), back, strict=True):
            semiglobal.turned_path(
                turned.reshape(levels, width, rows), turned_grey, jumps, small, forwards, path
            )
            cv2.transpose(path.reshape(flat, rows), found)
        cv2.add(back[0], back[1], sums[band].reshape(rows, flat), dtype=cv2.CV_16U)

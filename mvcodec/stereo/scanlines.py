"""The disparity of a camera from costs of every level at every pixel, by semi-global matching."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap

BAND_ROWS, LOOK_AHEAD = 64, 32
"""Rows that are decided at once, and how many below them have a say: what fits into the caches. On pictures
of at most BAND_ROWS + LOOK_AHEAD rows, and wherever no path is longer, bands change nothing."""
CACHE_LINE = 64

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
        """Contiguous memory of that name, its content left as it is; it begins where a cache line does."""
        size = math.prod(shape) * np.dtype(dtype).itemsize
        kept = self._kept.get(name)
        if kept is None or kept.size < size:
            raw = np.empty(size + CACHE_LINE, np.uint8)
            kept = self._kept[name] = raw[-raw.ctypes.data % CACHE_LINE :][:size]
        return kept[:size].view(dtype).reshape(shape)


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
"""Writes the costs of rows from the given one on into uint8 (rows, levels, W'), W' >= W of the picture."""


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
    begins: Sequence[int] = (),
) -> Decided:
    """The disparity of least cost, band by band, so that memory holds a band and not the whole volume.

    Paths from above come through all bands. Those from below begin LOOK_AHEAD rows below a band.

    Args:
        costs_of: gives the costs; see `semiglobal.sum_downwards`.
        grey: uint8 (H, W), of the camera.
        low, levels: disparity of level 0, px, and how many levels there are.
        partner_steps: float32 (P, 2), see `semiglobal.take_partner_winners`; None: nothing about partners.
        begins: columns where another part of a picture begins, which paths along rows do not enter.
    """
    from mvcodec.kernels.byte_vectors import LANES
    from mvcodec.kernels.table import kernel

    height, width = grey.shape
    padded = -(-width // LANES) * LANES
    table, small = penalties.jumps(), penalties.small_step
    ways = (-1, 0, 1) if penalties.diagonals else (0,)
    paths, jumps = len(ways), np.stack([_jumps_down(grey, table, way) for way in ways])
    above = _beginning(paths, levels, padded, scratch, "above")
    costs = scratch.array("costs", (BAND_ROWS + LOOK_AHEAD, levels, padded), np.uint8)
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
        along = _along_rows(band, grey[start:stop], table, small, scratch, begins)
        kernel("semiglobal.sum_downwards")(band, jumps[:, start:stop], small, *above, along, sums)
        # Nothing comes in from below the rows that are looked at.
        ways_up = jumps[:, start : reach + 1].copy()
        ways_up[:, -1] = 0
        below = _beginning(paths, levels, padded, scratch, "below")
        with_below, found = costs[: reach - start], disparity[start:stop]
        kernel("semiglobal.decide_upwards")(
            with_below, ways_up, small, *below, sums, start, low, found, steps, seen
        )
    best = seen[:, 1]
    return Decided(disparity, np.where(best == 65535, np.float32(np.inf), best.astype(np.float32) + low))


def _beginning(
    paths: int, levels: int, width: int, scratch: Scratch, name: str
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Paths before their first row, see `semiglobal.sum_downwards`."""
    from mvcodec.kernels.byte_vectors import LANES
    from mvcodec.kernels.semiglobal import path_size

    rows = scratch.array(name, (2, paths, path_size(levels, width)), np.uint8)
    rows.fill(MAX_SUM)
    return rows, np.zeros((2, paths, LANES + width + LANES), np.uint8)


def _jumps_down(grey: NDArray[np.uint8], table: NDArray[np.uint8], way: int) -> NDArray[np.uint8]:
    """What a jump costs on the way to each pixel from the row above, `way` columns beside it.

    Returns:
        uint8 (H + 1, LANES + W' + LANES); 0 where it comes from outside of the picture.
    """
    from mvcodec.kernels.byte_vectors import LANES

    height, width = grey.shape
    first, last = max(-way, 0), min(width - way, width)
    jumps = np.zeros((height + 1, LANES * (2 - -width // LANES)), np.uint8)
    if height > 1 and first < last:
        changes = cv2.absdiff(grey[1:, first:last], grey[:-1, first + way : last + way])
        jumps[1:height, LANES + first : LANES + last] = cv2.LUT(changes, table)
    return jumps


def _along_rows(
    costs: NDArray[np.uint8],
    grey: NDArray[np.uint8],
    jumps: NDArray[np.uint8],
    small: int,
    scratch: Scratch,
    begins: Sequence[int],
) -> NDArray[np.uint8]:
    """Both paths along rows, uint8 (2, R, levels, W'): those of turned bands of LANES rows."""
    from mvcodec.kernels.byte_vectors import LANES
    from mvcodec.kernels.table import kernel

    height, levels, padded = costs.shape
    width, flat = grey.shape[1], levels * padded
    along = scratch.array("along", (2, height, levels, padded), np.uint8)
    turned = scratch.array("turned", (levels, padded, LANES), np.uint8)
    path = scratch.array("path", (levels, padded, LANES), np.uint8)
    state = scratch.array("state", ((levels + 2) * LANES,), np.uint8)
    turned_jumps = np.zeros((width + 1, LANES), np.uint8)
    for start in range(0, height, LANES):
        rows = min(LANES, height - start)
        band = slice(start, start + rows)
        cv2.transpose(costs[band].reshape(rows, flat), turned.reshape(flat, LANES)[:, :rows])
        if width > 1:
            changes = cv2.absdiff(grey[band, 1:], grey[band, :-1])
            turned_jumps[1:width, :rows] = cv2.LUT(changes, jumps).T
            turned_jumps[list(begins)] = 0
        for forwards, found in zip((True, False), along, strict=True):
            kernel("semiglobal.turned_path")(turned, turned_jumps, small, forwards, state, path)
            cv2.transpose(path.reshape(flat, LANES)[:, :rows], found[band].reshape(rows, flat))
    return along

"""Disparity at a virtual view: real cameras' maps moved there, put to the vote, filled.

Unknown disparity is `UNKNOWN` within these kernels, which a median sorts behind everything known; it
never leaves `mvcodec.synthesis.layered`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels import depth_runs
from mvcodec.kernels.depth_runs import move_run, vote_run
from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.view_fetch import BORDER
from mvcodec.kernels.view_marks import list_bits
from mvcodec.kernels.view_vectors import LEVELS

FloatMap = NDArray[np.float32]

UNKNOWN = np.float32(depth_runs.UNKNOWN)

MARGIN = COUNT
"""Columns beside a moved map, which runs of pixels may read and write."""


@njit(cache=True, nogil=True)
def splat(disparity: FloatMap, shift_x: float, shift_y: float, reach: float, out: FloatMap) -> None:
    """Move a map to a view, nearest surface last.

    Args:
        disparity: float32 (H, W), px.
        shift_x, shift_y: px that a pixel moves (left, up) for each px of disparity.
        reach: a pixel covers the places within this distance (px, 0.5..1); above 0.5 it closes the
            cracks of surfaces that the move stretches.
        out: float32 (H + 2, W + 2 MARGIN), C-contiguous, overwritten: the view with a border of one row and
            MARGIN columns, of which the inner one is where whatever leaves the picture lands; UNKNOWN where
            nothing does.

    Raises:
        ValueError: `out` is of another shape: runs of pixels would be written outside of it.
    """
    height, width = disparity.shape
    if out.shape != (height + 2, width + 2 * MARGIN):
        raise ValueError("a view without its border")
    flat = out.ravel()
    flat[:] = UNKNOWN
    rows = np.int32(0), np.int32(height + 1), np.int32(-1)
    move_rows(disparity, (np.float32(shift_x), np.float32(shift_y)), reach, flat, 0, rows, 0, height)


@njit(cache=True, nogil=True)
def move_rows(disparity, shift, reach, flat, start, rows, first, last):  # type: ignore[no-untyped-def]
    """Move rows first..last-1 of a map; `flat`, `start` and `rows` as in `move_run`."""
    height, width = disparity.shape
    spill = np.float32(1) - np.float32(reach)
    row = np.full(width + COUNT, np.nan, np.float32)
    for y in range(first, last):
        row[:width] = disparity[y]
        for x in range(0, width, COUNT):
            at, size = (np.int32(x), np.int32(y)), (np.int32(width), np.int32(height))
            move_run(row, flat, start, at[0], at[1], size[0], size[1], shift[0], shift[1], spill, rows)


@njit(cache=True, nogil=True, inline="always")
def _pixel(x, y, d, shift):  # type: ignore[no-untyped-def]
    """(column, row) of a camera's pixel nearest to where the view's point (x, y) at d would stand."""
    at_x = np.float32(x) + shift[0] * d + np.float32(0.5)
    at_y = np.float32(y) + shift[1] * d + np.float32(0.5)
    return int(np.floor(at_x)), int(np.floor(at_y))


@njit(cache=True, nogil=True, inline="always")
def _denies(x, y, d, luma, camera, maps, lumas, shift, limits):  # type: ignore[no-untyped-def]
    """Whether a camera sees through the view's point (x, y) at d: something farther, of another luma."""
    height, width = maps.shape[1:]
    column, row = _pixel(x, y, d, shift)
    if not (0 <= column < width and 0 <= row < height):
        return False
    tolerance, contrast = limits
    if maps[camera, row, column] >= d - tolerance:
        return False
    for v in range(row + BORDER - 1, row + BORDER + 2):
        for u in range(column + BORDER - 1, column + BORDER + 2):
            if abs(np.float32(lumas[camera, v, u, 0]) - luma) <= contrast:
                return False
    return True


@njit(cache=True, nogil=True, inline="always")
def _luma_of(x, y, d, who, cameras, lumas, shifts, weights):  # type: ignore[no-untyped-def]
    """Mean luma, in 1 / LEVELS, that the cameras `who` have for the view's point (x, y) at d."""
    height, width = lumas.shape[1] - 2 * BORDER, lumas.shape[2] - 2 * BORDER
    mean = total = np.float32(0)
    for i in who:
        column, row = _pixel(x, y, d, shifts[i])
        column, row = min(max(column, 0), width - 1), min(max(row, 0), height - 1)
        mean += weights[i] * np.float32(lumas[cameras[i], row + BORDER, column + BORDER, 0])
        total += weights[i]
    return mean / total


@njit(cache=True, nogil=True, inline="always")
def _surface(near, who, weights, start, end):  # type: ignore[no-untyped-def]
    """(disparity, weight) of the disparities start..end-1 as one surface."""
    total = mean = np.float32(0)
    for k in range(start, end):
        total += weights[who[k]]
        mean += weights[who[k]] * near[k]
    return mean / total, total


@njit(cache=True, nogil=True)
def _outvote(  # type: ignore[no-untyped-def]
    x, y, near, who, known, cameras, maps, lumas, shifts, weights, limits, ratio, denial
):
    """The winner among `known` disparities, sorted near to far; see `vote`."""
    best, strength = UNKNOWN, np.float32(0)
    start = 0
    while start < known:
        end = start
        while end < known and near[start] - near[end] <= limits[0]:
            end += 1
        mean, total = _surface(near, who, weights, start, end)
        if start == 0 or total > ratio * strength:
            best = mean
            if end == known:  # the last surface has none to defend itself against
                return best
            against = np.float32(0)
            voters = cameras.size if denial > 0 else 0
            luma = (
                _luma_of(x, y, mean, who[start:end], cameras, lumas, shifts, weights)
                if voters
                else np.float32(0)
            )
            for i in range(voters):
                agrees = False
                for k in range(start, end):
                    agrees |= who[k] == i
                if not agrees and _denies(x, y, mean, luma, cameras[i], maps, lumas, shifts[i], limits):
                    against += weights[i]
            strength = max(total - denial * against, np.float32(0))
        start = end
    return best


@njit(cache=True, nogil=True)
def vote(
    moved: NDArray[np.float32],
    wrap: int,
    cameras: NDArray[np.int64],
    maps: NDArray[np.float32],
    lumas: NDArray[np.int16],
    shifts: NDArray[np.float32],
    weights: NDArray[np.float32],
    tolerance: float,
    contrast: float,
    ratio: float,
    denial: float,
    out: FloatMap,
    wrap_out: int,
    first: int,
    last: int,
) -> None:
    """One disparity for each pixel from the cameras' moved maps, rows first..last-1.

    Disparities within `tolerance` px of the nearest one of their group are one surface. Surfaces are
    tried near to far; a farther one wins when its cameras weigh more than `ratio` times the winner so
    far: the cameras that say that one, less `denial` times those that deny it, because they see
    something farther in its place, and nothing within `contrast` of its luma in the 3 x 3 window
    there. So a wrong near disparity is outvoted, while one that is hidden from the others holds.

    Args:
        moved: float32 (N, rows, W + 2 MARGIN), C-contiguous, px, or UNKNOWN: rows of what `splat` makes.
        wrap: the bits of a row's number, counted with the border, that say which row of `moved` it is.
        cameras: int64 (N,), which of the R real cameras were moved.
        maps: float32 (R, H, W), px, of every real camera.
        lumas: int16 (R, H + 4, W + 4, 2), see `view_planes.split_luma`; of any size where denial is 0.
        shifts: float32 (N, 2), px (x, y) from the view to the camera for each px of disparity.
        weights: float32 (N,), of the cameras, above 0.
        out: float32 (rows, W), rows first..last-1 overwritten; UNKNOWN where no camera knows.
        wrap_out: the bits of a row's number that say which row of `out` it is.
    """
    count, width = moved.shape[0], out.shape[1]
    near = np.empty(count, np.float32)
    who = np.empty(count, np.int64)
    near_px, least, share = np.float32(tolerance), np.float32(ratio), np.float32(denial)
    limits = near_px, np.float32(LEVELS * contrast)
    flat, mean = moved.ravel(), np.empty(width + COUNT, np.float32)
    step, stride = moved.shape[1] * moved.shape[2], moved.shape[2]
    chosen = np.empty(width + COUNT, np.int32)
    for y in range(first, last):
        apart, row = 0, (y + 1) & wrap
        for x in range(0, width, COUNT):
            found = vote_run(flat, weights, mean, row * stride + MARGIN + x, step, x, near_px)
            apart = list_bits(found, x, chosen, apart)
        for x in chosen[:apart]:
            known = 0
            for i in range(count):
                d = moved[i, row, x + MARGIN]
                if d > UNKNOWN:
                    place = known
                    while place > 0 and near[place - 1] < d:
                        near[place] = near[place - 1]
                        who[place] = who[place - 1]
                        place -= 1
                    near[place] = d
                    who[place] = i
                    known += 1
            mean[x] = _outvote(
                x, y, near, who, known, cameras, maps, lumas, shifts, weights, limits, least, share
            )
        out[y & wrap_out] = mean[:width]


@njit(cache=True, nogil=True)
def fill_background(disparity: FloatMap, fallback: float, first: int, last: int) -> None:
    """Fill unknown pixels in place with the farther end of their gap on the row, rows first..last-1.

    What a view sees and no camera did lies behind the nearer surface. A row without any known pixel
    takes `fallback`.
    """
    _, width = disparity.shape
    for y in range(first, last):
        unknown = 0
        for x in range(width):
            unknown += disparity[y, x] <= UNKNOWN
        x = 0 if unknown else width
        while x < width:
            if disparity[y, x] > UNKNOWN:
                x += 1
                continue
            end = x
            while end < width and disparity[y, end] <= UNKNOWN:
                end += 1
            farther = np.float32(np.inf)
            if x > 0:
                farther = disparity[y, x - 1]
            if end < width:
                farther = min(farther, disparity[y, end])
            if np.isinf(farther):
                farther = np.float32(fallback)
            disparity[y, x:end] = farther
            x = end

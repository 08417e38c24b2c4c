"""A camera's picture and what other cameras see of the same surfaces, mixed as far as they may be trusted."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def mix(
    own: NDArray[np.uint8],
    others: NDArray[np.uint8],
    seen_by: NDArray[np.uint8],
    squares: NDArray[np.float32],
    counts: NDArray[np.float32],
    error: float,
    most: float,
    out: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Move each pixel towards the others' by error / (mean square of the difference around it).

    Args:
        own, others: uint8 (H, W, 3), RGB.
        seen_by: uint8 (H, W); where 0, no other camera sees the pixel, and it stays as it is.
        squares: float32 (H, W), squared differences summed over a window, grey levels squared.
        counts: float32 (H, W), pixels of that window that others see; above 0 where `seen_by` is.
        error: mean squared error of `own` that others don't share, grey levels squared.
        most: 0..1; no pixel moves by more than this part of the difference.
        out: uint8 (H, W, 3), rows first..last-1 overwritten.
    """
    part, limit, half = np.float32(error), np.float32(most), np.float32(0.5)
    for y in range(first, last):
        for x in range(own.shape[1]):
            weight = np.float32(0)
            if seen_by[y, x] > 0:
                share = part * counts[y, x]
                weight = limit if share >= limit * squares[y, x] else share / squares[y, x]
            for c in range(3):
                here = np.float32(own[y, x, c])
                out[y, x, c] = np.uint8(here + weight * (np.float32(others[y, x, c]) - here) + half)

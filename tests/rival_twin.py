"""What `mvcodec.kernels.rival_matches` says, in plain NumPy."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from mvcodec.kernels.rival_matches import OWN_PX, RADIUS, WINDOW


def window_sums(pixels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Sums over each window, mirrored beyond the border."""
    mirrored = np.pad(pixels, RADIUS, mode="reflect")
    return np.asarray(sliding_window_view(mirrored, (WINDOW, WINDOW)).sum(axis=(2, 3)), np.int64)


def compare_places(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    disparity: NDArray[np.float32],
    lowest: int,
    highest: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(own, other): best correlations; -1 where nothing was compared."""
    one, two = left.astype(np.int64), right.astype(np.int64)
    sums = window_sums(one), window_sums(two)
    pixels, width = WINDOW**2, left.shape[1]
    contrasts = [
        np.maximum(pixels * window_sums(grey**2) - total**2, 1e-3 * pixels**2)
        for grey, total in zip((one, two), sums, strict=True)
    ]
    own, other = np.full((2, *left.shape), -1.0)
    for shift in range(lowest, highest + 1):
        first, last = max(shift, 0), min(width + shift, width)
        if last - first < WINDOW:
            continue
        here, there = np.s_[:, first:last], np.s_[:, first - shift : last - shift]
        covariance = pixels * window_sums(one[here] * two[there]) - sums[0][here] * sums[1][there]
        found = covariance / np.sqrt(contrasts[0][here] * contrasts[1][there])
        near = np.abs(disparity[here] - shift) < OWN_PX
        for best, wanted in ((own, near), (other, ~near)):
            np.maximum(best[here], np.where(wanted, found, -1), out=best[here])
    return own, other

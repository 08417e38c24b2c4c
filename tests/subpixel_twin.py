"""Plain twin of the kernel of sub-pixel refinement: one pixel after the other, as it is described."""

from __future__ import annotations

import numpy as np

from mvcodec.frames import FloatMap


def cubic(samples: list[float], t: float, a: float = -0.75) -> float:
    """Cubic convolution (Keys 1981) of four samples, t after the second."""

    def weight(distance: float) -> float:
        x = abs(distance)
        if x <= 1:
            return (a + 2) * x**3 - (a + 3) * x**2 + 1
        return a * x**3 - 5 * a * x**2 + 8 * a * x - 4 * a

    return sum(sample * weight(t + 1 - place) for place, sample in enumerate(samples))


def add_pull(
    disparity: FloatMap,
    grey: FloatMap,
    other: tuple[FloatMap, FloatMap, FloatMap],
    along_rows: bool,
    step: float,
    same_surface: float,
    grey_scale: float,
) -> tuple[FloatMap, FloatMap]:
    """(pull, weight); other: grey, slope, disparity of the partner."""
    pull, weight = np.zeros_like(disparity), np.zeros_like(disparity)
    for y, x in np.ndindex(*disparity.shape):
        values, slopes, there = (plane[y] if along_rows else plane[:, x] for plane in other)
        at = (x if along_rows else y) - step * float(disparity[y, x])
        last = len(values) - 1
        if not 0 <= at <= last or abs(float(there[round(at)] - disparity[y, x])) >= same_surface:
            continue
        here = int(at)
        near = [float(values[min(max(here + i, 0), last)]) for i in (-1, 0, 1, 2)]
        slope = np.interp(at, np.arange(last + 1), slopes)
        residual = float(grey[y, x]) - cubic(near, at - here)
        trust = 1 / (1 + (residual / grey_scale) ** 2)
        pull[y, x] = trust * -step * slope * residual
        weight[y, x] = trust * (step * slope) ** 2
    return pull, weight

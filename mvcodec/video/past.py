"""A prediction with its share of the last picture of the same place; see FORMAT.md ("Predicted pictures").

What synthesis and the past miss has little to do with each other: their mean misses less than either. Where
the picture has moved to is found by both sides alike, in the prediction; no motion is sent for it.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.video.codec import Plane, Planes
from mvcodec.workers import run_in_bands

SHARES = ((24, 768, 9, 4), (32, 1536, 10, 4))
"""Shares of the past as `mvcodec.kernels.prediction_past.blend` has them, from the least on. What moves by
less than a quarter of a pixel has none: the coder has that itself, its last picture as it is."""

MOST_SHARE = len(SHARES)
"""Units count them from 1 on; 0 is none."""

PAYS = 0.98
"""What is missed with a share of the past costs so many of the bits that as much would without, where the
past is as good: it is less like the edges of things. Where the past is worse mixing blurs, and it is the
other way round (`docs/measurements.md`)."""

AS_GOOD = 1.5
"""The past alone misses less than so many times what the better of it and the prediction does."""

ALL = 64, 1 << 20, 0, 0
"""The past alone."""

Padded = NDArray[np.int16]


def _cubic() -> NDArray[np.int32]:
    """Keys' cubic (a = -0.7) in 128ths at each sixteenth of a pixel: int32 (16, 4)."""
    t = np.arange(16) / 16
    first, third, fourth = (
        np.floor(128 * tap + 0.5).astype(np.int32)
        for tap in (_far(1 + t), 1.3 * (1 - t) ** 3 - 2.3 * (1 - t) ** 2 + 1, _far(2 - t))
    )
    return np.stack([first, 128 - first - third - fourth, third, fourth], axis=1)


def _far(s: NDArray[np.float64]) -> NDArray[np.float64]:
    return -0.7 * s**3 + 3.5 * s**2 - 5.6 * s + 2.8


TAPS = _cubic()
"""What luma is fetched with, as from other places."""


class Past:
    """What a track's last picture adds to the prediction of the next one.

    Args:
        prediction: the planes of a place, predicted from other places; even sizes.
        past: the track's last picture as decoded, of the same size.
    """

    def __init__(self, prediction: Planes, past: Planes) -> None:
        from mvcodec.kernels.prediction_past import BLOCK, follow, search

        self._prediction, self._past = prediction, past
        self._now, self._before = _levels(prediction.y), _levels(past.y)
        height, width = prediction.y.shape
        rows = -(-height // BLOCK)
        self._motion = np.empty((rows, -(-width // BLOCK), 2), np.int32)
        run_in_bands(rows, search, self._now[-1], self._before[-1], self._motion)
        for level in reversed(range(len(self._now))):
            run_in_bands(rows, follow, self._now[level], self._before[level], level, self._motion)
            if level:
                self._motion *= 2

    def luma(self, share: tuple[int, int, int, int]) -> tuple[Plane, NDArray[np.int32]]:
        """The prediction's luma with a share of the past, and that share; see `prediction_past.blend`."""
        from mvcodec.kernels.prediction_past import BLOCK, blend

        (rows, columns, _), (height, width) = self._motion.shape, self._prediction.y.shape
        y = np.empty((BLOCK * rows, BLOCK * columns), np.uint8)
        shares = np.empty((2 * rows, 2 * columns), np.int32)
        run_in_bands(rows, blend, self._now[0], self._before[0], TAPS, self._motion, share, y, shares)
        return np.ascontiguousarray(y[:height, :width]), shares

    def blended(self, share: int) -> Planes:
        """The prediction with a share of the past, 1 (least)..MOST_SHARE."""
        from mvcodec.kernels.prediction_past import BLOCK, blend_chroma

        y, shares = self.luma(SHARES[share - 1])
        rows, columns, _ = self._motion.shape
        chroma = []
        for plane, earlier in ((self._prediction.u, self._past.u), (self._prediction.v, self._past.v)):
            out = np.empty((BLOCK // 2 * rows, BLOCK // 2 * columns), np.uint8)
            run_in_bands(rows, blend_chroma, _padded(plane), _padded(earlier), self._motion, shares, out)
            chroma.append(np.ascontiguousarray(out[: plane.shape[0], : plane.shape[1]]))
        return Planes(y, *chroma)


def best_share(prediction: Planes, past: Planes, original: Planes) -> tuple[int, Planes]:
    """The share of the past that leaves least to be coded, 0 for none, and the prediction with it.

    The coder can take each block from the past as well: only what the better of both misses counts.
    """
    found = Past(prediction, past)
    moved = _missed(found.luma(ALL)[0], original.y)

    def left(luma: Plane) -> float:
        return float(np.minimum(_missed(luma, original.y), moved).sum())

    costs = [left(prediction.y)]
    factor = PAYS if float(moved.sum()) < AS_GOOD * costs[0] else 1 / PAYS
    costs += [factor * left(found.luma(SHARES[share - 1])[0]) for share in range(1, MOST_SHARE + 1)]
    best = costs.index(min(costs))
    return best, found.blended(best) if best else prediction


def _missed(luma: Plane, original: Plane) -> NDArray[np.float32]:
    """Mean squared errors of blocks of about 8 x 8 pixels."""
    apart = cv2.absdiff(luma, original)
    squares = cv2.multiply(apart, apart, dtype=cv2.CV_32F)
    size = -(-luma.shape[1] // 8), -(-luma.shape[0] // 8)
    return np.asarray(cv2.resize(squares, size, interpolation=cv2.INTER_AREA), np.float32)


def _padded(plane: Plane) -> Padded:
    from mvcodec.kernels.prediction_past import widen

    found = _reserve(plane.shape[0], plane.shape[1])
    widen(plane, found)
    return found


def _reserve(height: int, width: int) -> Padded:
    from mvcodec.kernels.prediction_past import PAD

    return np.empty((height + 2 * PAD, width + 2 * PAD), np.int16)


def _levels(luma: Plane) -> list[Padded]:
    """A plane with a border, and at half and at quarter size."""
    from mvcodec.kernels.prediction_past import LEVELS, halve

    height, width = luma.shape
    found = [_padded(luma)]
    for level in range(1, LEVELS):
        found.append(_reserve(-(-height >> level), -(-width >> level)))
        halve(found[-2], found[-1])
    return found

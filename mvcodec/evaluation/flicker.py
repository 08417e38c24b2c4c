"""Flicker of synthesised video: error that changes from frame to frame.

The quantity under the peak signal to perceptible temporal noise ratio of Zhao and Yu (A perceptual metric for
evaluating quality of synthesized sequences in 3DV system, VCIP 2010), without its threshold of perception: a
constant error (a shifted contour, a tint) is static and does not count, one that comes and goes does.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.evaluation.metrics import decibel, luma
from mvcodec.frames import Picture


class FlickerMeter:
    """Temporal PSNR of one view, its frames pushed in order.

    Temporal noise of frame t is ``(s[t] - s[t-1]) - (o[t] - o[t-1])``, s the synthesised and o the original
    pictures' luma: what changes in the one and not in the other. Its mean square, over all pixels of all
    frames from the second on, stands in for the mean squared error.

    Attributes:
        frames: how many were pushed.
    """

    def __init__(self) -> None:
        self.frames = 0
        self._before: NDArray[np.int16] | None = None
        self._total = self._count = 0

    def push(self, original: Picture, picture: Picture) -> None:
        """Measure the next frame.

        Args:
            original, picture: uint8 (H, W, 3) RGB, or uint8 (H, W) luma.

        Raises:
            SettingError: the pictures differ in size.
        """
        if original.shape[:2] != picture.shape[:2]:
            sizes = " and ".join(f"{p.shape[1]}x{p.shape[0]}" for p in (original, picture))
            raise SettingError("temporal_psnr", sizes, "pictures of equal size")
        error = luma(picture).astype(np.int16) - luma(original)
        if self._before is not None:
            change = error.astype(np.int32) - self._before
            self._total += int(np.square(change).sum(dtype=np.int64))
            self._count += change.size
        self._before, self.frames = error, self.frames + 1

    def result(self) -> float:
        """Peak signal to temporal noise ratio of luma, dB; the more the steadier, 100 dB without any flicker.

        Raises:
            SettingError: fewer than two frames were pushed.
        """
        if self.frames < 2:
            raise SettingError("temporal_psnr", f"{self.frames} frames", "at least two")
        return decibel(self._total / self._count)


def temporal_psnr(originals: Iterable[Picture], pictures: Iterable[Picture]) -> float:
    """The result of a `FlickerMeter` for two sequences, which are read in step.

    Raises:
        SettingError: fewer than two frames, more of one kind than of the other, or of other sizes.
    """
    meter = FlickerMeter()
    for original, picture in zip_longest(originals, pictures):
        if original is None or picture is None:
            raise SettingError("temporal_psnr", "sequences of different length", "as many of each")
        meter.push(original, picture)
    return meter.result()

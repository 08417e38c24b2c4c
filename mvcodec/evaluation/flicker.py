"""Flicker of synthesised video: error that changes from frame to frame.

The quantity under the peak signal to perceptible temporal noise ratio of Zhao and Yu (A perceptual metric for
evaluating quality of synthesized sequences in 3DV system, VCIP 2010), without its threshold of perception: a
constant error (a shifted contour, a tint) is static and does not count, one that comes and goes does.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.evaluation.metrics import IDENTICAL_PSNR_DB, PEAK, luma
from mvcodec.frames import Picture


def temporal_psnr(originals: Iterable[Picture], pictures: Iterable[Picture]) -> float:
    """Peak signal to temporal noise ratio of luma, dB; the more the steadier, 100 dB without any flicker.

    Temporal noise of frame t is ``(s[t] - s[t-1]) - (o[t] - o[t-1])``, s the synthesised and o the original
    pictures' luma: what changes in the one and not in the other. Its mean square, over all pixels of all
    frames from the second on, stands in for the mean squared error.

    Args:
        originals, pictures: uint8 (H, W, 3) RGB, or uint8 (H, W) luma, frame by frame; read in step.

    Raises:
        SettingError: fewer than two frames, more of one kind than of the other, or of other sizes.
    """
    before: NDArray[np.int32] | None = None
    total, count, frames = 0, 0, 0
    try:
        for original, picture in zip(originals, pictures, strict=True):
            if original.shape[:2] != picture.shape[:2]:
                sizes = " and ".join(f"{p.shape[1]}x{p.shape[0]}" for p in (original, picture))
                raise SettingError("temporal_psnr", sizes, "pictures of equal size")
            error = luma(picture).astype(np.int32) - luma(original)
            if before is not None:
                total += int(np.square(error - before).sum(dtype=np.int64))
                count += error.size
            before, frames = error, frames + 1
    except ValueError as mismatch:
        if isinstance(mismatch, SettingError):
            raise
        raise SettingError("temporal_psnr", "sequences of different length", "as many of each") from None
    if frames < 2:
        raise SettingError("temporal_psnr", f"{frames} frames", "at least two")
    return IDENTICAL_PSNR_DB if total == 0 else float(10 * np.log10(PEAK * PEAK * count / total))

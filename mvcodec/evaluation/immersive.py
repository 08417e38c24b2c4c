"""IV-PSNR, MPEG's metric for synthesised views: PSNR that forgives small shifts and a tint of the whole.

Dziembowski, Mieloch, Stankowski, Grzelka: IV-PSNR - the objective quality metric for immersive video
applications, IEEE Transactions on Circuits and Systems for Video Technology 32 (11), 2022; software:
MPEG's QMIV (Stankowski and Dziembowski, SoftwareX 24, 2023), whose default settings these are.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.evaluation.metrics import IDENTICAL_PSNR_DB, PEAK
from mvcodec.frames import Picture

SHIFT_PX = 2
"""Corresponding pixels are sought up to this far to each side."""

UNNOTICEABLE = 0.01
"""Largest global difference of colour that is forgiven, of the full range."""

COMPONENT_WEIGHTS = (4, 1, 1)
"""Y, Cb, Cr."""

_Components = NDArray[np.int32]


def iv_psnr(original: Picture, picture: Picture) -> float:
    """IV-PSNR in dB; 100 dB for a component without any error.

    Each pixel is compared with the most similar one of the 5 x 5 around its place in the other picture,
    after the mean difference of the pictures (3 grey levels at most) was taken out; the weighted mean of
    the components' PSNR is taken both ways, and the worse one counts. MPEG measures the components of its
    4:2:0 streams; here they are full-range BT.601 of the RGB pictures, not subsampled.

    Args:
        original, picture: uint8 (H, W, 3) RGB.

    Raises:
        SettingError: the pictures differ in size.
    """
    if original.shape != picture.shape:
        sizes = " and ".join(f"{p.shape[1]}x{p.shape[0]}" for p in (original, picture))
        raise SettingError("pictures", sizes, "pictures of equal size")
    first, second = _components(original), _components(picture)
    limit = round(UNNOTICEABLE * PEAK)
    shift = np.floor((first - second).mean(axis=(0, 1)) + 0.5).astype(np.int32).clip(-limit, limit)
    return min(_one_way(first, second + shift), _one_way(second, first - shift))


def _components(picture: Picture) -> _Components:
    """int32 (H, W, 3): Y, Cb, Cr."""
    swapped = cv2.cvtColor(picture, cv2.COLOR_RGB2YCrCb)
    return np.ascontiguousarray(swapped[..., [0, 2, 1]], np.int32)


def _one_way(reference: _Components, tested: _Components) -> float:
    """Mean PSNR of `tested` against the most similar pixels of `reference`, repeated at its borders."""
    height, width = tested.shape[:2]
    padded = np.pad(reference, ((SHIFT_PX, SHIFT_PX), (SHIFT_PX, SHIFT_PX), (0, 0)), mode="edge")
    weights = np.array(COMPONENT_WEIGHTS, np.int32)
    least = np.full((height, width), np.iinfo(np.int32).max, np.int32)
    errors = np.zeros((height, width, 3), np.int32)
    for y in range(2 * SHIFT_PX + 1):
        for x in range(2 * SHIFT_PX + 1):
            squares = np.square(tested - padded[y : y + height, x : x + width])
            total = squares @ weights
            better = total < least
            np.copyto(least, total, where=better)
            np.copyto(errors, squares, where=better[..., None])
    means = errors.mean(axis=(0, 1), dtype=np.float64)
    decibels = [
        IDENTICAL_PSNR_DB if mean == 0 else min(10 * np.log10(PEAK**2 / mean), IDENTICAL_PSNR_DB)
        for mean in means
    ]
    return float(np.average(decibels, weights=weights))

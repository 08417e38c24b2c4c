"""Where the error of a synthesised view sits: filled pixels, depth edges, flat regions, texture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.evaluation.metrics import Luma, decibel, luma
from mvcodec.evaluation.regions import near_edges
from mvcodec.frames import DisparityMap, Mask, Picture, RenderedView

REGIONS = ("filled", "edges", "flat", "texture")
"""A pixel is in the first one that fits."""

FLAT_SQUARED_GRADIENT = 4.0
FLAT_WINDOW = 3
"""Flat is where the mean squared gradient of this window is lower: the "textureless" regions of Scharstein
and Szeliski (IJCV 47, 2002), with the larger of both directions in place of the horizontal one alone."""

WORST_SHARE = 0.02

NOISE_KERNEL = np.outer([1, -2, 1], [1, -2, 1]).astype(np.float32)
"""Blind to constant, linear and one-directional changes (Immerkaer, CVIU 64, 1996)."""
NOISE_GAIN = 6.0
"""The root of the kernel's sum of squares."""
LOWER_HALF_MEAN = 0.3247
"""Mean of the smaller half of a normal variable's magnitudes, in standard deviations."""


@dataclass(frozen=True, slots=True)
class RegionError:
    """One region, over all measured views together.

    Attributes:
        share: of all pixels, 0..1.
        error_share: of the squared luma error, 0..1; None where there is no error at all.
        psnr_y: luma PSNR inside it, dB; None where it is empty.
    """

    share: float
    error_share: float | None
    psnr_y: float | None


@dataclass(frozen=True, slots=True)
class ErrorShares:
    """Where the squared luma error of all measured views together sits; shares are None where there is none.

    Attributes:
        regions: by name, in the order of REGIONS.
        worst_share: of the error, in the 2 % of each view's pixels that have the largest one.
        brightness_share: of the error, what would vanish if every view had its original's mean luma.
        noise_share: of the error, what the originals' own noise would make of a perfect view: at most, since
            fine texture passes for noise (`noise_variance`).
    """

    regions: Mapping[str, RegionError]
    worst_share: float | None
    brightness_share: float | None
    noise_share: float | None

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values by name."""
        regions = {name: asdict(region) for name, region in self.regions.items()}
        return {
            "regions": regions,
            "worst_share": self.worst_share,
            "brightness_share": self.brightness_share,
            "noise_share": self.noise_share,
        }


class ErrorMeter:
    """Adds up where the error of rendered views sits."""

    def __init__(self) -> None:
        self._pixels = np.zeros(len(REGIONS), np.int64)
        self._errors = np.zeros(len(REGIONS), np.int64)
        self._worst, self._brightness, self._noise = 0, 0.0, 0.0

    def push(self, original: Picture, view: RenderedView) -> None:
        """Measure one view.

        Args:
            original: uint8 (H, W, 3) RGB, the view as it was taken.
        """
        difference = luma(view.pixels).astype(np.int64) - luma(original)
        squares = np.square(difference)
        numbers = region_numbers(original, view)
        for number in range(len(REGIONS)):
            self._pixels[number] += np.count_nonzero(numbers == number)
            self._errors[number] += squares[numbers == number].sum()
        worst = max(1, round(WORST_SHARE * squares.size))
        self._worst += int(np.partition(squares, -worst, axis=None)[-worst:].sum())
        self._brightness += float(difference.mean()) ** 2 * difference.size
        self._noise += noise_variance(luma(original)) * difference.size

    def result(self) -> ErrorShares:
        """The shares over what was pushed so far, one view at least."""
        pixels, errors = int(self._pixels.sum()), int(self._errors.sum())
        regions = {
            name: RegionError(
                share=float(count / pixels),
                error_share=float(error / errors) if errors else None,
                psnr_y=decibel(float(error / count)) if count else None,
            )
            for name, count, error in zip(REGIONS, self._pixels, self._errors, strict=True)
        }
        if not errors:
            return ErrorShares(regions, None, None, None)
        noise = min(1.0, self._noise / errors)
        return ErrorShares(regions, self._worst / errors, self._brightness / errors, noise)


def region_numbers(original: Picture, view: RenderedView) -> NDArray[np.uint8]:
    """The region of each pixel as an index into REGIONS, uint8 (H, W).

    Edges are those of the view's own disparity (`regions.near_edges`), so what lies at an edge that the maps
    missed counts as flat or texture.

    Args:
        original: uint8 (H, W, 3) RGB, which decides what is flat.
    """
    filled = view.seen_by == 0
    edges = near_edges(DisparityMap(view.disparity_px, np.ones(filled.shape, np.bool_)))
    numbers = np.select([filled, edges, flat(luma(original))], [0, 1, 2], 3)
    return numbers.astype(np.uint8)


def flat(plane: Luma) -> Mask:
    """Where a picture has no texture, bool (H, W)."""
    values = np.pad(plane.astype(np.float32), ((0, 1), (0, 1)), mode="edge")
    across, down = np.square(np.diff(values, axis=1)[:-1]), np.square(np.diff(values, axis=0)[:, :-1])
    window = (FLAT_WINDOW, FLAT_WINDOW)
    means = [cv2.blur(squares, window, borderType=cv2.BORDER_REPLICATE) for squares in (across, down)]
    return np.asarray(np.maximum(*means) < FLAT_SQUARED_GRADIENT)


def noise_variance(plane: Luma) -> float:
    """Variance of a picture's noise, squared grey levels, from the half of its pixels that change least.

    0 where the picture has no pixel with a neighbour on every side.
    """
    found = np.abs(cv2.filter2D(plane.astype(np.float32), -1, NOISE_KERNEL)[1:-1, 1:-1])
    if found.size == 0:
        return 0.0
    lower = np.partition(found, found.size // 2, axis=None)[: found.size // 2 + 1]
    return float((lower.mean() / (NOISE_GAIN * LOWER_HALF_MEAN)) ** 2)

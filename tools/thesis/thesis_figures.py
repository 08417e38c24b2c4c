"""What is measured of a synthesised picture, and the thesis's own figures beside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any, Self

import numpy as np

from mvcodec.errors import InputError
from mvcodec.evaluation.metrics import luma, psnr, psnr_saturated, ssim
from mvcodec.frames import DisparityMap, Mask, Picture
from mvcodec.layers.dils_split import THRESHOLD, average_px
from mvcodec.layers.splits import LAYER_SPLITS

Step = Callable[[], object]
"""Called whenever one of a table's measurements is done."""


def no_step() -> None:
    """The step of those who don't watch."""


@dataclass(frozen=True, slots=True)
class ViewFigures:
    """Figures of one picture, or their means over several.

    Attributes:
        psnr_saturated: what the thesis calls PSNR, dB.
        psnr: of luma, dB.
        ssim: of luma.
        hole_share: of the pixels (0..1) that no camera's picture gave; they are black or filled.
        hole_error_share: of luma's squared error (0..1) that sits there; 0 without any error.
    """

    psnr_saturated: float
    psnr: float
    ssim: float
    hole_share: float = 0.0
    hole_error_share: float = 0.0

    @classmethod
    def measure(cls, original: Picture, picture: Picture, holes: Mask | None = None) -> Self:
        """Compare a synthesised picture with its original, uint8 (H, W, 3) RGB.

        Args:
            holes: bool (H, W), where no camera's picture gave the pixel; none by default.
        """
        compared = psnr_saturated(original, picture), psnr(original, picture), ssim(original, picture)
        if holes is None:
            return cls(*compared)
        error = (luma(original).astype(np.float64) - luma(picture)) ** 2
        total = float(error.sum())
        return cls(*compared, float(holes.mean()), float(error[holes].sum()) / total if total else 0.0)

    @classmethod
    def mean(cls, figures: Sequence[ViewFigures]) -> Self:
        """Mean of each figure."""
        return cls(*(fmean(getattr(f, name) for f in figures) for name in cls.__slots__))


@dataclass(frozen=True, slots=True)
class LayerFigures:
    """How a split cuts a disparity map into layers.

    Attributes:
        count: of layers.
        deepest: disparities in the deepest layer.
        largest_share: of the pixels (0..1) that the largest layer holds.
        shift_error_px: mean distance of the pixels' disparities from the average of their layer, by which
            DILS moves all of it.
    """

    count: int
    deepest: int
    largest_share: float
    shift_error_px: float

    @classmethod
    def measure(cls, disparity: DisparityMap, split: str, threshold: int = THRESHOLD) -> Self:
        """Split a map, by a name of LAYER_SPLITS, and measure its layers; all 0 where there is none."""
        layers = LAYER_SPLITS[split](disparity, threshold)
        if not layers.bounds_px:
            return cls(0, 0, 0.0, 0.0)
        inside = layers.labels > 0
        averages = np.array([0, *(average_px(bounds) for bounds in layers.bounds_px)])[layers.labels]
        return cls(
            len(layers.bounds_px),
            max(last - first + 1 for first, last in layers.bounds_px),
            float(np.bincount(layers.labels[inside]).max() / layers.labels.size),
            float(np.abs(disparity.values_px - averages)[inside].mean()),
        )


class ThesisTables:
    """The thesis's figures, by table, from a JSON document.

    Args:
        path: of the document.

    Raises:
        InputError: it is missing or not a JSON object.
    """

    def __init__(self, path: Path) -> None:
        try:
            document = json.loads(path.read_text())
        except OSError as error:
            raise InputError(path, error.strerror or "an unreadable file", "the thesis's tables") from None
        except ValueError:
            raise InputError(path, "no JSON", "the thesis's tables") from None
        if not isinstance(document, Mapping):
            raise InputError(path, "no JSON object", "the thesis's tables")
        self._path, self._document = path, document

    def at(self, *keys: str | int) -> Any:
        """The entry below these keys.

        Raises:
            InputError: there is none.
        """
        entry: Any = self._document
        for depth, key in enumerate(keys):
            try:
                entry = entry[key]
            except (KeyError, IndexError, TypeError):
                place = "/".join(map(str, keys[: depth + 1]))
                raise InputError(self._path, f"no entry {place}", "the thesis's tables") from None
        return entry

"""What is measured of a synthesised picture, and the thesis's own figures beside it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any, Self

from mvcodec.errors import InputError
from mvcodec.evaluation.metrics import psnr, psnr_saturated, ssim
from mvcodec.frames import Picture


@dataclass(frozen=True, slots=True)
class ViewFigures:
    """Figures of one picture, or their means over several.

    Attributes:
        psnr_saturated: what the thesis calls PSNR, dB.
        psnr: of luma, dB.
        ssim: of luma.
    """

    psnr_saturated: float
    psnr: float
    ssim: float

    @classmethod
    def measure(cls, original: Picture, picture: Picture) -> Self:
        """Compare a synthesised picture with its original, uint8 (H, W, 3) RGB."""
        return cls(psnr_saturated(original, picture), psnr(original, picture), ssim(original, picture))

    @classmethod
    def mean(cls, figures: Sequence[ViewFigures]) -> Self:
        """Mean of each figure."""
        return cls(*(fmean(getattr(f, name) for f in figures) for name in cls.__slots__))


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

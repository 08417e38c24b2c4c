"""Quality by provenance: how good the pixels are that no real camera saw, or one, or several."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import CameraArray, Position
from mvcodec.capture.picture_files import read_picture
from mvcodec.errors import InputError
from mvcodec.evaluation.metrics import decibel, luma
from mvcodec.frames import Picture
from mvcodec.stream import view_name
from mvcodec.synthesis.provenance import provenance_name, seen_by

_COUNTS = 256
"""Numbers of cameras that uint8 holds."""


@dataclass(frozen=True, slots=True)
class ProvenanceQuality:
    """The pixels that one number of real cameras saw, over all measured pictures together.

    Attributes:
        share: of all pixels, 0..1.
        psnr_y: luma PSNR over these pixels (not a mean over pictures), dB.
        error_share: of the total squared luma error, 0..1; None where there is no error at all.
    """

    share: float
    psnr_y: float
    error_share: float | None

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values by name."""
        return asdict(self)


class ProvenanceMeter:
    """Adds up errors by number of cameras; pictures may come in any order and from any thread."""

    def __init__(self) -> None:
        # Both are sums of integers: the same whatever the order.
        self._pixels = np.zeros(_COUNTS, np.int64)
        self._errors = np.zeros(_COUNTS, np.int64)
        self._lock = Lock()

    def push(self, original: Picture, picture: Picture, cameras: NDArray[np.uint8]) -> None:
        """Measure one picture.

        Args:
            original, picture: uint8 (H, W, 3) RGB of one size.
            cameras: uint8 (H, W), how many real cameras saw each pixel; 0 = filled.
        """
        squares = np.square(luma(original).astype(np.int64) - luma(picture))
        pixels = np.bincount(cameras.ravel(), minlength=_COUNTS)
        # Float64 holds these sums of integers exactly.
        errors = np.bincount(cameras.ravel(), squares.ravel(), _COUNTS).astype(np.int64)
        with self._lock:
            self._pixels += pixels
            self._errors += errors

    def result(self) -> dict[int, ProvenanceQuality]:
        """By number of cameras, those that occur; nothing where no picture was pushed."""
        pixels, errors = int(self._pixels.sum()), int(self._errors.sum())
        return {
            int(count): ProvenanceQuality(
                share=float(self._pixels[count] / pixels),
                psnr_y=decibel(float(self._errors[count] / self._pixels[count])),
                error_share=float(self._errors[count] / errors) if errors else None,
            )
            for count in np.flatnonzero(self._pixels)
        }


def read_seen_by(folder: Path, view: Position, frame: int, array: CameraArray) -> NDArray[np.uint8]:
    """How many real cameras saw each pixel of a view, as `ProvenanceWriter` wrote it.

    Args:
        folder: that of the decoded array.
        view: grid position.
        frame: number of the picture in the folder.
        array: the decoded array, whose picture size is expected.

    Returns:
        uint8 (H, W); 0 = filled.

    Raises:
        InputError: missing, or no picture of this size.
    """
    path = folder / view_name(view) / provenance_name(frame)
    if not path.is_file():
        raise InputError(path, "no such file", "one, as decoding with provenance writes it")
    return seen_by(read_picture(path, (array.width, array.height)))

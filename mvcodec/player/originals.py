"""The original array: its pictures, and how good a view is against them where it has one at that place."""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import dataclass

from mvcodec.array import CameraArray, Position
from mvcodec.capture import ArraySource
from mvcodec.errors import InputError
from mvcodec.evaluation.metrics import SSIM_WINDOW, psnr, ssim
from mvcodec.frames import DecodedSet, Picture, RenderedView

MAX_CACHED = 8


@dataclass(frozen=True, slots=True)
class Quality:
    """Luma PSNR in dB and SSIM of one picture; None, and a reason, where they cannot be had."""

    psnr_db: float | None
    ssim: float | None
    reason: str | None = None


class Originals:
    """Measures views against an opened original. Safe to use from several threads.

    Raises:
        InputError: the original's grid or picture size is not that of the file.
    """

    def __init__(self, source: ArraySource, array: CameraArray) -> None:
        check_original(source, array)
        self._source = source
        self._cache: OrderedDict[tuple[int, Position], Picture] = OrderedDict()
        self._lock = threading.Lock()

    def measure(self, decoded: DecodedSet, view: RenderedView) -> Quality:
        """PSNR and SSIM of a rendered view.

        Raises:
            InputError: the original's picture cannot be read.
        """
        place = view.viewpoint.position
        if place is None:
            return Quality(None, None, "no original between the grid's places")
        original = self.picture(decoded.index, place)
        if original is None:
            return Quality(None, None, f"the original has no frame {decoded.index}")
        if min(view.pixels.shape[:2]) < SSIM_WINDOW:
            return Quality(psnr(original, view.pixels), None)
        return Quality(psnr(original, view.pixels), ssim(original, view.pixels))

    def picture(self, index: int, place: Position) -> Picture | None:
        """The original of a view, uint8 (H, W, 3) RGB; None where there is none.

        Args:
            index: of its frame set in the encoder's input.

        Raises:
            InputError: the original's picture cannot be read.
        """
        number = index - self._source.first_frame
        array = self._source.array
        is_there = 0 <= place[0] < array.rows and 0 <= place[1] < array.cols
        if not is_there or not 0 <= number < self._source.frame_count:
            return None
        with self._lock:
            found = self._cache.get((number, place))
            if found is None:
                (frames,) = self._source.frame_sets(slice(number, number + 1), [place])
                found = self._cache[number, place] = frames.pictures[place]
            self._cache.move_to_end((number, place))
            if len(self._cache) > MAX_CACHED:
                self._cache.popitem(last=False)
            return found


def check_original(source: ArraySource, array: CameraArray) -> None:
    """Raise InputError where an original's grid or picture size is not that of a file."""
    ours, theirs = _shape(source.array), _shape(array)
    if ours != theirs:
        raise InputError(source.name, ours, f"{theirs} as in the file")


def _shape(array: CameraArray) -> str:
    return f"{array.rows}x{array.cols} views of {array.width}x{array.height} px"

"""Semi-global matching of a pair (Hirschmueller 2008), by OpenCV's StereoSGBM."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FloatMap, Mask, Picture
from mvcodec.settings import check_settings, setting
from mvcodec.stereo.consistency import cross_check

MAX_DISPARITY_PX = 2000
"""StereoSGBM counts sixteenths of a pixel in 16 bits."""

_SUBPIXEL = 16
_LEVELS_MULTIPLE = 16


@dataclass(frozen=True, slots=True)
class SgbmSettings:
    """Settings of `Sgbm`.

    The penalties are less than half of what OpenCV's manual advises, so that thin objects are in the maps.

    Raises:
        SettingError: a setting is outside its range.
    """

    block_size: int = setting(
        3, "side of the matching window, px", choices=range(1, 12, 2), expected="an odd number 1..11"
    )
    p1: int = setting(
        3, "penalty of a disparity step of one, for each pixel of the block and each channel", low=1, high=128
    )
    p2: int = setting(12, "the same of a larger step, above p1", low=1, high=128)
    prefilter_cap: int = setting(15, "the x-derivative is truncated to +- this", low=1, high=63)
    uniqueness_percent: int = setting(
        0, "a match counts when every other one costs this much more", low=0, high=99
    )
    tolerance_px: float = setting(1.0, "of the left-right check, px", low=0)
    speckle_area_px: int = setting(60, "smaller consistent patches are dropped, pixels", low=0)
    median_size: int = setting(5, "window of the final median, px; 0: none", choices=(0, 3, 5))

    def __post_init__(self) -> None:
        check_settings(self, "sgbm.")
        if not self.p1 < self.p2:
            raise SettingError("sgbm.p1, sgbm.p2", f"{self.p1}, {self.p2}", "0 < p1 < p2 <= 128")


@dataclass(frozen=True, slots=True)
class Sgbm:
    """PairMatcher by StereoSGBM (3-way), colour, both directions, to 1/16 px."""

    settings: SgbmSettings = SgbmSettings()

    def match_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[DisparityMap, DisparityMap]:
        """See `PairMatcher.match_pair`.

        Raises:
            SettingError: the range goes beyond +-2000 px.
        """
        raw_left, raw_right = self.raw_pair(left, right, range_px)
        settings = self.settings
        return cross_check(
            raw_left,
            raw_right,
            range_px,
            tolerance_px=settings.tolerance_px,
            speckle_area_px=settings.speckle_area_px,
            median_size=settings.median_size,
        )

    def raw_pair(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[tuple[FloatMap, Mask], tuple[FloatMap, Mask]]:
        """What StereoSGBM finds, unchecked: (values in px, where there is one) of left and right.

        Raises:
            SettingError: the range goes beyond +-2000 px.
        """
        low, high = range_px
        if max(abs(low), abs(high)) > MAX_DISPARITY_PX:
            raise SettingError(
                "disparity range", f"{low:g}..{high:g}", f"within +-{MAX_DISPARITY_PX} px for matcher sgbm"
            )
        # Seen in a mirror, the right camera is the left one, with the same signs.
        values, known = self._one_direction(_mirror(right), _mirror(left), range_px)
        return self._one_direction(left, right, range_px), (_mirror(values), _mirror(known))

    def _one_direction(
        self, left: Picture, right: Picture, range_px: tuple[float, float]
    ) -> tuple[FloatMap, Mask]:
        settings = self.settings
        width = left.shape[1]
        # Nothing can be matched a picture's width away.
        low = max(math.floor(range_px[0]), -width)
        levels = max(min(math.ceil(range_px[1]), width) - low + 1, 1)
        levels = -(-levels // _LEVELS_MULTIPLE) * _LEVELS_MULTIPLE
        # StereoSGBM leaves the columns unmatched whose whole search range is not in the picture.
        pad_left, pad_right = max(low + levels, 0), max(-low, 0)
        padded = [
            cv2.copyMakeBorder(picture, 0, 0, pad_left, pad_right, cv2.BORDER_REPLICATE)
            for picture in (left, right)
        ]
        weight = left.shape[2] * settings.block_size**2
        matcher = cv2.StereoSGBM.create(
            minDisparity=low,
            numDisparities=levels,
            blockSize=settings.block_size,
            P1=settings.p1 * weight,
            P2=settings.p2 * weight,
            disp12MaxDiff=-1,
            preFilterCap=settings.prefilter_cap,
            uniquenessRatio=settings.uniqueness_percent,
            mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
        )
        counts = matcher.compute(*padded)[:, pad_left : pad_left + width]
        # Below low is its mark for no match; above range_px[1] come levels that only round the count up.
        top = max(math.ceil(range_px[1]), low)
        known = (counts >= low * _SUBPIXEL) & (counts <= top * _SUBPIXEL)
        return counts.astype(np.float32) / np.float32(_SUBPIXEL), known


def _mirror(pixels: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(pixels[:, ::-1])

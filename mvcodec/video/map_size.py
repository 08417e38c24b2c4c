"""Disparity maps between the matcher and the codec: smoothed to cost less, and coded at half size."""

from __future__ import annotations

import cv2
import numpy as np

from mvcodec.frames import DisparityMap, FloatMap, Picture
from mvcodec.stream import TrackKind
from mvcodec.video.codec import Plane
from mvcodec.video.colour import even_size, pad_to_even
from mvcodec.video.vp9_reference import frame_size

MEDIANS = {1: 5, 2: 3}
"""Scale -> the default window of the median, px of the coded map. Wider ones save bits and lose thin things.

In bits at equal PSNR of all views: at full size a window of 7 saves 3 % on shop_v3 at QP 35, and costs 1 %
there and 2 % on the sample at QP 22, where maps are of full size; 5 costs 0.4 and 0.9 %. At half size 3 saves
4 % on shop_v3 at QP 35; 5 gains 1 % more there, nothing on the sample (0.13 dB less for 3 % of the bits).
"""

WIDEST_MEDIAN = 15

AGREEMENT_PX = 3.0
"""Neighbouring samples of a small map that differ by no more are one surface."""

COLOUR_STEP = 40.0
"""The colour difference, summed over R, G and B, that counts as much as one sample of distance."""


def small_size(width: int, height: int, scale: int) -> tuple[int, int]:
    """Width and height of a map at a scale, rounded up."""
    return -(-width // scale), -(-height // scale)


def coded_size(width: int, height: int, scale: int) -> tuple[int, int]:
    """Width and height of a map as coded: those of `small_size`, rounded up to even numbers."""
    return even_size(*small_size(width, height, scale))


def track_sizes(width: int, height: int, scale: int) -> dict[TrackKind, tuple[int, int]]:
    """Kind of a video track -> width and height of its pictures as coded."""
    return {
        TrackKind.TEXTURE: even_size(width, height),
        TrackKind.PREDICTED: frame_size(even_size(width, height)),
        TrackKind.ENHANCED: frame_size(even_size(width, height)),
        TrackKind.DISPARITY: coded_size(width, height, scale),
    }


def to_coded(codes: Plane, scale: int, median: int) -> Plane:
    """What of a map is coded: uint8 (H, W) code values to uint8 of `small_size`.

    Args:
        scale: 2: the second nearest of each 2 x 2 pixels, which keeps a thin thing in front and drops a
            stray pixel.
        median: window that the result is smoothed with; 0: not at all.
    """
    if scale == 2:
        padded = pad_to_even(codes)
        a, b, c, d = (padded[y::2, x::2] for y in (0, 1) for x in (0, 1))
        middle = np.minimum(np.maximum(a, b), np.maximum(c, d))
        codes = np.maximum(middle, np.maximum(np.minimum(a, b), np.minimum(c, d)))
    if median:
        codes = cv2.medianBlur(codes, median).astype(np.uint8, copy=False)
    return codes


def enlarged(small: FloatMap, picture: Picture) -> DisparityMap:
    """A map of half size at the size of its decoded picture: px of the same baseline, all valid.

    Args:
        small: float32 (h, w), px; sample (v, u) is that of the pixels 2v, 2v + 1 and 2u, 2u + 1.
        picture: uint8 (H, W, 3) RGB with `small_size` (w, h); its edges become those of the map.
    """
    from mvcodec.kernels.enlargement import enlarge

    height, width = small.shape
    mean = cv2.resize(pad_to_even(picture), (width, height), interpolation=cv2.INTER_AREA)
    values_px = np.empty(picture.shape[:2], np.float32)
    enlarge(small, picture, mean.astype(np.uint8, copy=False), AGREEMENT_PX, COLOUR_STEP, values_px)
    return DisparityMap(values_px, np.ones(values_px.shape, np.bool_))

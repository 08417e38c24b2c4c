"""Disparity <-> 8-bit code values: linear over the header's range, 255 = nearest."""

from __future__ import annotations

import numpy as np

from mvcodec.frames import DisparityMap, FloatMap
from mvcodec.video.codec import Plane

TOP_CODE = 255


def quantise(values_px: FloatMap, range_px: tuple[float, float]) -> Plane:
    """``round(255 * (d - lo) / (hi - lo))``, clipped to 0..255: uint8 (H, W)."""
    low, high = range_px
    scaled = (values_px - np.float32(low)) * np.float32(TOP_CODE / (high - low))
    np.rint(scaled, out=scaled)
    np.clip(scaled, 0, TOP_CODE, out=scaled)
    return scaled.astype(np.uint8)


def dequantise(codes: Plane, range_px: tuple[float, float]) -> DisparityMap:
    """``lo + code * (hi - lo) / 255``, float32 px; every value counts as valid."""
    low, high = range_px
    values_px = codes * np.float32((high - low) / TOP_CODE) + np.float32(low)
    return DisparityMap(values_px=values_px, valid=np.ones(codes.shape, np.bool_))

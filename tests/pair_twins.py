"""Plain NumPy twins of the pair kernels, and DILS of one pair written down step by step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, LayerStack, Mask, Picture


def forward_sources(shift_px: NDArray[np.int32], nearness: FloatMap, usable: Mask) -> NDArray[np.int32]:
    height, width = shift_px.shape
    source = np.full((height, width), -1, np.int32)
    for y in range(height):
        for x in np.argsort(nearness[y], kind="stable"):
            target = x - shift_px[y, x]
            if usable[y, x] and 0 <= target < width:
                source[y, target] = x
    return source


def blend_pair(
    left: Picture,
    right: Picture,
    left_disparity: FloatMap,
    left_seen: NDArray[np.uint8],
    right_seen: NDArray[np.uint8],
    source: NDArray[np.int32],
    right_shift_px: NDArray[np.int32],
    left_weight: float,
) -> tuple[Picture, FloatMap, NDArray[np.uint8]]:
    width = source.shape[1]
    y = np.arange(source.shape[0])[:, None]
    known = source >= 0
    from_left = np.maximum(source, 0)
    from_right = from_left - right_shift_px[y, from_left]
    clipped = np.clip(from_right, 0, width - 1)
    both = (from_right == clipped) & (right_seen[y, clipped] > 0)
    mixed = left_weight * left[y, from_left] + (1 - left_weight) * right[y, clipped]
    pixels = np.where(both[..., None], np.floor(mixed + 0.5).astype(np.uint8), left[y, from_left])
    seen = left_seen[y, from_left] + np.where(both, right_seen[y, clipped], 0)
    return (
        np.where(known[..., None], pixels, 0).astype(np.uint8),
        np.where(known, left_disparity[y, from_left], left_disparity),
        np.where(known, seen, 0).astype(np.uint8),
    )


def nearest_known(known: Mask) -> NDArray[np.int32]:
    width = known.shape[1]
    nearest = np.full(known.shape, -1, np.int32)
    for y, row in enumerate(known):
        columns = np.flatnonzero(row)
        if columns.size:
            distance = np.abs(np.arange(width)[:, None] - columns)
            nearest[y] = columns[distance.argmin(axis=1)]
    return nearest


def dils_without_filling(left: Picture, right: Picture, layers: LayerStack, beta: float) -> Picture:
    """Equations 4.13 - 4.20 on whole pictures, one layer after the other."""
    flattened = np.zeros_like(left)
    for number, (d_min, d_max) in enumerate(layers.bounds_px, start=1):
        d_avg = (d_min + d_max) // 2
        moved_right, inside = moved(right, d_avg), moved(np.ones_like(right), d_avg)
        both = np.floor(0.5 * left + 0.5 * moved_right + 0.5).astype(np.uint8)
        blended = np.where(inside > 0, both, left)
        mask = np.repeat((layers.labels == number)[..., None], 3, axis=2).astype(np.uint8)
        shift = -round(beta * d_avg)
        flattened = np.where(moved(mask, shift) > 0, moved(blended * mask, shift), flattened)
    return flattened


def moved(picture: Picture, shift: int) -> Picture:
    """``result(x) = picture(x - shift)``, black where that lies outside."""
    columns = np.arange(picture.shape[1]) - shift
    inside = (columns >= 0) & (columns < picture.shape[1])
    result = np.zeros_like(picture)
    result[:, inside] = picture[:, columns[inside]]
    return result

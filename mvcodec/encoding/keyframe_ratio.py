"""How much finer keyframes are coded than what follows them: more where the pictures stand still."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import cv2
import numpy as np

from mvcodec.frames import FloatMap, Picture

STILL_RATIO = 2.0
"""Of pictures most of which stands still: what a keyframe has is shown until the next one. Measured in
docs/measurements.md, as is that it costs where the camera moves."""

MOVING_RATIO = 1.4
"""What x264 and x265 have by themselves."""

BLOCK = 16
STILL_LEVELS = 2.0
"""A block whose luma changes by less, in the mean, stands still."""

DETAIL_LEVELS = 4.0
"""A block whose luma deviates by less, in the mean, would not show that it moves."""

MOST_STILL = 0.6
"""So large a share of the blocks that have detail makes pictures count as still."""


def keyframe_ratio(pairs: Iterable[Sequence[Picture]]) -> float:
    """STILL_RATIO where most of what these pictures show stands still, else MOVING_RATIO.

    Args:
        pairs: uint8 (H, W, 3) RGB, pictures of one camera one frame apart.
    """
    detailed = still = 0
    for one, other in pairs:
        before, after = (_luma(picture) for picture in (one, other))
        size = max(after.shape[1] // BLOCK, 1), max(after.shape[0] // BLOCK, 1)
        mean = np.asarray(cv2.blur(after, (BLOCK, BLOCK)), np.float32)
        has_detail = _block_means(np.abs(after - mean), size) >= DETAIL_LEVELS
        stands = _block_means(np.abs(after - before), size) < STILL_LEVELS
        detailed += int(np.count_nonzero(has_detail))
        still += int(np.count_nonzero(has_detail & stands))
    return STILL_RATIO if detailed and still >= MOST_STILL * detailed else MOVING_RATIO


def _luma(picture: Picture) -> FloatMap:
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.float32)


def _block_means(values: FloatMap, size: tuple[int, int]) -> FloatMap:
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)

"""Pictures for two eyes, and for displays with nine views."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.frames import Picture
from mvcodec.output.mosaic import mosaic

NINE = 9
NINE_SIZE = (1920, 1280)
"""(width, height) px that the nine pictures together don't exceed."""

# Least-squares projection for red-cyan glasses (E. Dubois, "A projection method to generate anaglyph stereo
# images", ICASSP 2001, in the figures he publishes for LCD screens): rows R, G, B of what is shown.
_LEFT_EYE = np.array([[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]], np.float32)
_RIGHT_EYE = np.array([[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]], np.float32)


def two_eyes(array: CameraArray, viewpoint: Viewpoint, eye_steps: float) -> tuple[Viewpoint, ...]:
    """Left and right eye around a viewpoint.

    At the array's border the pair keeps its distance and moves inward; it is never wider than the array.

    Args:
        eye_steps: distance of the eyes in steps of the grid.
    """
    return _spread(array, viewpoint, 2, eye_steps)


def nine_places(array: CameraArray, viewpoint: Viewpoint, eye_steps: float) -> tuple[Viewpoint, ...]:
    """Nine places in a row around a viewpoint, leftmost first; neighbours are two eyes' distance apart."""
    return _spread(array, viewpoint, NINE, eye_steps)


def _spread(array: CameraArray, viewpoint: Viewpoint, count: int, step: float) -> tuple[Viewpoint, ...]:
    span = array.cols - 1
    width = min(max(step, 0.0) * (count - 1), span)
    left = min(max(viewpoint.col - width / 2, 0.0), span - width)
    # The last sum may pass the border by a rounding error.
    cols = (min(left + number * width / (count - 1), span) for number in range(count))
    return tuple(Viewpoint(viewpoint.row, col) for col in cols)


def anaglyph(left: Picture, right: Picture) -> Picture:
    """One picture for red-cyan glasses, red before the left eye."""
    both = np.asarray(cv2.transform(left.astype(np.float32), _LEFT_EYE), np.float32)
    both += cv2.transform(right.astype(np.float32), _RIGHT_EYE).astype(np.float32)
    return np.clip(np.rint(both), 0, 255).astype(np.uint8)


def nine(pictures: Sequence[Picture]) -> Picture:
    """Nine pictures as lenticular displays take them: three rows of three, the leftmost view first."""
    return mosaic([pictures[row * 3 : row * 3 + 3] for row in range(3)], NINE_SIZE)

"""Cameras of one rig made equally bright: a gain and an offset for each channel of each camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mvcodec.frames import FrameSet
from mvcodec.rigs.features import Tracks
from mvcodec.rigs.rig import Rig

BLUR_PX = 1.5
"""Colours are compared around points, not at them: a point's own place is off by a little."""

DARKEST, BRIGHTEST = 4.0, 245.0
"""Colours outside follow no gain."""

NOISE = 3.0
"""Of a colour of a point between two cameras, of 255."""

GAIN, OFFSET = 0.3, 3.0
"""How much cameras are expected to differ: of the logarithm of the gain, and of 255."""

FEWEST = 30
"""Points that a camera must share for its colours to be matched."""

MOST_BRIGHTER = 1.25
"""One camera that is far too bright shall not make all of them so."""


def matched_colours(rig: Rig, tracks: Tracks, frame_sets: Sequence[FrameSet]) -> Rig:
    """The rig with gains and offsets by which its cameras agree about the colours of points.

    They become as bright as the brightest one, or MOST_BRIGHTER times their geometric mean: what is white to
    that camera would be grey if it were made darker, and would still be white in the others' pictures. The
    offsets' mean is 0. A camera that shares fewer than FEWEST points keeps its colours.

    Args:
        rig: its cameras are those of the tracks.
        tracks: points that agree with the rig.
        frame_sets: that they were found in.
    """
    colours = _colours(tracks, frame_sets)
    cameras = dict(rig.cameras)
    gains, offsets = np.ones((len(tracks.cameras), 3)), np.zeros((len(tracks.cameras), 3))
    for channel in range(3):
        values = colours[..., channel]
        usable = tracks.seen & (values >= DARKEST) & (values <= BRIGHTEST)
        usable &= usable.sum(axis=1, keepdims=True) >= 2
        usable &= usable.sum(axis=0) >= FEWEST
        usable &= usable.sum(axis=1, keepdims=True) >= 2
        if usable.any():
            gains[:, channel], offsets[:, channel] = _solved(values, usable)
    brighter = min(max(1 / gains.mean(axis=1).min(), 1.0), MOST_BRIGHTER)
    for number, at in enumerate(tracks.cameras):
        cameras[at] = replace(cameras[at], gain=brighter * gains[number], offset=brighter * offsets[number])
    return replace(rig, cameras=cameras)


def _colours(tracks: Tracks, frame_sets: Sequence[FrameSet]) -> NDArray[np.float64]:
    """(T, N, 3): what the cameras show around each point."""
    colours = np.zeros((*tracks.seen.shape, 3))
    for number, frame_set in enumerate(frame_sets):
        for index, at in enumerate(tracks.cameras):
            chosen = tracks.seen[:, index] & (tracks.frame == number)
            if chosen.any():
                blurred = cv2.GaussianBlur(frame_set.pictures[at], (0, 0), BLUR_PX)
                x, y = tracks.xy_px[chosen, index].astype(np.float32).T
                colours[chosen, index] = cv2.remap(blurred, x, y, cv2.INTER_LINEAR).reshape(-1, 3)
    return colours


def _solved(
    values: NDArray[np.float64], usable: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gain and offset of each camera for one channel: values (T, N) of the same points become alike."""
    count = values.shape[1]
    wanted = usable.any(axis=1)
    values, usable = values[wanted], usable[wanted]
    weights = usable / usable.sum(axis=1, keepdims=True)

    def split(unknowns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        logs, offsets = unknowns.reshape(2, count) * ((GAIN,), (OFFSET,))
        return np.exp(logs - logs.mean()), offsets - offsets.mean()

    def residuals(unknowns: NDArray[np.float64]) -> NDArray[np.float64]:
        gain, offset = split(unknowns)
        common = ((values * gain + offset) * weights).sum(axis=1, keepdims=True)
        # In the cameras' own values: a small gain must not make differences small.
        apart = (common - offset) / gain - values
        return np.concatenate([apart[usable] / NOISE, unknowns])

    found = least_squares(residuals, np.zeros(2 * count), loss="soft_l1", max_nfev=20, ftol=1e-4)
    return split(found.x)

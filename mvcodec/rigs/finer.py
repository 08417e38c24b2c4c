"""Matches of features made finer: what is around them is laid on each other (Lucas and Kanade 1981).

SIFT's places are good to some hundredths of a pixel for most features, and far worse for those at edges of
things: enough of these move a focal length by some percent.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FrameSet, Picture
from mvcodec.rigs.features import Tracks
from mvcodec.workers import run_all

WINDOW_PX = 9
"""Larger ones reach over the edges of things; smaller ones tell places less well."""

_LOCAL_PX, _LOCAL_LEVELS, _LEAST_LEVELS = 4.0, 48.0, 4.0
"""Pictures are compared without their local mean and contrast, as cameras differ in brightness."""

_FARTHEST_PX = 1.0
_BACK_PX = 0.1
"""How far from its place a point may come out when it is followed back."""
_MOST_APART_LEVELS = 14.0
_LEAST_EIGENVALUE = 1e-3
_LEAST_SHARE = 0.5


def finer(tracks: Tracks, frame_sets: Sequence[FrameSet]) -> Tracks:
    """The same points, each laid on its first camera's picture in the others. What doesn't fit goes.

    Where most of a camera's observations don't fit, as where its picture is turned or enlarged against the
    others, the matches stay as they are, all of them.

    Args:
        tracks: points, and where the cameras see them.
        frame_sets: that they were found in.
    """
    xy, seen = tracks.xy_px.copy(), np.zeros_like(tracks.seen)
    first = tracks.seen.argmax(axis=1)
    seen[np.arange(len(first)), first] = True
    for number, frame_set in enumerate(frame_sets):
        here = tracks.frame == number
        if not here.any():
            continue
        pictures = run_all(_even, [frame_set.pictures[at] for at in tracks.cameras])
        for one, picture in enumerate(pictures):
            for other in range(one + 1, len(pictures)):
                chosen = np.nonzero(here & (first == one) & tracks.seen[:, other])[0]
                if len(chosen):
                    found, fits = _laid(
                        picture, pictures[other], tracks.xy_px[chosen, one], tracks.xy_px[chosen, other]
                    )
                    xy[chosen, other], seen[chosen, other] = found, fits
    fine = Tracks(tracks.cameras, xy, seen, tracks.frame).kept(seen)
    kept, before = fine.seen.sum(axis=0), tracks.seen.sum(axis=0)
    return fine if np.all(kept >= _LEAST_SHARE * before) else tracks


def _even(picture: Picture) -> NDArray[np.uint8]:
    """(H, W): grey, less its local mean and over its local contrast."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    high = grey - cv2.GaussianBlur(grey, (0, 0), _LOCAL_PX)
    contrast = np.sqrt(cv2.GaussianBlur(high * high, (0, 0), _LOCAL_PX)) + _LEAST_LEVELS
    return np.clip(np.rint(128 + high / contrast * _LOCAL_LEVELS), 0, 255).astype(np.uint8)


def _laid(
    one: NDArray[np.uint8], other: NDArray[np.uint8], at: NDArray[np.float64], near: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(N, 2): where `other` shows what `one` shows at places (N, 2), close to `near`; (N,): which fit."""
    start, guess = at.astype(np.float32)[:, None], near.astype(np.float32)[:, None]
    found, there, apart = _followed(one, other, start, guess)
    back, again, _ = _followed(other, one, found, start)
    fits = there & again & (apart < _MOST_APART_LEVELS)
    fits &= np.linalg.norm(found - guess, axis=2)[:, 0] < _FARTHEST_PX
    fits &= np.linalg.norm(back - start, axis=2)[:, 0] < _BACK_PX
    return found[:, 0].astype(np.float64), fits


def _followed(
    one: NDArray[np.uint8], other: NDArray[np.uint8], start: NDArray[np.float32], guess: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.float32]]:
    """float32 (N, 1, 2) places, bool (N,) whether there are any, (N,) mean absolute differences."""
    found, status, apart = cv2.calcOpticalFlowPyrLK(
        one,
        other,
        start,
        guess.copy(),
        winSize=(WINDOW_PX, WINDOW_PX),
        maxLevel=0,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.003),
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        minEigThreshold=_LEAST_EIGENVALUE,
    )
    return np.asarray(found, np.float32), status.ravel() > 0, np.asarray(apart, np.float32).ravel()

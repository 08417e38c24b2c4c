"""Matches of features are made finer by the pictures themselves."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FrameSet, Picture
from mvcodec.rigs.features import Tracks
from mvcodec.rigs.finer import finer

CAMERAS = ((0, 0), (0, 1))
SHIFT = np.array([7.3, 0.6])


def seen_from(shift: NDArray[np.float64], gain: float) -> Picture:
    """Smooth texture, moved by parts of a pixel without being interpolated."""
    draw = np.random.default_rng(0)
    waves = draw.uniform(-1.0, 1.0, (120, 2))
    phases, heights = draw.uniform(0, 6.28, 120), draw.uniform(2, 8, 120)
    y, x = np.mgrid[:120, :160] - shift[::-1, None, None]
    values = sum(h * np.sin(x * u + y * v + p) for (u, v), p, h in zip(waves, phases, heights, strict=True))
    picture = np.clip(np.rint((128 + 0.7 * np.asarray(values)) * gain), 0, 255).astype(np.uint8)
    return np.repeat(picture[..., None], 3, axis=2)


def rough_matches() -> Tracks:
    """Good to half a pixel."""
    draw = np.random.default_rng(1)
    here = draw.uniform((20, 20), (130, 100), (80, 2))
    there = here + SHIFT + draw.uniform(-0.4, 0.4, here.shape)
    xy = np.stack([here, there], axis=1)
    return Tracks(CAMERAS, xy, np.ones((80, 2), bool), np.zeros(80, np.int64))


def test_matches_are_good_to_some_hundredths_of_a_pixel_whatever_the_gain() -> None:
    frame_set = FrameSet(0, 0, {CAMERAS[0]: seen_from(0 * SHIFT, 1.0), CAMERAS[1]: seen_from(SHIFT, 0.7)})
    fine = finer(rough_matches(), [frame_set])
    off = np.linalg.norm(fine.xy_px[:, 1] - fine.xy_px[:, 0] - SHIFT, axis=1)
    assert len(off) > 60
    assert np.median(off) < 0.03
    assert np.percentile(off, 95) < 0.1


def test_matches_that_do_not_fit_go() -> None:
    rough = rough_matches()
    rough.xy_px[:10, 1] += 5
    frame_set = FrameSet(0, 0, {CAMERAS[0]: seen_from(0 * SHIFT, 1.0), CAMERAS[1]: seen_from(SHIFT, 1.0)})
    fine = finer(rough, [frame_set])
    apart = np.abs(fine.xy_px[:, 1] - fine.xy_px[:, 0] - SHIFT).max(axis=1)
    assert 50 < len(apart) <= 72
    assert np.count_nonzero(apart > 2) <= 2


def test_matches_stay_as_they_are_where_a_camera_is_turned() -> None:
    turned = np.asarray(cv2.rotate(seen_from(0 * SHIFT, 1.0), cv2.ROTATE_180), np.uint8)
    rough = rough_matches()
    rough.xy_px[:, 1] = np.array([159, 119]) - rough.xy_px[:, 0]
    frame_set = FrameSet(0, 0, {CAMERAS[0]: seen_from(0 * SHIFT, 1.0), CAMERAS[1]: turned})
    assert finer(rough, [frame_set]) is rough

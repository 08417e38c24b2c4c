"""Drafts show the same view, smaller; they are used while playing, as far as pictures take too long."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.evaluation.metrics import psnr
from mvcodec.player.draft import BUDGET_S, SCALES, WINDOW, Pace, in_full_px, shrink
from mvcodec.player.messages import Measure, Play, Ready, Seek
from mvcodec.player.session import Session
from mvcodec.synthesis.linear import Linear, LinearSettings

SYNTHESIZER = Linear(LinearSettings(fill_holes=True))
SCENE = PlaneScene(grid(3, 5, 96, 64, step=2), 8, (Plane(16, (20, 40, 50, 80)),))


@pytest.mark.parametrize("scale", SCALES[1:])
def test_a_draft_is_the_view_of_its_size(scale: float) -> None:
    decoded, place = SCENE.decoded(), Viewpoint(1.0, 1.0)
    for camera, picture in decoded.pictures.items():  # noise would not survive any change of size
        decoded.pictures[camera][:] = cv2.GaussianBlur(picture, (0, 0), 2.5)
    whole = SYNTHESIZER.render(decoded, place)
    small = SYNTHESIZER.render(shrink(decoded, scale), place)
    assert small.pixels.shape == (round(64 * scale), round(96 * scale), 3)
    size = small.pixels.shape[1::-1]
    expected = np.asarray(cv2.resize(whole.pixels, size, interpolation=cv2.INTER_LINEAR), np.uint8)
    assert psnr(expected[8:-8, 8:-8], small.pixels[8:-8, 8:-8]) > 26
    full = in_full_px(small, scale)
    assert np.median(np.abs(full.disparity_px - cv2.resize(whole.disparity_px, size))) < 0.5


def test_whole_frame_sets_are_left_alone() -> None:
    decoded = SCENE.decoded()
    assert shrink(decoded, 1.0) is decoded


def steady(pace: Pace, cost_s: float, allowed_s: float = 0.0) -> None:
    for _ in range(WINDOW):
        pace.note(cost_s, allowed_s)


def test_the_scale_follows_the_cost_and_returns() -> None:
    pace = Pace()
    steady(pace, 0.9 * BUDGET_S)
    assert pace.scale == 1
    for scale in (*SCALES[1:], SCALES[-1]):
        steady(pace, 1.1 * BUDGET_S)
        assert pace.scale == scale
    steady(pace, 0.9 * BUDGET_S)  # the next larger one would cost too much
    assert pace.scale == SCALES[-1]
    for scale in reversed(SCALES[:-1]):
        steady(pace, 0.2 * BUDGET_S)
        assert pace.scale == scale


def test_slow_frames_have_more_time() -> None:
    pace = Pace()
    steady(pace, 1.5 * BUDGET_S, allowed_s=2 * BUDGET_S)
    assert pace.scale == 1


def test_only_playing_uses_drafts() -> None:
    array = CameraArray(2, 2, 64, 48, 25.0, (0, 1), (0, 1), Calibration.nominal(64, 48))
    session = Session(array, 1000)
    session.apply(Ready(), 0.0)
    session.apply(Play(True), 0.0)
    for number in range(WINDOW + 1):
        request = session.next_request(number / 10)
        assert request is not None
        assert request.scale == (1.0 if number < WINDOW else SCALES[1])
        session.made(request, 0.2, number / 10)
    session.apply(Measure(True), 0.7)
    request = session.next_request(0.7)
    assert request is not None
    assert request.scale == 1
    session.apply(Measure(False), 0.8)
    session.apply(Play(False), 0.8)
    request = session.next_request(0.9)
    assert request is not None
    assert request.scale == 1
    session.apply(Seek(3), 1.0)
    request = session.next_request(1.0)
    assert request is not None
    assert request.scale == 1

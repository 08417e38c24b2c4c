"""Drafts show the same view, smaller; they are used while playing, as far as pictures take too long."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.evaluation.metrics import psnr
from mvcodec.player.draft import BUDGET_S, SCALES, WINDOW, Pace, in_full_px, shrink
from mvcodec.player.messages import Measure, Message, Move, Play, Ready, Seek
from mvcodec.player.session import MOVING_S, Session
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
    for cost, scale in (
        (0.9, 1),
        (1.1, 0.75),
        (0.9, 0.75),
        (1.1, 0.5),
        (9, 0.5),
        (0.9, 0.5),
        (0.2, 1),
        (3, 0.5),
    ):
        steady(pace, cost * BUDGET_S)
        assert pace.scale == scale


def test_slow_frames_have_more_time() -> None:
    pace = Pace()
    steady(pace, 1.5 * BUDGET_S, allowed_s=2 * BUDGET_S)
    assert pace.scale == 1


def slow_session(*messages: Message) -> Session:
    """A session whose pictures take 200 ms, ready at 0 s."""
    session = Session(CameraArray(2, 2, 64, 48, 25.0, (0, 1), (0, 1), Calibration.nominal(64, 48)), 1000)
    for message in (Ready(), *messages):
        session.apply(message, 0.0)
    return session


def scale_at(session: Session, now_s: float) -> float:
    request = session.next_request(now_s)
    assert request is not None
    session.made(request, 0.2, now_s)
    return request.scale


def test_playing_uses_drafts_and_a_picture_that_stands_is_whole() -> None:
    session = slow_session(Play(True))
    scales = [scale_at(session, number / 10) for number in range(WINDOW + 1)]
    assert scales == [1.0] * WINDOW + [SCALES[-1]]
    session.apply(Measure(True), 0.7)
    assert scale_at(session, 0.7) == 1
    session.apply(Measure(False), 0.8)
    assert scale_at(session, 0.8) == SCALES[-1]
    session.apply(Play(False), 0.9)
    assert scale_at(session, 0.9) == 1
    session.apply(Seek(3), 1.0)
    assert scale_at(session, 1.0) == 1


def test_dragging_uses_drafts_until_the_viewpoint_rests() -> None:
    session = slow_session()
    scale_at(session, 0.0)
    for number in range(WINDOW + 1):
        session.apply(Move(Viewpoint(0.0, number / 10)), number / 10)
        scale = scale_at(session, number / 10)
    assert scale == SCALES[-1]
    now_s = WINDOW / 10
    assert session.next_request(now_s) is None
    assert session.seconds_to_next(now_s) == pytest.approx(MOVING_S)
    assert scale_at(session, now_s + MOVING_S + 0.01) == 1
    assert session.seconds_to_next(now_s + 1) is None

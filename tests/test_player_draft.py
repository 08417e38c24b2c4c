"""Drafts show the same view, smaller; they are used while playing, as far as pictures take too long."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.evaluation.metrics import psnr
from mvcodec.player.draft import BUDGET_S, QUICKER, SMALLER, WHOLE, WINDOW, Level, Pace, in_full_px, shrink
from mvcodec.player.messages import Message, Move, Play, Ready, Seek, Show
from mvcodec.player.session import MOVING_S, Session
from mvcodec.synthesis.linear import Linear, LinearSettings

SYNTHESIZER = Linear(LinearSettings(fill=True))
SCENE = PlaneScene(grid(3, 5, 96, 64, step=2), 8, (Plane(16, (20, 40, 50, 80)),))


@pytest.mark.parametrize("scale", [0.75, 0.5])
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


def steady(pace: Pace, drawing_s: float, allowed_s: float = 0.0, wait_s: float = 0.0) -> None:
    for _ in range(WINDOW):
        pace.note(wait_s + drawing_s, drawing_s, allowed_s)


@pytest.mark.parametrize("levels", [SMALLER, QUICKER])
def test_the_level_follows_the_cost_and_returns(levels: tuple[Level, ...]) -> None:
    pace = Pace(levels)
    worst = len(levels) - 1
    for cost, place in (
        (0.95, 0),
        (1.1, 1),
        (0.95, 1),
        (1.1, 2),
        (9, worst),
        (0.95, worst),
        (0.1, 0),
        (9, worst),
    ):
        steady(pace, cost * BUDGET_S)
        assert pace.level is levels[place]


def test_a_level_that_would_just_do_is_not_returned_to() -> None:
    pace = Pace(SMALLER)
    steady(pace, 1.1 * BUDGET_S)
    steady(pace, 0.95 * SMALLER[1].cost * BUDGET_S)
    assert pace.level is SMALLER[1]
    steady(pace, 0.8 * SMALLER[1].cost * BUDGET_S)
    assert pace.level is WHOLE


def test_levels_are_ordered() -> None:
    for levels in (SMALLER, QUICKER):
        assert levels[0] is WHOLE
        assert sorted(levels, key=lambda level: -level.cost) == list(levels)
        assert sorted(levels, key=lambda level: -level.scale) == list(levels)


def test_waiting_for_frames_is_not_shortened_by_smaller_pictures() -> None:
    pace = Pace(SMALLER)
    steady(pace, 0.7 * BUDGET_S, wait_s=0.5 * BUDGET_S)
    assert pace.level is SMALLER[1]
    steady(pace, 0.7 * SMALLER[1].cost * BUDGET_S, wait_s=0.5 * BUDGET_S)
    assert pace.level is SMALLER[1]
    steady(pace, 0.7 * SMALLER[1].cost * BUDGET_S)
    assert pace.level is WHOLE


def test_slow_frames_have_more_time() -> None:
    pace = Pace(SMALLER)
    steady(pace, 1.5 * BUDGET_S, allowed_s=2 * BUDGET_S)
    assert pace.level is WHOLE


def slow_session(*messages: Message) -> Session:
    """A session whose pictures take 200 ms, ready at 0 s."""
    session = Session(CameraArray(2, 2, 64, 48, 25.0, (0, 1), (0, 1), Calibration.nominal(64, 48)), 1000)
    for message in (Ready(), *messages):
        session.apply(message, 0.0)
    return session


def level_at(session: Session, now_s: float) -> Level:
    request = session.next_request(now_s)
    assert request is not None
    session.made(request, 0.2, 0.2, now_s)
    return request.level


def test_playing_uses_drafts_and_a_picture_that_stands_is_whole() -> None:
    session = slow_session(Play(True))
    levels = [level_at(session, number / 10) for number in range(WINDOW + 1)]
    assert levels == [WHOLE] * WINDOW + [SMALLER[-1]]
    session.apply(Show("difference"), 0.7)
    assert level_at(session, 0.7) == WHOLE
    session.apply(Show("picture"), 0.8)
    assert level_at(session, 0.8) == SMALLER[-1]
    session.apply(Play(False), 0.9)
    assert level_at(session, 0.9) == WHOLE
    session.apply(Seek(3), 1.0)
    assert level_at(session, 1.0) == WHOLE


def test_dragging_uses_drafts_until_the_viewpoint_rests() -> None:
    session = slow_session()
    level_at(session, 0.0)
    for number in range(WINDOW + 1):
        session.apply(Move(Viewpoint(0.0, number / 10)), number / 10)
        level = level_at(session, number / 10)
    assert level == SMALLER[-1]
    now_s = WINDOW / 10
    assert session.next_request(now_s) is None
    assert session.seconds_to_next(now_s) == pytest.approx(MOVING_S)
    assert level_at(session, now_s + MOVING_S + 0.01) == WHOLE
    assert session.seconds_to_next(now_s + 1) is None


def test_a_whole_picture_is_overtaken_when_the_viewpoint_moves_again() -> None:
    session = slow_session()
    level_at(session, 0.0)
    for number in range(WINDOW + 1):
        session.apply(Move(Viewpoint(0.0, number / 10)), number / 10)
        level_at(session, number / 10)
    whole = session.next_request(1.0)
    assert whole is not None
    assert whole.level == WHOLE
    assert not session.overtaken(whole, 1.1)
    session.apply(Move(Viewpoint(0.5, 0.5)), 1.1)
    assert session.overtaken(whole, 1.1)
    draft = session.next_request(1.1)
    assert draft is not None
    assert not session.overtaken(draft, 1.1)


def test_nothing_is_overtaken_where_whole_pictures_are_quick_enough() -> None:
    session = slow_session()
    request = session.next_request(0.0)
    assert request is not None
    session.apply(Move(Viewpoint(0.5, 0.5)), 0.1)
    assert not session.overtaken(request, 0.1)

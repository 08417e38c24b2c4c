"""One viewer's state: the latest wins, nothing queues up, the clock drops frames instead of lagging."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.player.clock import MAX_STALL_S, PlayClock
from mvcodec.player.messages import (
    Dolly,
    Eyes,
    Focus,
    Loop,
    Message,
    Move,
    Play,
    Ready,
    Seek,
    Show,
    Shown,
    Speed,
)
from mvcodec.player.session import MAX_IN_FLIGHT, PictureRequest, Session

COUNT, FPS = 50, 10.0
ARRAY = CameraArray(3, 5, 64, 48, FPS, (0, 2), (0, 2, 4), Calibration.nominal(64, 48))


def ready(*messages: Message, stop_on_damage: bool = False) -> Session:
    session = Session(ARRAY, COUNT, stop_on_damage=stop_on_damage)
    for message in (*messages, Ready()):
        session.apply(message, 0.0)
    return session


def request(session: Session, now_s: float = 0.0) -> PictureRequest:
    """The next request; there must be one. Its picture is sent and shown at once."""
    found = session.next_request(now_s)
    assert found is not None
    session.apply(Shown(session.sent(now_s)), now_s)
    return found


def test_nothing_is_made_before_the_page_is_ready() -> None:
    session = Session(ARRAY, COUNT)
    session.apply(Seek(3), 0.0)
    assert session.next_request(0.0) is None
    session.apply(Ready(), 0.0)
    assert request(session) == PictureRequest(3, Viewpoint(1.0, 2.0))
    assert session.next_request(1.0) is None


def test_the_latest_viewpoint_wins() -> None:
    session = ready()
    request(session)
    for col in (0.0, 1.0, 3.25):
        session.apply(Move(Viewpoint(0.0, col)), 0.0)
    assert request(session).viewpoint == Viewpoint(0.0, 3.25)
    assert session.next_request(0.0) is None


def test_a_view_from_ahead_is_none_where_it_is_compared() -> None:
    session = ready(Dolly(0.5))
    assert request(session).dolly == 0.5
    session.apply(Show("disagreement"), 0.0)
    assert request(session).dolly == 0


def test_what_is_compared_with_an_original_is_one_sharp_view_from_the_nearest_place() -> None:
    session = ready(Move(Viewpoint(0.6, 2.5)), Eyes("anaglyph", 1.0), Focus(3.0), Dolly(0.5))
    assert request(session).viewpoint == Viewpoint(0.6, 2.5)
    session.apply(Show("difference"), 0.0)
    assert request(session) == PictureRequest(0, Viewpoint(1.0, 3.0), "difference")


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_viewpoints_stay_within_the_array(row: float, col: float) -> None:
    ARRAY.check_viewpoint(request(ready(Move(Viewpoint(row, col)))).viewpoint)


def test_no_more_pictures_are_made_than_the_page_draws() -> None:
    session = ready()
    numbers = []
    for col in range(MAX_IN_FLIGHT):
        session.apply(Move(Viewpoint(0.0, float(col))), 0.0)
        assert session.next_request(0.0) is not None
        numbers.append(session.sent(0.0))
    session.apply(Move(Viewpoint(2.0, 2.5)), 0.0)
    assert session.next_request(9.0) is None
    assert session.seconds_to_next(9.0) is None
    session.apply(Shown(numbers[0]), 9.5)
    assert session.transfer_ms == pytest.approx(9500)
    found = session.next_request(9.5)
    assert found is not None
    assert found.viewpoint == Viewpoint(2.0, 2.5)


def test_a_pause_stays_at_its_frame_and_seeking_from_there_is_exact() -> None:
    session = ready(Seek(20), Play(True))
    assert request(session, 0.31).frame == 23
    session.apply(Play(False), 0.35)
    assert session.next_request(0.9) is None
    session.apply(Seek(22), 0.9)
    assert request(session, 0.9).frame == 22
    assert not session.state["playing"]


def test_seeks_end_at_the_ends() -> None:
    session = ready(Seek(10**9))
    assert request(session).frame == COUNT - 1
    session.apply(Seek(-5), 0.0)
    assert request(session).frame == 0


def test_the_distance_of_eyes_matters_to_several_views_only() -> None:
    session = ready()
    request(session)
    session.apply(Eyes("one", 1.0), 0.0)
    assert session.next_request(0.0) is None
    session.apply(Eyes("anaglyph", 1.0), 0.0)
    assert request(session).eye_steps == 1.0


def test_playback_stops_at_damage_where_told_to() -> None:
    for stop in (False, True):
        session = ready(Play(True), stop_on_damage=stop)
        session.next_request(0.1)
        session.sent(0.1, damaged=True)
        assert session.state["playing"] is not stop


def test_playing_on_time_shows_every_frame() -> None:
    session = ready(Play(True))
    frames = [request(session, number / FPS).frame for number in range(10)]
    assert frames == list(range(10))
    assert session.dropped == 0
    assert session.seconds_to_next(0.94) == pytest.approx(0.06)


def test_a_late_picture_drops_frames() -> None:
    session = ready(Play(True))
    request(session, 0.0)
    assert request(session, 0.2).frame == 2
    assert session.dropped == 1


def test_the_next_frame_is_expected_as_far_on_as_the_last_one_came_and_some_behind_it() -> None:
    session = ready(Play(True))
    request(session, 0.0)
    assert session.upcoming() == (1, 2, 3)
    request(session, 0.2)
    assert session.upcoming() == (4, 5, 6)
    session.apply(Seek(COUNT - 2), 0.2)
    request(session, 0.2)
    assert session.upcoming() == (COUNT - 1,)
    request(session, 0.3)
    assert session.upcoming() == ()


def test_the_clock_waits_for_a_decoder_that_is_far_behind() -> None:
    clock = PlayClock(1000, FPS)
    clock.play(True, 0.0)
    assert clock.advance(60.0) <= MAX_STALL_S * FPS + 1
    before = clock.frame
    assert clock.advance(60.1) == before + 1


def test_playback_ends_or_loops_at_the_last_frame() -> None:
    session = ready(Seek(COUNT - 2), Play(True))
    assert request(session, 0.25).frame == COUNT - 1
    assert not session.state["playing"]
    session.apply(Play(True), 1.0)
    assert request(session, 1.0).frame == 0
    session = ready(Seek(COUNT - 2), Loop(True), Play(True))
    request(session, 0.0)
    assert session.upcoming() == (COUNT - 1, 0, 1)
    assert request(session, 0.2).frame == 0
    assert session.state["playing"]


def test_a_section_is_played_over_and_over_and_ends_with_the_whole_file() -> None:
    clock = PlayClock(10, FPS)
    clock.set_section(3, 5)
    clock.seek(4, 0.0)
    clock.play(True, 0.0)
    assert [clock.advance(0.1 * k) for k in range(1, 6)] == [5, 3, 4, 5, 3]
    assert clock.following(4, 5) == (5, 3, 4)
    clock.set_section(0, 9)
    assert clock.section is None
    assert [clock.advance(0.1 * k) for k in range(6, 9)] == [4, 5, 6]
    clock.set_section(7, 7)
    assert clock.section is None, "one frame alone is no loop"


def test_speed_multiplies_the_rate() -> None:
    session = ready(Speed(0.5), Play(True))
    assert request(session, 0.19).frame == 0
    assert request(session, 0.21).frame == 1
    session.apply(Speed(4.0), 0.21)
    assert request(session, 0.29).frame == 4


@given(st.lists(st.floats(0, 2), min_size=1, max_size=30), st.sampled_from([0.1, 1.0, 4.0]), st.booleans())
def test_the_clock_never_leaves_the_file(gaps: list[float], speed: float, loop: bool) -> None:
    clock = PlayClock(7, FPS)
    clock.loop = loop
    clock.set_speed(speed, 0.0)
    clock.play(True, 0.0)
    now = 0.0
    for gap in gaps:
        now += gap
        assert 0 <= clock.advance(now) < 7
        wait = clock.seconds_to_next(now)
        assert wait is None or 0 <= wait <= 1 / (FPS * speed) + 1e-6

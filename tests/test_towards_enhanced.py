"""Viewpoints near to enhanced views: their pictures become theirs the nearer they come."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import succeeds
from plane_scene import Plane, PlaneScene
from player_files import Viewer, playing
from test_enhancement import ARRAY, VIRTUAL, coded, decoded, written

import mvcodec
from mvcodec.array import Viewpoint
from mvcodec.capture.picture_files import read_picture
from mvcodec.decoding.frame_store import FrameStore
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import DecodedSet, FinishedView
from mvcodec.player.draft import SMALLER, shrink
from mvcodec.player.messages import Move, Play, Ready
from mvcodec.player.session import MOVING_S, Enhanced, Session
from mvcodec.stream import Packet
from mvcodec.synthesis.layered import Layered
from mvcodec.synthesis.towards_enhanced import TowardsEnhanced, shares, views_near

__all__ = ["coded"]

SCENE = PlaneScene(ARRAY, 8, (Plane(16, (16, 30, 44, 60)),))
CENTRE = frozenset({(1, 1)})


@pytest.fixture(scope="module")
def file(coded: list[list[Packet]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("enhanced") / "x.mcap"
    path.write_bytes(written(coded))
    return path


def with_centre(shade: int = 0) -> DecodedSet:
    """A decoded set whose middle view is enhanced, and darker by some grey levels."""
    pixels, disparity = SCENE.render(Viewpoint(1, 1))
    darker = np.maximum(pixels, shade) - np.uint8(shade)
    return replace(SCENE.decoded(), enhanced={(1, 1): FinishedView(darker, disparity)})


def test_shares_add_up_where_views_stand_on_all_sides() -> None:
    around = [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)]
    found = shares(around, Viewpoint(0.25, 0.5))
    assert sum(found.values()) == pytest.approx(1)
    assert found[0, 1] == pytest.approx(0.375)
    assert shares(around, Viewpoint(1, 1)) == {(1, 1): 1}
    assert views_near(ARRAY, [Viewpoint(2, 0.5), Viewpoint(1, 1)]) == {(2, 0), (2, 1), (1, 1)}


def test_a_picture_becomes_the_enhanced_view_the_nearer_it_comes() -> None:
    decoded, synthesizer = with_centre(60), TowardsEnhanced(Layered())
    exact = synthesizer.render(decoded, Viewpoint(1, 1)).pixels
    np.testing.assert_array_equal(exact, decoded.enhanced[1, 1].pixels)
    base = [Layered().render(decoded, Viewpoint(1, col)).pixels for col in (1.25, 1.5, 1.75, 2.0)]
    shown = [synthesizer.render(decoded, Viewpoint(1, col)).pixels for col in (1.25, 1.5, 1.75, 2.0)]
    change = [float(np.mean(one.astype(int) - other)) for one, other in zip(base, shown, strict=True)]
    assert change[0] > change[1] + 5 > change[2] + 10
    assert change[2] > 5
    assert change[3] == 0


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_an_enhanced_view_is_moved_as_the_disparity_says(scale: float) -> None:
    """Of textured planes nothing is blurred: the view beside it has the exact picture's details."""
    decoded = shrink(with_centre(), scale)
    place = Viewpoint(1, 1.25)
    alone = Layered().render(replace(decoded, enhanced={}), place).pixels
    shown = TowardsEnhanced(Layered()).render(decoded, place).pixels
    exact = shrink(replace(SCENE.decoded(), pictures={(0, 0): SCENE.render(place)[0]}), scale).pictures[0, 0]
    assert psnr(shown, exact) > psnr(alone, exact) - 0.5


def test_a_store_finishes_a_frame_set_and_others_go_on_from_keyframes(file: Path) -> None:
    whole = decoded(file.read_bytes())
    store = FrameStore(file)
    assert store.table.enhanced == set(VIRTUAL)
    base = store.fetch(3).decoded
    assert base is not None
    assert base.enhanced == {}
    found = store.finish(3, CENTRE).decoded
    assert found is not None
    assert found.pictures is base.pictures
    np.testing.assert_array_equal(found.enhanced[1, 1].pixels, whole[3].enhanced[1, 1].pixels)
    assert store.fetch(3).decoded is found
    store.close()
    store = FrameStore(file)
    joined = [store.fetch(0).decoded, *(store.fetch(number, CENTRE).decoded for number in (1, 2, 3))]
    assert [(1, 1) in each.enhanced for each in joined if each is not None] == [False, False, True, True]
    store.close()


def test_a_session_asks_for_enhanced_views_when_the_picture_stands() -> None:
    session = Session(ARRAY, 10, levels=SMALLER, enhanced=CENTRE)
    asked = []

    def ask(now_s: float) -> None:
        request = session.next_request(now_s)
        assert request is not None
        session.made(request, 0.01, 0.01, now_s)
        asked.append(request.enhanced)
        session._in_flight.clear()

    session.apply(Ready(), 0)
    ask(0)
    assert session.seconds_to_next(0) == 0
    ask(0)
    assert session.next_request(0) is None
    session.apply(Move(Viewpoint(1, 1.5)), 1)
    ask(1)
    assert session.next_request(1.01) is None
    assert session.seconds_to_next(1.01) == pytest.approx(MOVING_S - 0.01)
    ask(1.01 + MOVING_S)
    session.apply(Play(True), 2)
    ask(2.15)
    assert asked == [
        Enhanced.AT_HAND,
        Enhanced.ALL,
        Enhanced.AT_HAND,
        Enhanced.ALL,
        Enhanced.FROM_KEYFRAMES,
    ]
    session.apply(Play(False), 3)
    session.apply(Move(Viewpoint(0, 2)), 3)
    ask(3)
    assert session.next_request(4) is None  # nothing enhanced is near


def test_the_player_shows_enhanced_views_where_they_stand(file: Path) -> None:
    expected = decoded(file.read_bytes())[0]
    with playing(file) as running, Viewer(running) as viewer:
        assert viewer.hello["enhanced"] == sorted(map(list, VIRTUAL))
        viewer.say("move", row=1, col=1)
        viewer.say("ready")
        shown = viewer.picture_of(row=1, col=1, enhanced=True)
    assert psnr(shown.picture, expected.enhanced[1, 1].pixels) > 36


def test_open_and_render_show_them_too(file: Path, tmp_path: Path) -> None:
    (last,) = decoded(file.read_bytes(), None, slice(3, 4))
    base = Layered().render(replace(last, enhanced={}), Viewpoint(1, 1)).pixels
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with mvcodec.open(file) as video:
            np.testing.assert_array_equal(video.render(1, 1, frame=3), last.enhanced[1, 1].pixels)
        with mvcodec.open(file, enhancement=False) as video:
            np.testing.assert_array_equal(video.render(1, 1, frame=3), base)
    for name, pixels, more in (("a", last.enhanced[1, 1].pixels, ()), ("b", base, ("--no-enhancement",))):
        picture = tmp_path / f"{name}.png"
        succeeds("render", file, picture, "--view", "1,1", "--frames", "3:", "--quiet", *more)
        np.testing.assert_array_equal(read_picture(picture), pixels)

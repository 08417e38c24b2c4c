"""Pictures on request: the next frame set is decoded and prepared while one is made, and not twice."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from player_files import SYNTHESIZER, decode_picture, encode, write_original

from mvcodec.array import Viewpoint
from mvcodec.evaluation.metrics import psnr
from mvcodec.frames import DecodedSet, RenderedView
from mvcodec.player.draft import QUICKER, SMALLER, WHOLE, Level
from mvcodec.player.picture_maker import PictureMaker
from mvcodec.player.session import PictureRequest
from mvcodec.synthesis.layered import Layered
from mvcodec.synthesis.quick import Quick
from mvcodec.synthesis.synthesizer import Preparing
from mvcodec.synthesis.synthesizers import make_synthesizer

MIDDLE = Viewpoint(0.5, 0.5)


class Noting:
    """A synthesizer that notes what it does, and prepares when it is let."""

    def __init__(self, notes: list[tuple[str, int, Noting]], let: threading.Event) -> None:
        self._inner = make_synthesizer(SYNTHESIZER)
        self._notes, self._let = notes, let

    def prepare(self, decoded: DecodedSet, _viewpoint: Viewpoint) -> None:
        self._let.wait()
        self._notes.append(("prepared", decoded.index, self))

    def render(self, decoded: DecodedSet, viewpoint: Viewpoint) -> RenderedView:
        self._notes.append(("rendered", decoded.index, self))
        return self._inner.render(decoded, viewpoint)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("making")
    return encode(write_original(folder / "original", (2, 2), frames=3), folder / "room.mcap")


@pytest.fixture
def notes() -> list[tuple[str, int, Noting]]:
    return []


@pytest.fixture
def let() -> threading.Event:
    return threading.Event()


@pytest.fixture
def maker(file: Path, notes: list[tuple[str, int, Noting]], let: threading.Event) -> Iterator[PictureMaker]:
    maker = PictureMaker(file, lambda: Noting(notes, let))
    yield maker
    let.set()
    maker.close()


@pytest.mark.parametrize("level", [WHOLE, SMALLER[-1]])
def test_the_next_frame_is_prepared_once_and_waited_for(
    maker: PictureMaker, notes: list[tuple[str, int, Noting]], let: threading.Event, level: Level
) -> None:
    maker.make(PictureRequest(0, MIDDLE, level=level), upcoming=(1,))
    assert [note[:2] for note in notes] == [("rendered", 0)]
    next_one = threading.Thread(target=maker.make, args=(PictureRequest(1, MIDDLE, level=level),))
    next_one.start()
    next_one.join(0.2)
    assert next_one.is_alive()
    let.set()
    next_one.join()
    assert [note[:2] for note in notes] == [("rendered", 0), ("prepared", 1), ("rendered", 1)]
    assert notes[1][2] is notes[2][2]


def test_another_frame_than_expected_does_not_wait(maker: PictureMaker) -> None:
    maker.make(PictureRequest(0, MIDDLE), upcoming=(2,))
    made = maker.make(PictureRequest(1, MIDDLE))
    assert made.facts["frame"] == 1


def test_the_default_synthesizer_prepares_and_renders_the_same(file: Path) -> None:
    assert isinstance(Layered(), Preparing)
    maker = PictureMaker(file, Layered)
    maker.make(PictureRequest(0, MIDDLE), upcoming=(1,))
    made = maker.make(PictureRequest(1, Viewpoint(0.25, 0.75)))
    decoded = maker.store.fetch(1).decoded
    assert decoded is not None
    expected = Layered().render(decoded, Viewpoint(0.25, 0.75)).pixels
    assert psnr(expected, decode_picture(np.frombuffer(made.jpeg, np.uint8))) > 33
    maker.close()


def test_quick_pictures_come_from_the_quick_synthesizer(file: Path) -> None:
    maker = PictureMaker(file, Layered, Quick)
    assert maker.levels == QUICKER
    place = Viewpoint(0.25, 0.75)
    decoded = maker.store.fetch(1).decoded
    assert decoded is not None
    for level, renderer in ((WHOLE, Layered()), (QUICKER[1], Quick())):
        made = maker.make(PictureRequest(1, place, level=level))
        assert (made.facts["scale"], made.facts["quick"]) == (1, level.quick)
        expected = renderer.render(decoded, place).pixels
        assert psnr(expected, decode_picture(np.frombuffer(made.jpeg, np.uint8))) > 33
    maker.close()


def test_without_a_quick_synthesizer_pictures_only_get_smaller(maker: PictureMaker) -> None:
    assert maker.levels == SMALLER

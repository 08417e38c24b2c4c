"""An encoder that falls silent for ever is replaced, and nobody who decodes notices."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest
from small_arrays import photograph

from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.stream import TrackKind
from mvcodec.video.codec import CodedPicture, Planes, RateControl, VideoEncoder, VideoSettings
from mvcodec.video.codecs import CODECS
from mvcodec.video.colour import to_planes
from mvcodec.video.watchdog import WatchedEncoder

SETTINGS = VideoSettings(TrackKind.TEXTURE, 128, 96, 10.0, 5, RateControl(qp=24), "ultrafast")
PICTURES = [to_planes(photograph("coffee")[80:176, 50 + 3 * n : 178 + 3 * n]) for n in range(8)]
KEYFRAMES = (0, 5)


class _Silent:
    """Falls silent at its picture number `at`."""

    def __init__(self, encoder: VideoEncoder, at: int) -> None:
        self._encoder, self._left = encoder, at

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        if self._left == 0:
            threading.Event().wait()
        self._left -= 1
        return self._encoder.push(planes, keyframe)

    def flush(self) -> list[CodedPicture]:
        threading.Event().wait()
        return []


def _makes(*encoders: Callable[[], VideoEncoder]) -> Callable[[], VideoEncoder]:
    left = iter(encoders)

    def make() -> VideoEncoder:
        return next(left)()

    return make


class _Plain:
    """Access units depend on all pictures since the keyframe: so do AV1's with a constant quantiser."""

    def __init__(self, quantizer: int = 24) -> None:
        self._start = self._state = bytes([quantizer])

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        before = self._start if keyframe else self._state
        self._state = hashlib.sha256(
            before + planes.y.tobytes() + planes.u.tobytes() + planes.v.tobytes()
        ).digest()
        return [CodedPicture(self._state, keyframe)]

    def flush(self) -> list[CodedPicture]:
        return []


def _coded(encoder: VideoEncoder, pictures: Iterable[Planes] = PICTURES) -> list[CodedPicture]:
    return [unit for n, planes in enumerate(pictures) for unit in encoder.push(planes, n in KEYFRAMES)]


@pytest.mark.parametrize("at", range(8))
def test_a_fresh_encoder_goes_on_with_the_access_units_of_the_one_that_fell_silent(at: int) -> None:
    watched = WatchedEncoder(_makes(lambda: _Silent(_Plain(), at), _Plain), 0.5, "libtest")
    with pytest.warns(MvCodecWarning, match="libtest has not answered for 0 s") as told:
        found = _coded(watched)
    assert len(told) == 1
    assert found == _coded(_Plain())
    assert watched.flush() == []


def test_a_fresh_encoder_may_fall_silent_too() -> None:
    silent = [lambda at=at: _Silent(_Plain(), at) for at in (4, 2, 3)]
    watched = WatchedEncoder(_makes(*silent, _Plain), 0.5, "libtest")
    with pytest.warns(MvCodecWarning) as told:
        assert _coded(watched) == _coded(_Plain())
    assert len(told) == 3


def test_one_error_where_none_answers() -> None:
    watched = WatchedEncoder(lambda: _Silent(_Plain(), 0), 0.1, "libtest")
    with (
        pytest.warns(MvCodecWarning),
        pytest.raises(SettingError, match="libtest, which does not answer any more"),
    ):
        watched.push(PICTURES[0], keyframe=True)
    assert watched.flush() == []


def test_what_others_refer_to_is_never_changed() -> None:
    """Rate control that knows the past codes the same pictures otherwise."""
    makes = _makes(lambda: _Silent(_Plain(), 7), lambda: _Plain(34))
    watched = WatchedEncoder(makes, 0.5, "libtest")
    with pytest.warns(MvCodecWarning), pytest.raises(SettingError, match="expected a constant quantiser"):
        _coded(watched)


def test_pictures_belong_to_the_caller_again() -> None:
    watched = WatchedEncoder(_makes(lambda: _Silent(_Plain(), 3), _Plain), 0.5, "libtest")
    planes = Planes(*(np.empty_like(plane) for plane in (PICTURES[0].y, PICTURES[0].u, PICTURES[0].v)))

    def one_after_another() -> Iterable[Planes]:
        for picture in PICTURES:
            planes.y[:], planes.u[:], planes.v[:] = picture.y, picture.u, picture.v
            yield planes

    with pytest.warns(MvCodecWarning):
        found = _coded(watched, one_after_another())
    assert found == _coded(_Plain())


def test_errors_come_through() -> None:
    class Refuses(_Silent):
        def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
            raise SettingError("codec", f"a picture of {planes.size}, {keyframe}", "another")

    with pytest.raises(SettingError, match=r"a picture of \(128, 96\), False"):
        WatchedEncoder(lambda: Refuses(_Plain(), 0), 5, "libtest").push(PICTURES[0])


@pytest.mark.parametrize("preset", ["ultrafast", "medium"])
def test_av1_comes_to_the_same_from_any_keyframe_on(preset: str) -> None:
    settings = replace(SETTINGS, preset=preset)
    whole, late = CODECS["av1"].encoder(settings), CODECS["av1"].encoder(settings)
    assert _coded(whole)[5:] == [unit for n in (5, 6, 7) for unit in late.push(PICTURES[n], n in KEYFRAMES)]


def test_a_process_ends_that_has_a_silent_encoder() -> None:
    program = """
import threading, warnings
from mvcodec.video.watchdog import WatchedEncoder
class Silent:
    def push(self, planes, keyframe=False):
        threading.Event().wait()
    def flush(self):
        threading.Event().wait()
warnings.simplefilter("ignore")
watched = WatchedEncoder(Silent, 0.1, "libtest")
print(watched.flush())
"""
    command = [sys.executable, "-c", program]
    found = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (found.returncode, found.stdout) == (0, "[]\n"), found.stderr

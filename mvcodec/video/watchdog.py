"""An encoder that may fall silent for ever is watched, and replaced where it does."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from threading import Thread

from mvcodec.errors import MvCodecWarning, SettingError
from mvcodec.video.codec import CodedPicture, Planes, VideoEncoder
from mvcodec.workers import Job

_ENCODERS = 4
"""So many are asked for a picture before that is an error."""


class _NoAnswer(Exception):
    """A call has not come back in time; its thread waits on, and keeps what it uses alive."""


class WatchedEncoder:
    """Codes one track with an encoder whose calls may never come back.

    Where one doesn't, a fresh encoder codes the pictures since the last keyframe again. They must become
    the same access units as before, since later pictures refer to them: so it is with a constant quantiser,
    and up to the second keyframe with any rate control.

    Args:
        make: makes an encoder of the track.
        patience_s: how long a call may take, seconds.
        library: what to call the encoder in messages.
    """

    def __init__(self, make: Callable[[], VideoEncoder], patience_s: float, library: str) -> None:
        self._make, self._patience_s, self._library = make, patience_s, library
        self._encoder: VideoEncoder | None = make()
        self._pictures: list[Planes] = []
        self._coded: list[list[CodedPicture]] = []

    def push(self, planes: Planes, keyframe: bool = False) -> list[CodedPicture]:
        """See `VideoEncoder`.

        Raises:
            SettingError: the encoder fell silent, and a fresh one does not come to the same access units.
        """
        if keyframe:
            self._pictures, self._coded = [], []
        for _ in range(_ENCODERS):
            try:
                if self._encoder is None:
                    self._encoder = self._fresh()
                found = self._answer(self._encoder.push, planes, keyframe)
            except _NoAnswer:
                self._encoder = None
                self._tell()
            else:
                self._pictures.append(Planes(planes.y.copy(), planes.u.copy(), planes.v.copy()))
                self._coded.append(found)
                return found
        raise self._silent("one that does, or another codec")

    def flush(self) -> list[CodedPicture]:
        """See `VideoEncoder`; nothing is left inside of an encoder that has fallen silent."""
        try:
            return self._answer(self._encoder.flush) if self._encoder is not None else []
        except _NoAnswer:
            return []

    def _fresh(self) -> VideoEncoder:
        encoder = self._make()
        for number, (planes, before) in enumerate(zip(self._pictures, self._coded, strict=True)):
            if self._answer(encoder.push, planes, number == 0) != before:
                raise self._silent("a constant quantiser, with which another encoder can go on")
        return encoder

    def _tell(self) -> None:
        text = f"{self._library} has not answered for {self._patience_s:.0f} s: another one takes its place"
        warnings.warn(text, MvCodecWarning, stacklevel=4)

    def _silent(self, expected: str) -> SettingError:
        return SettingError("codec", f"{self._library}, which does not answer any more", expected)

    def _answer(self, call: Callable[..., list[CodedPicture]], *arguments: object) -> list[CodedPicture]:
        job = Job(call, arguments)
        # A thread of its own: it may wait for ever, and a process does not wait for it when it ends.
        thread = Thread(target=job.begin, daemon=True)
        thread.start()
        thread.join(self._patience_s)
        if not job.done:
            raise _NoAnswer
        return job.result()

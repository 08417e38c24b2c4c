"""Synthesizers for several threads: each serves one frame set at a time, since it keeps what it prepared."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from mvcodec.frames import DecodedSet
from mvcodec.synthesis.synthesizer import Synthesizer


class SynthesizerPool:
    """Lends synthesizers out, if possible one that has prepared the frame set before.

    Args:
        make: makes one; called `count` times.
        count: as many as threads will borrow at once.
    """

    def __init__(self, make: Callable[[], Synthesizer], count: int) -> None:
        self._idle: list[tuple[Synthesizer, DecodedSet | None]] = [(make(), None) for _ in range(count)]
        self._changed = threading.Condition()

    @contextmanager
    def borrow(self, decoded: DecodedSet) -> Iterator[Synthesizer]:
        """A synthesizer for this frame set; waits while all are lent."""
        with self._changed:
            while not self._idle:
                self._changed.wait()
            # The one that waited longest holds what is least likely to be wanted again.
            place = next((i for i, (_, last) in enumerate(self._idle) if last is decoded), 0)
            synthesizer, _ = self._idle.pop(place)
        try:
            yield synthesizer
        finally:
            with self._changed:
                self._idle.append((synthesizer, decoded))
                self._changed.notify()

"""Ctrl-C while a file is being written: finish the frame set at hand first."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupt() -> Iterator[Callable[[], bool]]:
    """Hold the first Ctrl-C back; the second one interrupts at once, as ever.

    Yields:
        A function that says whether Ctrl-C was pressed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False  # only the main thread can be interrupted
        return
    pressed = threading.Event()

    def hold_back(signum: int, frame: FrameType | None) -> None:
        if pressed.is_set():
            signal.default_int_handler(signum, frame)
        pressed.set()

    before = signal.signal(signal.SIGINT, hold_back)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)

"""A file that another program is still writing, read like a pipe."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path

from mvcodec.closing import Closing
from mvcodec.errors import InputError, MvCodecWarning

POLL_S = 0.02


class FollowedFile(Closing):
    """Waits at the end of a file for more, until it is told to stop.

    A reader of MCAP stops by itself where the file is complete.

    Args:
        path: of a file that may be missing yet, which an MvCodecWarning says at once.
        stopped: asked while waiting; True ends the input where it is.

    Raises:
        InputError: the system refuses to open it for another reason than that it is not there yet.
    """

    def __init__(self, path: Path, stopped: Callable[[], bool] = lambda: False) -> None:
        self.name = str(path)
        self._stopped = stopped
        told = False
        while True:
            try:
                self._file = path.open("rb", buffering=0)
                break
            except OSError as error:
                if stopped() or not isinstance(error, FileNotFoundError):
                    raise InputError(path, error.strerror, "a file that can be read") from None
            if not told:
                warnings.warn(f"{path}: not there yet; waiting for it", MvCodecWarning, stacklevel=2)
                told = True
            time.sleep(POLL_S)

    def read(self, size: int = -1, /) -> bytes:
        """What is there, at most `size` bytes; waits where there is nothing. Empty only once stopped."""
        while not (data := self._file.read(size)) and not self._stopped():
            time.sleep(POLL_S)
        return data

    def seekable(self) -> bool:
        """False: its end is not known."""
        return False

    def close(self) -> None:
        """Close the file."""
        self._file.close()

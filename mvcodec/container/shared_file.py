"""One seekable binary file, read from several places at once."""

from __future__ import annotations

import io
import threading
from typing import BinaryIO


class SharedFile:
    """Hands out readers of a file that do not disturb each other. The file itself stays open.

    Args:
        file: seekable; nobody else may move its position meanwhile.
    """

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.name = str(getattr(file, "name", "input"))
        self.lock = threading.Lock()

    def reader(self) -> BinaryIO:
        """A reader of its own, at the file's beginning."""
        return io.BufferedReader(_Place(self))


class _Place(io.RawIOBase):
    """Reads on from where it was, wherever the others left the file."""

    def __init__(self, shared: SharedFile) -> None:
        self._shared = shared
        self.name = shared.name
        self._at = 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        with self._shared.lock:
            file = self._shared.file
            if whence == io.SEEK_CUR:
                offset, whence = self._at + offset, io.SEEK_SET
            self._at = file.seek(offset, whence)
        return self._at

    def readinto(self, buffer: object, /) -> int:
        room = memoryview(buffer)  # type: ignore[arg-type]
        with self._shared.lock:
            self._shared.file.seek(self._at)
            data = self._shared.file.read(len(room))
        room[: len(data)] = data
        self._at += len(data)
        return len(data)

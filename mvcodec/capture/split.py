"""Files that hold several views side by side: stereo pairs, mosaics, and quilts by their name."""

from __future__ import annotations

import re
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from mvcodec.array import Position
from mvcodec.capture.reading import OnUnreadable
from mvcodec.capture.view_array import ViewReader
from mvcodec.errors import InputError
from mvcodec.frames import Picture

_QUILT = re.compile(r"_qs(\d{1,3})x(\d{1,3})a(\d+(?:\.\d+)?)(?![\d.]*\d)")
"""Columns, rows and aspect ratio, see https://docs.lookingglassfactory.com/keyconcepts/quilts."""

_HELD = 2
"""Pictures of a file that are kept for the views that have not taken theirs yet."""


def quilt_layout(path: Path) -> tuple[int, int] | None:
    """(rows, cols) of a quilt by its file's name; None of other files."""
    found = _QUILT.search(path.stem)
    return None if found is None else (int(found[2]), int(found[1]))


def split_views(reader: ViewReader, rows: int, cols: int) -> dict[Position, ViewReader]:
    """The views of a file, by their place in its pictures.

    Raises:
        InputError: its pictures cannot be divided.
    """
    width, height = reader.size
    if width % cols or height % rows:
        expected = f"a width that {cols} and a height that {rows} divide, for {rows}x{cols} views"
        raise InputError(reader.path, f"{width}x{height} px", expected)
    whole = _SharedFile(reader)
    return {(row, col): _Tile(whole, row, col, rows, cols) for row in range(rows) for col in range(cols)}


def quilt_views(reader: ViewReader, rows: int, cols: int) -> dict[Position, ViewReader]:
    """The views of a quilt as one row, leftmost first: they begin at its lower left corner."""
    tiles = split_views(reader, rows, cols)
    return {(0, number): tiles[rows - 1 - number // cols, number % cols] for number in range(rows * cols)}


class _Pass:
    """One pass over a file, for all views that read the same frames side by side."""

    def __init__(self, pictures: Iterator[Picture | None], frames: Sequence[int]) -> None:
        self.frames, self._pictures = list(frames), pictures
        self._held: deque[tuple[int, Picture | None]] = deque(maxlen=_HELD)
        self._next = 0
        self._error: InputError | None = None
        self._lock = threading.Lock()

    def at(self, index: int) -> tuple[bool, Picture | None]:
        """(whether it is still there, the picture of that place in `frames`)."""
        with self._lock:
            while self._next <= index:
                if self._error is not None:
                    raise self._error
                try:
                    self._held.append((self._next, next(self._pictures)))
                except InputError as error:  # for the other views too
                    self._error = error
                    raise
                self._next += 1
            return next(((True, picture) for number, picture in self._held if number == index), (False, None))


class _SharedFile:
    """A file whose pictures are read once for all of its views, as long as they keep step."""

    def __init__(self, reader: ViewReader) -> None:
        self.reader = reader
        self._pass: _Pass | None = None
        self._lock = threading.Lock()

    def pictures(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> Iterator[Picture | None]:
        """The whole pictures of some frames."""
        if not frames:
            return
        shared = self._joined(frames, on_unreadable)
        for index in range(len(frames)):
            there, picture = shared.at(index)
            if not there:  # the others are far ahead
                yield from self.reader.readable(frames[index:], on_unreadable)
                return
            yield picture

    def _joined(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> _Pass:
        """The pass that the other views are at the beginning of, or a new one."""
        with self._lock:
            if self._pass is None or self._pass.frames != list(frames) or not self._pass.at(0)[0]:
                self._pass = _Pass(self.reader.readable(frames, on_unreadable), frames)
            return self._pass


class _Tile:
    """One view of a file of several."""

    def __init__(self, whole: _SharedFile, row: int, col: int, rows: int, cols: int) -> None:
        self._whole = whole
        width, height = whole.reader.size
        self.size = width // cols, height // rows
        self._top, self._left = row * self.size[1], col * self.size[0]
        self.path, self.count = whole.reader.path, whole.reader.count
        self.times_ns, self.fps, self.early = whole.reader.times_ns, whole.reader.fps, whole.reader.early
        self.notes = whole.reader.notes if (row, col) == (0, 0) else ()

    def readable(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> Iterator[Picture | None]:
        """See ViewReader."""
        width, height = self.size
        for picture in self._whole.pictures(frames, on_unreadable):
            if picture is None:
                yield None
            else:
                rows = slice(self._top, self._top + height)
                yield np.ascontiguousarray(picture[rows, self._left : self._left + width])

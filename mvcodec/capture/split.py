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


def view_size(size: tuple[int, int], rows: int, cols: int, name: str) -> tuple[int, int]:
    """(width, height) of each of rows x cols views in a picture of a size, px.

    Raises:
        InputError: the picture cannot be divided; `name` says where it comes from.
    """
    width, height = size
    if width % cols or height % rows:
        expected = f"a width that {cols} and a height that {rows} divide, for {rows}x{cols} views"
        raise InputError(name, f"{width}x{height} px", expected)
    return width // cols, height // rows


def cut_out(picture: Picture, row: int, col: int, size: tuple[int, int]) -> Picture:
    """The view at a place of a picture that holds several, each of the size (width, height) px."""
    width, height = size
    return np.ascontiguousarray(picture[row * height : (row + 1) * height, col * width : (col + 1) * width])


def split_views(reader: ViewReader, rows: int, cols: int) -> dict[Position, ViewReader]:
    """The views of a file, by their place in its pictures.

    Raises:
        InputError: its pictures cannot be divided.
    """
    size = view_size(reader.size, rows, cols, str(reader.path))
    whole = _SharedFile(reader)
    return {(row, col): _Tile(whole, row, col, size) for row in range(rows) for col in range(cols)}


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

    def __init__(self, whole: _SharedFile, row: int, col: int, size: tuple[int, int]) -> None:
        self._whole, self._place, self.size = whole, (row, col), size
        self.path, self.count = whole.reader.path, whole.reader.count
        self.times_ns, self.fps, self.early = whole.reader.times_ns, whole.reader.fps, whole.reader.early
        self.notes = whole.reader.notes if (row, col) == (0, 0) else ()

    def readable(self, frames: Sequence[int], on_unreadable: OnUnreadable | None) -> Iterator[Picture | None]:
        """See ViewReader."""
        for picture in self._whole.pictures(frames, on_unreadable):
            yield None if picture is None else cut_out(picture, *self._place, self.size)

"""Standard input, output and error: as files for `-`, and as streams whose failures are one line each."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TextIO, cast

from mvcodec.errors import InputError, MvCodecError, OutputError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

STANDARD = "-"
"""What the user writes for standard input or output."""

INPUT_NAME, OUTPUT_NAME = "standard input", "standard output"


class ReaderGone(MvCodecError):
    """Whoever read what is printed has seen enough, as `head` has."""


def standard_input() -> BinaryIO:
    """Standard input without a buffer, so that what is there can be read at once.

    Raises:
        InputError: it was closed before this process began.
    """
    if sys.stdin is None:
        raise InputError(INPUT_NAME, "a closed stream", "an open one")
    file = open(sys.stdin.fileno(), "rb", buffering=0, closefd=False)  # noqa: SIM115
    file.name = INPUT_NAME
    return cast("BinaryIO", file)


class CountedOutput(io.FileIO):
    """An output that knows how many bytes went there.

    Attributes:
        written: their number.
    """

    written = 0

    def write(self, data: ReadableBuffer, /) -> int:
        """As any raw output: writes all or a part."""
        count = super().write(data) or 0
        self.written += count
        return count


def standard_output() -> CountedOutput:
    """Standard output without a buffer, so that what is written is gone, and nothing is left at a failure.

    Raises:
        OutputError: it was closed before this process began.
    """
    file = CountedOutput(sys.stdout.fileno(), "wb", closefd=False)
    file.name = OUTPUT_NAME
    return file


@contextmanager
def checked_streams() -> Iterator[None]:
    """Within the block (and at its end) what cannot be printed raises OutputError or ReaderGone.

    What is said on a closed standard error is lost.
    """
    _occupy_closed()
    before = sys.stdin, sys.stdout, sys.stderr
    checked = _CheckedOutput(sys.stdout)
    sys.stdout = cast("TextIO", checked)
    if sys.stderr is None:
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115
    try:
        yield
        checked.flush()
    except SystemExit:
        checked.flush()  # --help was printed
        raise
    finally:
        sys.stdin, sys.stdout, sys.stderr = before
        if checked.failed:
            # Python would try to write the rest once more at exit, and complain.
            sys.stdout = None


def _occupy_closed() -> None:
    """Open the null device in the place of closed streams, which the next file opened would take.

    Libraries that print would then write into that file.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free


class _CheckedOutput(io.TextIOBase):
    """Standard output for text, whose failures name it.

    Args:
        stream: what Python made of it; None where it was closed.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream
        self.failed = False

    def write(self, text: str, /) -> int:
        with self._failing():
            return self._opened().write(text)

    def flush(self) -> None:
        if self._stream is not None and not self.failed:
            with self._failing():
                self._stream.flush()

    def fileno(self) -> int:
        return self._opened().fileno()

    def isatty(self) -> bool:
        return self._stream is not None and self._stream.isatty()

    def _opened(self) -> TextIO:
        if self._stream is None:
            raise OutputError(OUTPUT_NAME, "it is closed")
        return self._stream

    @contextmanager
    def _failing(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            self.failed = True
            raise ReaderGone(OUTPUT_NAME) from None
        except OSError as error:
            self.failed = True
            raise OutputError(OUTPUT_NAME, error.strerror or error) from None

"""A binary input that gives exactly what is asked for, and can take back what was read."""

from __future__ import annotations

import io
import zlib
from typing import BinaryIO

_PIECE_BYTES = 1 << 20
"""Read at most this at once, so that memory follows what is there, not what a length field claims."""


class ExactFile:
    """Reads a file or pipe. Counts the bytes that it takes and keeps their checksum.

    Attributes:
        count: bytes taken from the input, repeated ones counted again.
        summing: whether to keep the checksum.
        crc: CRC-32 of what `read` and `skip` returned since the last `seek`, in sequence.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._returned = b""
        self.count = 0
        self.summing, self.crc = True, 0

    def read(self, size: int) -> bytes:
        """`size` bytes; fewer only at the end of the input."""
        pieces, got = [], 0
        if self._returned:
            data, self._returned = self._returned[:size], self._returned[size:]
            pieces, got = [data], len(data)
        while got < size:
            piece = self._file.read(min(size - got, _PIECE_BYTES))  # an unbuffered pipe gives what it has
            if not piece:
                break
            self.count += len(piece)
            pieces.append(piece)
            got += len(piece)
        data = pieces[0] if len(pieces) == 1 else b"".join(pieces)
        if self.summing:
            self.crc = zlib.crc32(data, self.crc)
        return data

    def skip(self, size: int) -> bool:
        """Read and forget; False where the input ends before."""
        while size > 0:
            piece = self.read(min(size, _PIECE_BYTES))
            if not piece:
                return False
            size -= len(piece)
        return True

    def give_back(self, data: bytes) -> None:
        """Let `read` return these bytes again. (The checksum is lost.)"""
        self._returned = data + self._returned

    def seekable(self) -> bool:
        """Whether `seek` works."""
        return self._file.seekable()

    @property
    def size(self) -> int:
        """Bytes of a seekable file."""
        place = self._file.tell()
        size = self._file.seek(0, io.SEEK_END)
        self._file.seek(place)
        return size

    @property
    def place(self) -> int:
        """Offset in a seekable file of what is read next."""
        return self._file.tell() - len(self._returned)

    def seek(self, offset: int) -> None:
        """Go on reading from there."""
        self._returned, self.crc = b"", 0
        self._file.seek(offset)

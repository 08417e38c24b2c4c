"""Files behind a URL, read by ranges of bytes."""

from __future__ import annotations

import io
import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO, cast

from mvcodec.errors import InputError, MissingExtra

_URL = re.compile(r"https?://", re.IGNORECASE)

BLOCK_BYTES = 1 << 11
"""Fetched beyond what is asked for, so that small records don't cost a request each."""

NOT_FOUND = 404


def is_url(source: str) -> bool:
    """Whether a name is the address of a file on a web server."""
    return _URL.match(source) is not None


def open_url(url: str) -> BinaryIO:
    """Open a file on a web server that serves ranges.

    Raises (also while reading):
        MissingExtra: fsspec or aiohttp is not installed.
        InputError: there is no such file, the server does not serve ranges, or the network fails.
    """
    return cast("BinaryIO", _RemoteFile(url))


class _RemoteFile:
    """An fsspec file whose failures are InputErrors."""

    def __init__(self, url: str) -> None:
        self.name = url
        try:
            import aiohttp
            import fsspec
        except ImportError as error:
            raise MissingExtra(str(error.name), "http") from None
        # What goes wrong on the way: the network, the server's answer, fsspec's view of it.
        self._failures = (OSError, aiohttp.ClientError, ValueError)
        with self._failing():
            system = fsspec.filesystem("http")
            self._file: Any = system.open(url, "rb", block_size=BLOCK_BYTES, cache_type="readahead")
            if getattr(self._file, "size", None) is None:
                raise InputError(url, "a server that does not say how long the file is", "one that does")
            self._file.seek(1)
            self._file.read(1)  # ranges that are not served show at the first one
            self._file.seek(0)

    def read(self, size: int = -1, /) -> bytes:
        with self._failing():
            data: bytes = self._file.read(size)
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        place: int = self._file.seek(offset, whence)
        return place

    def tell(self) -> int:
        place: int = self._file.tell()
        return place

    def seekable(self) -> bool:
        return True

    def close(self) -> None:
        self._file.close()

    @contextmanager
    def _failing(self) -> Iterator[None]:
        try:
            yield
        except self._failures as error:
            raise InputError(self.name, _reason(error), "a file on a web server that serves ranges") from None


def _reason(error: Exception) -> str:
    """What is found instead of the file.

    When it opens a file, fsspec turns everything that goes wrong into a FileNotFoundError; its cause says
    what it was.
    """
    import aiohttp

    if isinstance(error, FileNotFoundError):
        cause = error.__cause__
        return _reason(cause) if isinstance(cause, Exception) else "no such file"
    if isinstance(error, aiohttp.ClientResponseError):
        answer = f"the answer {error.status} {error.message}".rstrip()
        return "no such file" if error.status == NOT_FOUND else answer
    if isinstance(error, aiohttp.ClientConnectorError):
        return f"no connection to {error.host}:{error.port} ({_system_words(error.os_error)})"
    if isinstance(error, TimeoutError):
        return "no answer in time"
    text = str(error) or type(error).__name__
    return "a server that does not serve ranges" if "range requests" in text else text


def _system_words(error: OSError) -> str:
    """The system's own words: asyncio puts others in their place, and an address may have no number."""
    if error.errno is None or isinstance(error, socket.gaierror):
        return error.strerror or str(error)
    return os.strerror(error.errno)

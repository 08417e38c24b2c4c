"""Outputs appear complete or not at all: written beside, then renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mvcodec.errors import OutputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path in the same folder; rename it to `path` if the body succeeds.

    The folder is made where it is missing. After an error nothing is left of the temporary file
    and what was at `path` before is untouched.

    Raises:
        OutputError: the system refuses; with its reason.
    """
    part = part_path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(path)
    except OSError as error:
        raise OutputError(path, error.strerror or error) from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def part_path(path: Path) -> Path:
    """The temporary name beside `path`; it keeps the suffix, by which writers know the format."""
    return path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")


def write_bytes(path: Path, data: bytes | memoryview) -> None:
    """Write a whole file.

    Raises:
        OutputError: the system refuses.
    """
    with replacing(path) as part:
        part.write_bytes(data)

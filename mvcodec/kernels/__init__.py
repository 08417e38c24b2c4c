"""Compiled loops: the only modules that import Numba, each imported where it is first needed."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path


def _drop_stale_code(folder: Path) -> None:
    """Delete Numba's indexes of compiled code that are older than any source file here.

    Numba compares them with the function's own file only; what that calls from another would stay as it was.
    """
    newest = max(source.stat().st_mtime for source in folder.glob("*.py"))
    for index in (folder / "__pycache__").glob("*.nbi"):
        with suppress(OSError):  # another process was quicker, or the folder is not ours to write
            if index.stat().st_mtime < newest:
                index.unlink()


_drop_stale_code(Path(__file__).parent)

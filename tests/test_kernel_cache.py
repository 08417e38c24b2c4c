"""Compiled code never outlives a change of what it calls."""

from __future__ import annotations

import os
from pathlib import Path

from mvcodec import kernels


def write(path: Path, time_s: int) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.touch()
    os.utime(path, (time_s, time_s))
    return path


def test_a_change_of_any_kernel_drops_older_code(tmp_path: Path) -> None:
    write(tmp_path / "caller.py", 100)
    write(tmp_path / "callee.py", 200)
    cache = tmp_path / "__pycache__"
    older = write(cache / "caller.blend-1.nbi", 150)
    newer = write(cache / "caller.vote-1.nbi", 250)
    other = write(cache / "caller.pyc", 150)
    kernels._drop_stale_code(tmp_path)
    assert not older.exists()
    assert newer.exists()
    assert other.exists()


def test_nothing_compiled_is_nothing_to_drop(tmp_path: Path) -> None:
    write(tmp_path / "caller.py", 100)
    kernels._drop_stale_code(tmp_path)

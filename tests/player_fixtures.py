"""Fixtures of the player's tests: an original, the file it is coded to, and a player that serves both.

The two are made once, whichever of the processes that share the tests is first to want them.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from player_files import Running, encode, playing, write_original


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of the original and of its file."""
    ours = tmp_path_factory.getbasetemp()
    folder = (ours.parent if "PYTEST_XDIST_WORKER" in os.environ else ours) / "player"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "done").exists():
            encode(write_original(folder / "original"), folder / "room.mcap")
            (folder / "done").touch()
    return folder


@pytest.fixture(scope="session")
def original(made: Path) -> Path:
    return made / "original"


@pytest.fixture(scope="session")
def file(made: Path) -> Path:
    return made / "room.mcap"


@pytest.fixture(scope="session")
def server(file: Path, original: Path) -> Iterator[Running]:
    with playing(file, "--original", original) as running:
        yield running

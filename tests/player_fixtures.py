"""Fixtures of the player's tests: an original, the file it is coded to, and a player that serves both."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from player_files import Running, encode, playing, write_original


@pytest.fixture(scope="session")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_original(tmp_path_factory.mktemp("player") / "original")


@pytest.fixture(scope="session")
def file(original: Path) -> Path:
    return encode(original, original.parent / "room.mcap")


@pytest.fixture(scope="session")
def server(file: Path, original: Path) -> Iterator[Running]:
    with playing(file, "--original", original) as running:
        yield running

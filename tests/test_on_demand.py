"""Pictures and maps that are made when they are looked at: once, by anybody, and none before."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from mvcodec.array import Position
from mvcodec.decoding.on_demand import OnDemand


def test_each_is_made_once_and_only_when_looked_at() -> None:
    made: list[Position] = []

    def make(camera: Position, coded: int) -> list[int]:
        made.append(camera)
        return [coded]

    found = OnDemand({(0, 0): 1, (0, 2): 2}, make)
    assert list(found) == [(0, 0), (0, 2)]
    assert len(found) == 2
    assert (0, 2) in found
    assert (1, 1) not in found
    assert made == []
    assert found[0, 2] == [2]
    assert made == [(0, 2)]
    with ThreadPoolExecutor(4) as pool:
        looks = list(pool.map(lambda _: found[0, 0], range(40)))
    assert all(look is looks[0] for look in looks)
    assert sorted(made) == [(0, 0), (0, 2)]
    with pytest.raises(KeyError):
        found[1, 1]


def test_an_error_is_raised_at_every_look() -> None:
    def fail(camera: Position, coded: int) -> int:
        raise ValueError(f"{camera} {coded}")

    found = OnDemand({(0, 0): 7}, fail)
    for _ in range(2):
        with pytest.raises(ValueError, match="7"):
            found[0, 0]

"""The kernels' table: everything in it loads, and whoever matches and renders asks it, on every thread."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
import semiglobal_twins as twins
from stereo_scene import Planes, linear_or_grid

from mvcodec.array import Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import DecodedSet
from mvcodec.kernels import table
from mvcodec.kernels.table import COLUMNS, DEFAULT, MATCHING, RENDERING, implemented_by, kernel
from mvcodec.stereo.joint_settings import BALANCED, JointSettings
from mvcodec.stereo.matchers import make_base_matcher
from mvcodec.stereo.realtime import Realtime
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.workers import threads

RANGE_PX = (0.0, 10.0)


@pytest.fixture
def column(monkeypatch: pytest.MonkeyPatch) -> dict[str, table.Implementation]:
    """An empty column named `mine`."""
    mine: dict[str, table.Implementation] = {}
    monkeypatch.setitem(COLUMNS, "mine", mine)
    return mine


@pytest.mark.parametrize("name", [*MATCHING, *RENDERING])
def test_every_kernel_has_its_own_implementation_here(name: str) -> None:
    assert callable(kernel(name))
    assert COLUMNS[DEFAULT][name]() is kernel(name)


def test_unknown_columns_are_named() -> None:
    with (
        pytest.raises(SettingError, match="kernels: found cuda, expected one of numba"),
        implemented_by("cuda"),
    ):
        pass


def test_matching_and_rendering_take_every_kernel_from_the_table(
    column: dict[str, table.Implementation],
) -> None:
    called = set()

    def recorded(name: str, implementation: table.Implementation) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            called.add(name)
            return implementation()(*arguments)

        return call

    for name, implementation in COLUMNS[DEFAULT].items():
        column[name] = partial(recorded, name, implementation)
    array = linear_or_grid(2, 2, 64, 48)
    pictures = Planes(array, 2, 8).pictures()
    made_small = Realtime(JointSettings(**BALANCED), most_px=(100,))
    matchers = make_base_matcher("joint"), make_base_matcher("sgbm"), Realtime(most_px=(100,)), made_small

    def results() -> list[Any]:
        maps = [matcher.match(array, pictures, RANGE_PX) for matcher in matchers]
        decoded = DecodedSet(array, 0, 0, pictures, maps[0], RANGE_PX, coding_error=9.0)
        places = Viewpoint(0.4, 0.3), Viewpoint(0, 0)
        views = [
            make_synthesizer(name).render(decoded, place) for name in ("layered", "quick") for place in places
        ]
        return [m.values_px for of_one in maps for m in of_one.values()] + [view.pixels for view in views]

    with threads(2):
        expected = results()
        with implemented_by("mine"):
            found = results()
    assert called == {*MATCHING, *RENDERING}
    np.testing.assert_equal(found, expected)


def test_a_column_may_hold_some_kernels_only(column: dict[str, table.Implementation]) -> None:
    column["completion.confirmed"] = lambda: twins.confirmed
    array = linear_or_grid(1, 2, 40, 24)
    pictures = Planes(array, 2, 8).pictures()
    expected = make_base_matcher("joint").match(array, pictures, RANGE_PX)
    with implemented_by("mine"):
        assert kernel("completion.confirmed") is twins.confirmed
        found = make_base_matcher("joint").match(array, pictures, RANGE_PX)
    assert kernel("completion.confirmed") is not twins.confirmed
    for camera in array.real:
        np.testing.assert_array_equal(found[camera].values_px, expected[camera].values_px)

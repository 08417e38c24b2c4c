"""Which frame sets the range of disparities is estimated from: few of a short time."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import pytest
from plane_scene import Plane, PlaneScene, grid

from mvcodec.array import Position
from mvcodec.cli.coding_options import find_range
from mvcodec.errors import MvCodecWarning
from mvcodec.frames import DisparityMap, FrameSet


class Counted:
    """A source whose frame sets are all alike, and that notes which are read."""

    name, first_frame, listed_real, has_given = "counted", 0, None, False

    def __init__(self, frames: int) -> None:
        self.frame_count = frames
        scene = PlaneScene(grid(2, 2, 96, 64), 3, (Plane(6, (20, 10, 60, 50)),))
        self.array, self._pictures = scene.array, scene.decoded().pictures
        self.read: list[int] = []

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        del views
        for number in range(self.frame_count)[frames or slice(None)]:
            self.read.append(number)
            yield FrameSet(number, number, self._pictures)

    def truth(self, view: Position, frame: int) -> DisparityMap | None:
        raise AssertionError(view, frame)


@pytest.mark.parametrize(("seconds", "expected"), [(0.05, [0]), (0.5, [0, -1]), (60, [0, 0.5, -1])])
def test_a_short_time_tells_no_more_than_one_frame_set(seconds: float, expected: list[float]) -> None:
    source = Counted(1)
    source.frame_count = count = 1 + round(seconds * source.array.fps)
    low, high = find_range(source, range(count), "auto")
    assert low < 6 < high
    assert source.read == [count - 1 if place == -1 else int(place * (count - 1)) for place in expected]


def test_what_has_been_read_is_not_read_again_and_an_exact_range_reads_nothing() -> None:
    source = Counted(3)
    (first,) = source.frame_sets(slice(0, 1))
    low, high = find_range(source, range(3), "auto", first=first)
    assert low < 6 < high
    with pytest.warns(MvCodecWarning, match=r"beyond the stated 0\.\.4 px; .*--exact-range keeps it"):
        assert find_range(source, range(3), (0.0, 4.0), first=first)[1] > 6
    assert find_range(source, range(3), (0.0, 4.0), exact=True) == (0.0, 4.0)
    assert source.read == [0]

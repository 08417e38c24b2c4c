"""How a recording is read."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, dataclass, field
from itertools import chain
from typing import get_args

from mvcodec.array import Calibration, Position
from mvcodec.capture.reading import used_bits, views_in_pictures
from mvcodec.capture.selection import read_views, real_cameras
from mvcodec.capture.time_gaps import Gaps, gaps_field
from mvcodec.capture.timing import nominal_fps, tolerance
from mvcodec.container.recorded_pictures import Clock
from mvcodec.errors import SettingError
from mvcodec.settings import check_settings, setting

TopicGrid = tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class RecordingSettings:
    """How a recording is read.

    Attributes:
        calibration: of all cameras; None: the recording's own, or nominal.
        offsets_ms: what is added to a topic's times.
        topics, depth_topics, real, fps, tolerance_ms, clock, bits, split, gaps: explained by their fields.
        others: views beside the real cameras whose pictures are read too; None: all.

    Raises:
        SettingError: the grid is not one, names a topic twice, or a number is out of range.
    """

    topics: TopicGrid = setting(
        MISSING, "the video or image topic of every view, or of every `split` views, row by row"
    )
    real: str = real_cameras()
    fps: float | None = nominal_fps()
    tolerance_ms: float | None = tolerance()
    calibration: Calibration | None = None
    clock: Clock = setting(
        "stamp",
        "the times that count: the pictures' own stamps, or when they were written down or arrived",
        choices=get_args(Clock),
    )
    offsets_ms: Mapping[str, float] = field(default_factory=dict)
    bits: int | None = used_bits()
    depth_topics: TopicGrid | None = setting(
        None,
        "the depth topic of every view, rows as `topics` has them: 16UC1 (mm), 32FC1 (m) or compressedDepth",
    )
    split: tuple[int, int] = views_in_pictures((1, 1))
    gaps: Gaps | None = gaps_field()
    others: Collection[Position] | None = ()

    def __post_init__(self) -> None:
        widths = {len(row) for row in self.topics}
        names = list(chain.from_iterable(self.topics))
        if len(widths) != 1 or not names or not all(names):
            raise SettingError("topics", f"rows of {sorted(widths)} topics", "rows of one length")
        if self.depth_topics is not None:
            if [len(row) for row in self.depth_topics] != [len(row) for row in self.topics]:
                found = f"{len(list(chain.from_iterable(self.depth_topics)))} topics"
                raise SettingError(
                    "depth_topics", found, f"rows of topics as `topics` has them: {len(names)}"
                )
            names += chain.from_iterable(self.depth_topics)
        if self.depth_topics is not None and self.split != (1, 1):
            raise SettingError("split", "with depth_topics", "a topic for each view")
        if len(set(names)) != len(names):
            raise SettingError("topics", "a topic twice", "each topic once")
        check_settings(self)

    @property
    def grid(self) -> tuple[int, int]:
        """(rows, cols) of views."""
        return len(self.topics) * self.split[0], len(self.topics[0]) * self.split[1]

    @property
    def views(self) -> frozenset[Position]:
        """The views whose pictures are read.

        Raises:
            SettingError: `real` doesn't fit the grid.
        """
        return read_views(self.real, self.grid, self.others)

    def read_topics(self) -> dict[str, Position]:
        """The topics with such views in their pictures, each with its place in `topics`.

        Raises:
            SettingError: `real` doesn't fit the grid.
        """
        down, across = self.split
        places = sorted({(row // down, col // across) for row, col in self.views})
        return {self.topics[row][col]: (row, col) for row, col in places}

    def offsets_ns(self, topics: Sequence[str]) -> dict[str, int]:
        """Offsets by topic.

        Raises:
            SettingError: for a topic that is not read.
        """
        for topic in self.offsets_ms:
            if topic not in topics:
                raise SettingError(
                    "offsets_ms", f"{topic} (no such camera)", f"one of {', '.join(topics[:4])}"
                )
        return {topic: round(offset * 1e6) for topic, offset in self.offsets_ms.items()}

"""How a recording is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import get_args

from mvcodec.array import MAX_FPS, MIN_FPS, Calibration
from mvcodec.container.recorded_pictures import Clock
from mvcodec.errors import SettingError

TopicGrid = tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class RecordingSettings:
    """How a recording is read.

    Attributes:
        topics: of every view of the grid, row by row.
        real: which cameras are real, as `select_real` reads it.
        fps: nominal frame rate; None: from the recording's times.
        tolerance_ms: how far apart the pictures of one frame set may be taken; None: half of the
            shortest time from picture to picture.
        calibration: of all cameras; None: the recording's own, or nominal.
        clock: which time counts: the messages' own stamps, or when they were written down.
        offsets_ms: what is added to a topic's times.
        bits: how many bits of 16-bit pictures are used; None: see `BitDepth`.

    Raises:
        SettingError: the grid is not one, names a topic twice, or a number is out of range.
    """

    topics: TopicGrid
    real: str = "corners"
    fps: float | None = None
    tolerance_ms: float | None = None
    calibration: Calibration | None = None
    clock: Clock = "stamp"
    offsets_ms: Mapping[str, float] = field(default_factory=dict)
    bits: int | None = None

    def __post_init__(self) -> None:
        widths = {len(row) for row in self.topics}
        names = list(chain.from_iterable(self.topics))
        if len(widths) != 1 or not names or not all(names):
            raise SettingError("topics", f"rows of {sorted(widths)} topics", "rows of one length")
        if len(set(names)) != len(names):
            raise SettingError("topics", "a topic twice", "each topic once")
        if self.fps is not None and not MIN_FPS <= self.fps <= MAX_FPS:
            raise SettingError("fps", self.fps, f"{MIN_FPS:g}..{MAX_FPS:g}")
        if self.tolerance_ms is not None and not 0 <= self.tolerance_ms <= 10_000:
            raise SettingError("tolerance_ms", self.tolerance_ms, "0..10000 ms")
        if self.clock not in get_args(Clock):
            raise SettingError("clock", self.clock, " or ".join(get_args(Clock)))

    @property
    def grid(self) -> tuple[int, int]:
        """(rows, cols)."""
        return len(self.topics), len(self.topics[0])

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

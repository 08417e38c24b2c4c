"""What the rest of the house sees of an input: an array, and frame sets out of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Protocol

from mvcodec.array import CameraArray, Position
from mvcodec.errors import SettingError
from mvcodec.frames import DisparityMap, FrameSet


class ArraySource(Protocol):
    """An opened input.

    Attributes:
        name: path as the user wrote it.
        array: geometry, with the real cameras that were selected.
        frame_count: frame sets in the input.
        first_frame: index in the original of frame 0 (0 unless `decode` wrote the input).
        has_given: its frame sets bring disparity of their own.
        listed_real: the coded views that the input lists, where `decode` wrote it; else None.
    """

    @property
    def name(self) -> str: ...

    @property
    def array(self) -> CameraArray: ...

    @property
    def frame_count(self) -> int: ...

    @property
    def first_frame(self) -> int: ...

    @property
    def listed_real(self) -> tuple[Position, ...] | None: ...

    @property
    def has_given(self) -> bool: ...

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        """Frame sets in order, two of them in memory at most.

        Args:
            frames: Python slice (step 1) over 0..frame_count; all where None.
            views: grid positions to read; the real cameras where None.

        Yields:
            FrameSet with ``index = first_frame + frame number``, and when its pictures were taken; of
            files without times ``time_ns = round(index * 1e9 / fps)``.

        Raises:
            SettingError: an empty slice, or a view outside the grid.
            InputError: a picture that is missing, unreadable or of another size.
        """
        ...

    def truth(self, view: Position, frame: int) -> DisparityMap | None:
        """Ground truth of a view in px for ONE GRID STEP (sign: ALGORITHMS 0), or None.

        `valid` is False (and the value 0) where the truth is unknown.

        Raises:
            InputError: the file is missing, unreadable or of another size.
        """
        ...


def resolve_frames(frames: slice | None, count: int, source: str) -> range:
    """The frame numbers that a Python slice takes out of `count` frames.

    Raises:
        SettingError: the slice has a step, or holds no frame.
    """
    if frames is None:
        return range(count)
    if frames.step not in (None, 1):
        raise SettingError("frames", f"step {frames.step}", "A:B, consecutive frames")
    numbers = range(*frames.indices(count))
    if not numbers:
        found = ":".join("" if end is None else str(end) for end in (frames.start, frames.stop))
        raise SettingError("frames", found, f"A:B that holds some of the {count} frames of {source}")
    return numbers

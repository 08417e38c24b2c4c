"""A coded file as the input of a comparison: every view of its grid, synthesised as it is asked for."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from mvcodec.array import CameraArray, Position, Viewpoint
from mvcodec.capture import resolve_frames
from mvcodec.container import McapReader
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError
from mvcodec.frames import DecodedSet, DisparityMap, FrameSet, Picture
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.workers import thread_count


class DecodedFile:
    """An `ArraySource` of a complete file's views, which nothing is written of.

    Args:
        path: the file.
        synthesizer: makes the virtual views.

    Raises:
        InputError, StreamError: it cannot be read, is cut short, or frame sets are missing within.
    """

    def __init__(self, path: Path, synthesizer: Synthesizer) -> None:
        self.path, self._synthesizer = path, synthesizer
        with McapReader.open(path) as reader:
            self._header = reader.header
            numbers = sorted({packet.index for _, packet in reader.packets()})
        if not numbers:
            raise InputError(path, "no frame set", "one at least")
        self.first_frame, self.frame_count = numbers[0], len(numbers)
        if numbers[-1] - numbers[0] + 1 != len(numbers):
            found = f"{len(numbers)} frame sets numbered {numbers[0]}..{numbers[-1]}"
            raise InputError(path, found, "no gap: decode it, and compare what it holds")

    @property
    def name(self) -> str:
        """The path."""
        return str(self.path)

    @property
    def array(self) -> CameraArray:
        """As the header says."""
        return self._header.array

    @property
    def listed_real(self) -> tuple[Position, ...]:
        """The coded views."""
        return self.array.real

    @property
    def has_given(self) -> bool:
        """False: its maps are its decoder's business."""
        return False

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        """See ArraySource; raises StreamError at damage."""
        chosen = resolve_frames(frames, self.frame_count, self.name)
        places = tuple(self.array.real if views is None else views)
        with (
            Decoder.open(self.path, slice(chosen.start, chosen.stop)) as decoder,
            ThreadPoolExecutor(thread_count(), "render") as pool,
        ):
            for decoded in decoder:
                pictures = pool.map(partial(self._render, decoded), places)
                yield FrameSet(decoded.index, decoded.time_ns, dict(zip(places, pictures, strict=True)))

    def _render(self, decoded: DecodedSet, view: Position) -> Picture:
        return self._synthesizer.render(decoded, Viewpoint(*view)).pixels

    def truth(self, _view: Position, _frame: int) -> DisparityMap | None:
        """None: a coded file has none."""
        return None

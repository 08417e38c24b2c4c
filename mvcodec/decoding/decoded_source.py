"""A file of ours as an input to code again: its real cameras, times and calibration."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from mvcodec.array import CameraArray, Position
from mvcodec.capture.source import resolve_frames
from mvcodec.container import McapReader
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.frame_table import read_frame_table
from mvcodec.errors import InputError, StreamError
from mvcodec.frames import DisparityMap, FrameSet
from mvcodec.stream import view_name


def is_own_file(path: Path) -> bool:
    """Whether a file is one of ours, as far as it can be opened."""
    try:
        with McapReader.open(path):
            return True
    except (InputError, StreamError):
        return False


class DecodedSource:
    """See `ArraySource`. Views beside the real cameras are those of the file's enhancement layer.

    Args:
        path: a file of ours.

    Attributes:
        disparity_range_px: the header's.

    Raises:
        InputError, StreamError: it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._table = path, read_frame_table(path)
        self.disparity_range_px = self._table.header.disparity_range_px
        self.first_frame = self._table.header.first_frame
        self.has_given = False
        self.listed_real: tuple[Position, ...] | None = None

    @property
    def name(self) -> str:
        """Path as the user wrote it."""
        return str(self._path)

    @property
    def array(self) -> CameraArray:
        """The header's."""
        return self._table.header.array

    @property
    def frame_count(self) -> int:
        """Frame sets in the file."""
        return self._table.count

    def frame_sets(
        self, frames: slice | None = None, views: Collection[Position] | None = None
    ) -> Iterator[FrameSet]:
        """See `ArraySource`.

        Raises:
            SettingError: an empty slice.
            InputError: a view that is neither real nor enhanced.
            StreamError: damage.
        """
        chosen = resolve_frames(frames, self.frame_count, self.name)
        wanted = self.array.real if views is None else tuple(views)
        others = [view for view in wanted if view not in self.array.real]
        part = slice(chosen.start, chosen.stop)
        with Decoder.open(self._path, part, enhanced=others) as decoder:
            for decoded in decoder:
                pictures = dict(decoded.pictures)
                for view in others:
                    if view not in decoded.enhanced:
                        expected = "a real camera's, or one of the file's enhancement layer"
                        raise InputError(self.name, f"no picture of view {view_name(view)}", expected)
                    pictures[view] = decoded.enhanced[view].pixels
                yield FrameSet(decoded.index, decoded.time_ns, {view: pictures[view] for view in wanted})

    def truth(self, view: Position, frame: int) -> DisparityMap | None:
        """None: a coded map is no truth."""
        del view, frame
        return None

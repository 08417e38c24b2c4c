"""How much a file may ask for, before memory is taken for it."""

from __future__ import annotations

from dataclasses import dataclass, fields

from mvcodec.errors import SettingError, StreamError
from mvcodec.stream import StreamHeader


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest sizes that are read. A file that needs more is refused by the limit's name.

    Attributes:
        max_record_bytes: a record as stored, hence a packed chunk.
        max_chunk_bytes: a chunk, unpacked.
        max_index_bytes: the summary of a file.
        max_header_bytes: a header, as JSON text.
        max_cameras: real cameras.
        max_views: views of the dense grid.
        max_set_pixels: pixels of a frame set: of one picture, times the real cameras.
    """

    max_record_bytes: int = 1 << 28
    max_chunk_bytes: int = 1 << 28
    max_index_bytes: int = 1 << 27
    max_header_bytes: int = 1 << 20
    max_cameras: int = 1024
    max_views: int = 1 << 16
    max_set_pixels: int = 1 << 28

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, int) and value >= 1):
                raise SettingError(field.name, value, "a whole number of at least 1")

    def check(self, limit: str, size: int, source: str) -> None:
        """Raise StreamError where something is larger than the limit of that name."""
        allowed = getattr(self, limit)
        if size > allowed:
            raise StreamError(source, f"{size}", f"at most {limit} = {allowed}")

    def check_header(self, header: StreamHeader, source: str) -> None:
        """Raise StreamError where decoding what a header announces would take too much."""
        array = header.array
        cameras = len(array.real_rows) * len(array.real_cols)
        self.check("max_cameras", cameras, f"{source}: real cameras")
        self.check("max_views", array.rows * array.cols, f"{source}: views")
        self.check("max_set_pixels", array.width * array.height * cameras, f"{source}: pixels of a frame set")


DEFAULT_LIMITS = Limits()

"""How much a file may ask for, before memory is taken for it."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.errors import StreamError
from mvcodec.settings import check_settings, setting
from mvcodec.stream import StreamHeader


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest sizes that are read. A file that needs more is refused by the limit's name.

    Each is explained by its field.

    Raises:
        SettingError: one is no whole number of at least 1.
    """

    max_record_bytes: int = setting(1 << 28, "a record as stored, hence a packed chunk", low=1)
    max_chunk_bytes: int = setting(1 << 28, "a chunk, unpacked", low=1)
    max_index_bytes: int = setting(1 << 27, "the summary of a file", low=1)
    max_header_bytes: int = setting(1 << 20, "a header, as JSON text", low=1)
    max_cameras: int = setting(1024, "real cameras", low=1)
    max_views: int = setting(1 << 16, "views of the dense grid", low=1)
    max_set_pixels: int = setting(
        1 << 28, "pixels of a frame set: of one picture, times the real cameras", low=1
    )

    def __post_init__(self) -> None:
        check_settings(self)

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

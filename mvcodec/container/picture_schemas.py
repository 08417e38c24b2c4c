"""Messages of pictures by their schema and encoding, read into one form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError

PictureKind = Literal["video", "image", "raw"]
"""Access units of a video, coded still pictures, or pixels."""


class DamagedMessage(Exception):
    """A message that is not what its schema says. (Caught in this package.)"""


@dataclass(frozen=True, slots=True, eq=False)
class PictureMessage:
    """What a message says.

    Attributes:
        kind: of the data.
        stamp_ns: when the picture was taken; 0 where the message does not say.
        data: the coded picture, or the pixels.
        format: of the data (for pixels their encoding).
        frame_id: of the camera.
        layout: (width, height, bytes a row) of pixels, else None.
        big_endian: of pixels of more than a byte.
    """

    kind: PictureKind
    stamp_ns: int
    data: bytes
    format: str
    frame_id: str
    layout: tuple[int, int, int] | None = None
    big_endian: bool = False


def _foxglove(kind: PictureKind, schema: Any) -> Callable[[bytes], PictureMessage]:
    def parse(data: bytes) -> PictureMessage:
        try:
            found = schema.FromString(data)
        except DecodeError as error:
            raise DamagedMessage(str(error)) from None
        raw = kind == "raw"
        return PictureMessage(
            kind,
            found.timestamp.seconds * 1_000_000_000 + found.timestamp.nanos,
            found.data,
            found.encoding if raw else found.format,
            found.frame_id,
            (found.width, found.height, found.step) if raw else None,
        )

    return parse


PARSERS: dict[tuple[str, str], Callable[[bytes], PictureMessage]] = {
    ("foxglove.CompressedVideo", "protobuf"): _foxglove("video", CompressedVideo),
    ("foxglove.CompressedImage", "protobuf"): _foxglove("image", CompressedImage),
    ("foxglove.RawImage", "protobuf"): _foxglove("raw", RawImage),
}
"""(schema, message encoding) -> parser, which raises DamagedMessage."""

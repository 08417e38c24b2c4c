"""Small files for tests of damage, and what a decoder makes of them."""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass, field

from coding import Pipe, encoded_file, make_array
from mcap.reader import make_reader

from mvcodec.decoding.decoder import Decoder, OnError
from mvcodec.errors import MvCodecError

ARRAY = make_array(48, 32, fps=10.0, rows=1, cols=2)
COUNT = 20
GOP = 5


def small_file(count: int = COUNT, gop: int = GOP) -> bytes:
    """Frame sets of two small cameras; keyframes, and so chunks, every five."""
    return encoded_file(ARRAY, count, gop=gop, qp=30)


@dataclass
class Outcome:
    """What decoding gave.

    Attributes:
        frames: indexes of the frame sets.
        told: warnings.
        error: what was raised in the end, if it was.
    """

    frames: list[int] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    error: MvCodecError | None = None


def outcome(content: bytes, on_error: OnError = "stop", *, pipe: bool = False) -> Outcome:
    """Decode; whatever is not an MvCodecError comes through."""
    found = Outcome()
    source = Pipe(content, 1 << 16) if pipe else io.BytesIO(content)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            with Decoder.open(source, on_error=on_error) as decoder:  # type: ignore[arg-type]
                found.frames.extend(decoded.index for decoded in decoder)
        except MvCodecError as error:
            found.error = error
    found.told = [str(warning.message) for warning in caught]
    return found


def chunk_ends(content: bytes) -> list[int]:
    """Where the chunks end."""
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    return [chunk.chunk_start_offset + chunk.chunk_length for chunk in summary.chunk_indexes]

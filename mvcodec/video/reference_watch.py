"""Looks at a track's access units before a decoder does, which conceals missing pictures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from mvcodec.errors import MissingReference, StreamError
from mvcodec.video.av1_syntax import Av1References
from mvcodec.video.bits import NalError
from mvcodec.video.codec import Watch
from mvcodec.video.h264_syntax import H264Parser
from mvcodec.video.hevc_syntax import HevcReferences

_MISSING = "a picture that builds on one that is missing"
_EXPECTED = "every picture from a keyframe on"


class H264Watch:
    """H.264: frame_num, and the size of pictures.

    Args:
        size: (width, height) that the track must have; the decoder would take memory for any.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._parser = H264Parser()
        self._next: int | None = None

    def push(self, data: bytes, label: str) -> None:
        """Follow one access unit.

        Raises:
            MissingReference: what it builds on was not pushed (7.4.3).
            StreamError: it cannot be parsed, or is of another size.
        """
        try:
            unit = self._parser.push(data)
        except NalError as error:
            raise StreamError(label, f"a damaged picture ({error})", "an H.264 access unit") from None
        for found in unit.sequence_sets:
            if (found.width, found.height) != self._size:
                expected = f"{self._size[0]}x{self._size[1]}"
                raise StreamError(label, f"a picture of {found.width}x{found.height}", expected)
        for piece in (piece for piece in unit.slices if piece.first_block == 0):
            top = self._parser.frame_num_range(piece)
            if top is None or piece.frame_num is None:
                continue
            if not piece.idr and piece.frame_num != self._next:
                raise MissingReference(label, _MISSING, _EXPECTED)
            self._next = (piece.frame_num + 1) % top if piece.reference else piece.frame_num


class _References(Protocol):
    def push(self, data: bytes) -> str | None: ...


class _ReferenceWatch:
    """HEVC and AV1, whose decoders see to the size of pictures themselves."""

    def __init__(self, references: _References, expected: str) -> None:
        self._references, self._expected = references, expected

    def push(self, data: bytes, label: str) -> None:
        """See `H264Watch.push`."""
        try:
            missing = self._references.push(data)
        except NalError as error:
            raise StreamError(label, f"a damaged picture ({error})", self._expected) from None
        if missing is not None:
            raise MissingReference(label, _MISSING, _EXPECTED)


WATCHES: dict[str, Callable[[tuple[int, int]], Watch]] = {
    "h264": H264Watch,
    "hevc": lambda _size: _ReferenceWatch(HevcReferences(), "an HEVC access unit"),
    "av1": lambda _size: _ReferenceWatch(Av1References(), "an AV1 temporal unit"),
}
"""Codec -> (width, height) of a track's pictures -> its watch."""

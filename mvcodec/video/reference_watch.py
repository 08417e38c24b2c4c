"""Looks at a track's access units before a decoder does, which conceals missing pictures."""

from __future__ import annotations

from mvcodec.errors import MissingReference, StreamError
from mvcodec.video.bits import NalError
from mvcodec.video.codec import Codec

_MISSING = "a picture that builds on one that is missing"
_EXPECTED = "every picture from a keyframe on"


class Gaps:
    """Finds gaps in the numbers of a track's frame sets, where its pictures carry none themselves."""

    def __init__(self, codec: Codec) -> None:
        self._numbered = codec.numbered
        self._last: int | None = None

    def push(self, index: int | None, keyframe: bool) -> str | None:
        """What is missing before a picture, if anything is; `index` None where nobody numbers frame sets."""
        last, self._last = self._last, index
        if self._numbered or keyframe or index is None or last is None or index == last + 1:
            return None
        return f"frame set {index}, expected {last + 1}"


class ReferenceWatch:
    """Follows one track.

    Args:
        codec: of the track.
        size: (width, height) that its pictures must have; a decoder would take memory for any.
    """

    def __init__(self, codec: Codec, size: tuple[int, int]) -> None:
        self._size, self._words = size, codec.words
        self._units, self._gaps = codec.units(), Gaps(codec)

    def push(self, data: bytes, label: str, index: int | None = None) -> None:
        """Follow one access unit.

        Args:
            label: what to call it in an error.
            index: number of its frame set.

        Raises:
            MissingReference: what it builds on was not pushed.
            StreamError: it cannot be parsed, or is of another size.
        """
        try:
            unit = self._units.push(data)
        except NalError as error:
            raise StreamError(label, f"a damaged picture ({error})", self._words.unit) from None
        for width, height in unit.sizes:
            if (width, height) != self._size:
                expected = f"{self._size[0]}x{self._size[1]}"
                raise StreamError(label, f"a picture of {width}x{height}", expected)
        if self._gaps.push(index, unit.keyframe) or unit.missing:
            raise MissingReference(label, _MISSING, _EXPECTED)

"""The rules of FORMAT.md for access units, the same for every codec of the table."""

from __future__ import annotations

from collections.abc import Iterator

from mvcodec.stream import TrackKind
from mvcodec.video.access_unit import Sequence, UnitFacts
from mvcodec.video.bits import NalError
from mvcodec.video.codec import Codec
from mvcodec.video.reference_watch import Gaps

Broken = Iterator[tuple[str, str]]
"""(code, message) of each rule that is broken."""

_BT709 = (1, 1, 1)


class UnitRules:
    """Checks the access units of one track in order.

    Args:
        codec: of the track.
        kind: what the track carries; None where no header says it: profile, colour and size are free.
        size: (width, height) as coded.

    Attributes:
        keyframe: the last unit is one, as far as it could be parsed.
    """

    def __init__(self, codec: Codec, kind: TrackKind | None, size: tuple[int, int]) -> None:
        self._words, self._kind, self._size = codec.words, kind, size
        self._units, self._gaps = codec.units(), Gaps(codec)
        self.keyframe = False

    def push(self, data: bytes, keyframe: bool | None, index: int | None = None) -> Broken:
        """What is wrong with an access unit.

        Args:
            keyframe: a header came with it; None: there are no headers, and any unit may be a keyframe.
            index: number of its frame set.
        """
        self.keyframe = False
        try:
            unit = self._units.push(data)
        except NalError as error:
            part = self._words.part
            yield part.split()[0].lower(), f"a damaged {part} ({error})"
            return
        self.keyframe = unit.keyframe
        yield from unit.broken
        yield from self._structure(unit, unit.keyframe if keyframe is None else keyframe)
        if self._kind is not None:
            yield from self._sizes(unit)
            for sequence in unit.sequences:
                yield from self._sequence(sequence)
        gap = self._gaps.push(index, unit.keyframe)
        missing = unit.missing or gap
        if missing is not None:
            yield "missing-reference", missing

    def _structure(self, unit: UnitFacts, keyframe: bool) -> Broken:
        words = self._words
        if unit.pictures != 1:
            yield "one-picture", f"{unit.pictures} pictures in one message"
        if keyframe and not unit.keyframe:
            yield "keyframe", f"no {words.keyframe} though a header came with it"
        if keyframe and not unit.parameters:
            yield "parameter-sets", f"a keyframe without {words.parameters}"
        if unit.keyframe and not keyframe:
            yield "keyframe", f"{words.keyframe} without a header"

    def _sizes(self, unit: UnitFacts) -> Broken:
        for size in unit.sizes:
            if size != self._size:
                found, expected = (f"{width}x{height}" for width, height in (size, self._size))
                yield "size", f"pictures of {found}, expected {expected} as the header says"

    def _sequence(self, sequence: Sequence) -> Broken:
        if sequence.unlike is not None:
            yield "profile", f"{sequence.unlike}, expected {self._words.profile}"
        if sequence.reordered is not None:
            yield "reorder", f"pictures may be reordered ({sequence.reordered})"
        colour = sequence.colour
        full = self._kind is TrackKind.DISPARITY
        if colour is None or colour.full_range != full:
            yield "colour", f"expected {'full' if full else 'limited'} range (flag {int(full)})"
        elif not full and (colour.primaries, colour.transfer, colour.matrix) != _BT709:
            yield "colour", "expected BT.709 primaries, transfer and matrix (1, 1, 1)"

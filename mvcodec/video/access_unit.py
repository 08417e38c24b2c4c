"""What an access unit says about itself, in the same words for every codec."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from mvcodec.video.bits import BitReader

_EXTENDED_SAR = 255


@dataclass(frozen=True, slots=True)
class Colour:
    """What a stream says of colour; None where it says nothing.

    Attributes:
        full_range: video_full_range_flag, color_range.
        primaries, transfer, matrix: as in ITU-T H.273; 1 is BT.709.
    """

    full_range: bool
    primaries: int | None
    transfer: int | None
    matrix: int | None


@dataclass(frozen=True, slots=True)
class Sequence:
    """What a stream says of all its pictures from here on.

    Attributes:
        unlike: in what it is not of the plain profile that FORMAT.md has for its codec; None: it is.
        reordered: why a picture may wait for a later one; None: none does.
        colour: None where the stream says nothing.
    """

    unlike: str | None
    reordered: str | None
    colour: Colour | None


@dataclass(frozen=True, slots=True)
class UnitFacts:
    """What one access unit holds.

    Attributes:
        keyframe: decoding can start here.
        pictures: how many begin in it, hidden ones too.
        parameters: all parameter sets that a keyframe needs are in it.
        sizes: (width, height) of pictures, px, as often as it says them.
        sequences: in order.
        broken: (code, message) of each rule of the codec's own that it breaks.
        missing: what it builds on that never came.
        recovers: it stands on its own without being a keyframe: pictures shown after it don't build on
            any before it, but those shown before it may.
    """

    keyframe: bool
    pictures: int
    parameters: bool
    sizes: tuple[tuple[int, int], ...] = ()
    sequences: tuple[Sequence, ...] = ()
    broken: tuple[tuple[str, str], ...] = ()
    missing: str | None = None
    recovers: bool = False


class UnitReader(Protocol):
    """Reads the access units of one track in order; remembers parameter sets and which pictures there are."""

    def push(self, data: bytes) -> UnitFacts:
        """Read one access unit.

        Raises:
            NalError: it breaks off, or holds what the standard does not allow.
        """
        ...


@dataclass(frozen=True, slots=True)
class UnitWords:
    """What a codec's standard calls things, for messages.

    Attributes:
        unit: what one message holds.
        part: what it is made of, which damage breaks.
        keyframe: a picture where decoding can start.
        parameters: what must be with it.
        profile: the plain one.
    """

    unit: str
    part: str
    keyframe: str
    parameters: str
    profile: str


def usability_colour(bits: BitReader) -> Colour:
    """The colour that video usability information begins with, the same in H.264 (E.1.1) and H.265 (E.2.1).

    Args:
        bits: at its first field; read up to those about time and fields.
    """
    if bits.flag() and bits.u(8) == _EXTENDED_SAR:
        bits.u(32)
    if bits.flag():
        bits.flag()
    colour = Colour(False, None, None, None)
    if bits.flag():
        bits.u(3)
        full = bits.flag()
        described = bits.flag()
        primaries, transfer, matrix = (bits.u(8) for _ in range(3)) if described else (None, None, None)
        colour = Colour(full, primaries, transfer, matrix)
    if bits.flag():  # chroma location
        bits.ue()
        bits.ue()
    return colour

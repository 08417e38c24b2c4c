"""What VP9 frames say about themselves (VP9 bitstream specification 0.6, section 6.2 and annex B)."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.video.access_unit import Colour, Sequence, UnitFacts
from mvcodec.video.bits import BitReader, NalError

_MARKER = 2
_SYNC = 0x498342
_BT709, _RGB = 2, 7
"""color_space (7.2.2)."""

_HEAD_BYTES = 64
"""More than enough of a frame for its size."""

_SUPERFRAME = 0b110

_CODE_POINTS = {1: (6, 6, 6), _BT709: (1, 1, 1), 3: (6, 6, 6), 4: (7, 7, 7), 5: (9, 14, 9), _RGB: (1, 13, 0)}
"""color_space -> primaries, transfer and matrix in the words of ITU-T H.273."""


@dataclass(frozen=True, slots=True)
class Vp9Frame:
    """The first fields of a frame.

    Attributes:
        key: a key frame.
        shown: it is shown by itself; else hidden, to be built on or shown later.
        again: it shows an earlier frame, and holds none.
        size: (width, height); None where it is that of a frame before.
        sequence: of a key frame.
    """

    key: bool
    shown: bool
    again: bool = False
    size: tuple[int, int] | None = None
    sequence: Sequence | None = None


class Vp9Units:
    """Reads the messages of a track: each one frame, or a superframe of several.

    Frames name the slots that they build on, and have no number: that one is missing does not show.
    """

    def __init__(self) -> None:
        self._started = False

    def push(self, data: bytes) -> UnitFacts:
        """See `UnitReader`."""
        found = [parse_frame(piece) for piece in frames(data)]
        missing = None
        for frame in found:
            self._started |= frame.key
            if not self._started:
                missing = "a picture before the first keyframe"
        hidden = any(not frame.shown for frame in found)
        sequences = tuple(frame.sequence for frame in found if frame.sequence is not None)
        return UnitFacts(
            keyframe=bool(found) and found[0].key,
            pictures=len(found),
            parameters=bool(sequences),
            sizes=tuple(frame.size for frame in found if frame.size is not None),
            sequences=sequences,
            broken=(("hidden", "a frame that is not shown"),) if hidden else (),
            missing=missing,
        )


def frames(data: bytes) -> list[bytes]:
    """The frames of a superframe (annex B); of what is none, the one frame that it is.

    Raises:
        NalError: its index says more than there is.
    """
    if not data:
        raise NalError("it is empty")
    marker = data[-1]
    count, width = (marker & 7) + 1, (marker >> 3 & 3) + 1
    start = len(data) - 2 - count * width
    if marker >> 5 != _SUPERFRAME or start < 0 or data[start] != marker:
        return [data]
    found, at = [], 0
    for number in range(count):
        place = start + 1 + number * width
        size = int.from_bytes(data[place : place + width], "little")
        if size == 0 or at + size > start:
            raise NalError("a superframe whose sizes cannot be")
        found.append(data[at : at + size])
        at += size
    return found


def parse_frame(data: bytes) -> Vp9Frame:
    """The uncompressed header, up to the size (6.2).

    Raises:
        NalError: it breaks off or holds what the standard does not allow.
    """
    bits = BitReader(data[:_HEAD_BYTES])
    if bits.u(2) != _MARKER:
        raise NalError("no frame marker")
    profile = bits.u(1) + 2 * bits.u(1)
    if profile == 3 and bits.flag():
        raise NalError("a reserved profile")
    if bits.flag():  # show_existing_frame
        return Vp9Frame(key=False, shown=True, again=True)
    key, shown, resilient = not bits.flag(), bits.flag(), bits.flag()
    if key:
        _check_sync(bits)
        sequence = _sequence(bits, profile)
        return Vp9Frame(key, shown, size=_size(bits), sequence=sequence)
    intra = not shown and bits.flag()
    if not resilient:
        bits.u(2)  # reset_frame_context
    if intra:
        _check_sync(bits)
        if profile:
            _sequence(bits, profile)
        bits.u(8)  # refresh_frame_flags
        return Vp9Frame(key, shown, size=_size(bits))
    bits.u(8)
    for _ in range(3):
        bits.u(4)  # slot and sign bias of a reference
    inherited = any(bits.flag() for _ in range(3))
    return Vp9Frame(key, shown, size=None if inherited else _size(bits))


def _check_sync(bits: BitReader) -> None:
    if bits.u(24) != _SYNC:
        raise NalError("no sync code in its key frame")


def _size(bits: BitReader) -> tuple[int, int]:
    return bits.u(16) + 1, bits.u(16) + 1


def _sequence(bits: BitReader, profile: int) -> Sequence:
    """color_config (6.2.2)."""
    deep = profile >= 2
    if deep:
        bits.flag()  # 10 or 12 bits
    space = bits.u(3)
    full = True if space == _RGB else bits.flag()
    if space == _RGB and profile not in (1, 3):
        raise NalError("RGB, which its profile does not have")
    if profile in (1, 3):
        bits.u(1 if space == _RGB else 3)  # chroma's size, and a reserved bit
    unlike = f"profile {profile}" if profile else None
    return Sequence(unlike, None, Colour(full, *_CODE_POINTS.get(space, (None, None, None))))

"""What AV1 temporal units say about themselves: their units, and the order of their frames (section 5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mvcodec.video.access_unit import Colour, Sequence, UnitFacts
from mvcodec.video.bits import BitReader, NalError

SEQUENCE_HEADER, FRAME_HEADER, FRAME = 1, 3, 6
"""obu_type (6.2.2)."""

KEY_FRAME = 0
_INTRA_ONLY, _SWITCH_FRAME = 2, 3
_HIGH, _PROFESSIONAL = 1, 2
"""seq_profile (6.4.1)."""

_SRGB = (1, 13, 0)
"""Code points of colour whose range is not sent."""

_NOT_STARTED = "a picture before the first keyframe"

_SELECTED = 2
"""seq_force_screen_content_tools, seq_force_integer_mv: each frame says."""

_SLOTS, _ALL_SLOTS = 8, 0xFF
"""NUM_REF_FRAMES, and refresh_frame_flags that name all of them."""

_HEAD_BYTES = 64
"""More than enough of a frame for what is read of it."""


@dataclass(frozen=True, slots=True)
class Av1Sequence:
    """A sequence header: what frame headers up to their order hint need, and what it says of pictures.

    Attributes:
        size: (width, height), px.
        facts: profile and colour.
        time_bits: of frame_presentation_time; 0 where frames have none.
        id_bits: of current_frame_id; 0 where frames have none.
        screen_content, integer_motion: seq_force_screen_content_tools, seq_force_integer_mv.
        order_bits: of order_hint; 0 where frames have none.
        removal_bits: of all buffer_removal_time of a frame; 0 where none has any.
    """

    size: tuple[int, int]
    facts: Sequence
    time_bits: int
    id_bits: int
    screen_content: int
    integer_motion: int
    order_bits: int
    removal_bits: int


def obus(data: bytes) -> Iterator[tuple[int, bytes]]:
    """obu_type and payload of each open bitstream unit (5.3).

    Raises:
        NalError: one that has no size, or ends behind the data.
    """
    at = 0
    while at < len(data):
        head = data[at]
        if head & 0x80 or not head & 2:
            raise NalError("its forbidden bit is set, or it has no size")
        at += 2 if head & 4 else 1
        size, at = _leb128(data, at)
        if at + size > len(data):
            raise NalError("it ends too early")
        yield head >> 3 & 0xF, data[at : at + size]
        at += size


def _leb128(data: bytes, at: int) -> tuple[int, int]:
    """A number (4.10.5), and where it ends."""
    number = shift = 0
    while True:
        if at >= len(data) or shift > 28:
            raise NalError("it ends too early")
        number |= (data[at] & 0x7F) << shift
        shift += 7
        at += 1
        if not data[at - 1] & 0x80:
            return number, at


class Av1Units:
    """Reads temporal units: their rules, and the order hints of the frames that they show.

    Frame headers name the slots that they build on, not the frames in there: a frame that is missing
    shows by its number only. Encoders count up by one from each shown frame to the next, whatever the
    order in which they code them.
    """

    def __init__(self) -> None:
        self._sequence: Av1Sequence | None = None
        self._slots: list[int | None] = [None] * _SLOTS
        self._last: int | None = None
        self._started = False

    def push(self, data: bytes) -> UnitFacts:
        """See `UnitReader`."""
        sequences, broken, missing, keyframe, pictures = [], [], None, False, 0
        shown: int | None = None
        for kind, content in obus(data):
            if kind == SEQUENCE_HEADER:
                self._sequence = parse_sequence(BitReader(content))
                sequences.append(self._sequence)
            elif kind in (FRAME_HEADER, FRAME):
                pictures += 1
                if self._sequence is None:
                    missing = _NOT_STARTED
                    continue
                bits = BitReader(content[:_HEAD_BYTES])
                if bits.flag():  # show_existing_frame
                    shown = self._slots[bits.u(3)]
                    continue
                frame = _frame_head(self._sequence, bits)
                begins = frame.kind == KEY_FRAME and frame.shown
                keyframe |= begins
                self._started |= begins
                if begins:
                    self._last = None
                self._keep(frame)
                if frame.shown:
                    shown = frame.order
                else:
                    broken.append(("hidden", "a frame that is not shown"))
                if frame.resized:
                    broken.append(("size", "a frame with a size of its own (frame_size_override_flag)"))
        if self._sequence is not None and pictures:
            missing = self._follow(self._sequence, shown) or missing
        return UnitFacts(
            keyframe=keyframe,
            pictures=pictures,
            parameters=bool(sequences),
            sizes=tuple(sequence.size for sequence in sequences),
            sequences=tuple(sequence.facts for sequence in sequences),
            broken=tuple(broken),
            missing=missing,
        )

    def _keep(self, frame: _FrameHead) -> None:
        for slot in range(_SLOTS):
            if frame.refreshed >> slot & 1:
                self._slots[slot] = frame.order

    def _follow(self, sequence: Av1Sequence, shown: int | None) -> str | None:
        """What is missing before the frame that a unit shows, if anything is."""
        if not self._started:
            return _NOT_STARTED
        last, self._last = self._last, shown
        if not sequence.order_bits or last is None:
            return None
        expected = (last + 1) % (1 << sequence.order_bits)
        return None if shown == expected else f"order_hint {shown}, expected {expected}"


@dataclass(frozen=True, slots=True)
class _FrameHead:
    """frame_type, show_frame, frame_size_override_flag, order_hint and refresh_frame_flags."""

    kind: int
    shown: bool
    resized: bool
    order: int
    refreshed: int


def _frame_head(sequence: Av1Sequence, bits: BitReader) -> _FrameHead:
    """A frame header (5.9.2) behind show_existing_frame, up to which slots it is kept in."""
    kind, shown = bits.u(2), bits.flag()
    if shown:
        bits.u(sequence.time_bits)
    else:
        bits.flag()  # showable_frame
    stands = kind == _SWITCH_FRAME or (kind == KEY_FRAME and shown)
    resilient = stands or bits.flag()
    bits.flag()  # disable_cdf_update
    screen = bits.u(1) if sequence.screen_content == _SELECTED else sequence.screen_content
    if screen and sequence.integer_motion == _SELECTED:
        bits.flag()
    bits.u(sequence.id_bits)
    resized = kind == _SWITCH_FRAME or bits.flag()
    order = bits.u(sequence.order_bits)
    if not (resilient or kind in (KEY_FRAME, _INTRA_ONLY)):
        bits.u(3)  # primary_ref_frame
    if sequence.removal_bits and bits.flag():
        bits.u(sequence.removal_bits)
    return _FrameHead(kind, shown, resized, order, _ALL_SLOTS if stands else bits.u(_SLOTS))


def parse_sequence(bits: BitReader) -> Av1Sequence:
    """sequence_header_obu (5.5.1).

    Raises:
        NalError: it breaks off, or is of reduced still pictures, which no video is made of.
    """
    profile = bits.u(3)
    bits.flag()  # still_picture
    if bits.flag():
        raise NalError("a sequence of one still picture")
    time_bits, removal_bits = _timing_and_points(bits)
    across, down = bits.u(4) + 1, bits.u(4) + 1
    size = bits.u(across) + 1, bits.u(down) + 1
    id_bits = 0
    if bits.flag():
        id_bits = bits.u(4) + 2
        id_bits += bits.u(3) + 1
    bits.u(3)  # superblocks and intra tools
    bits.u(4)  # inter tools
    has_order = bits.flag()
    if has_order:
        bits.u(2)
    screen = _SELECTED if bits.flag() else bits.u(1)
    motion = _SELECTED
    if screen and not bits.flag():
        motion = bits.u(1)
    order_bits = bits.u(3) + 1 if has_order else 0
    bits.u(3)  # super-resolution, CDEF and restoration
    return Av1Sequence(
        size, _colour(bits, profile), time_bits, id_bits, screen, motion, order_bits, removal_bits
    )


def _colour(bits: BitReader, profile: int) -> Sequence:
    """color_config (5.5.2), up to the range."""
    deep = bits.flag()
    if profile == _PROFESSIONAL and deep:
        bits.flag()  # 12 bits
    grey = profile != _HIGH and bits.flag()
    points = (bits.u(8), bits.u(8), bits.u(8)) if bits.flag() else (None, None, None)
    full = True if points == _SRGB and not grey else bits.flag()
    wrong = [f"seq_profile {profile}"] * (profile != 0) + ["more than 8 bits"] * deep + ["monochrome"] * grey
    return Sequence(", ".join(wrong) or None, None, Colour(full, *points))


def _timing_and_points(bits: BitReader) -> tuple[int, int]:
    """Timing and operating points: the bits of frame_presentation_time, and of a frame's removal times."""
    equal = model = False
    delay_bits = time_bits = removal_bits = removals = 0
    if bits.flag():
        bits.u(64)
        equal = bits.flag()
        if equal:
            bits.ue()  # uvlc() is read as ue(v) is
        model = bits.flag()
        if model:
            delay_bits = bits.u(5) + 1
            bits.u(32)
            removal_bits = bits.u(5) + 1
            time_bits = bits.u(5) + 1
    has_display_delay = bits.flag()
    for _ in range(bits.u(5) + 1):
        bits.u(12)
        if bits.u(5) > 7:
            bits.flag()
        if model and bits.flag():
            bits.u(2 * delay_bits + 1)
            removals += 1
        if has_display_delay and bits.flag():
            bits.u(4)
    return time_bits if model and not equal else 0, removals * removal_bits

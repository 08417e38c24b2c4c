"""What AV1 temporal units say about themselves: their units, and the order of their frames (section 5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mvcodec.video.bits import BitReader, NalError

SEQUENCE_HEADER, FRAME_HEADER, FRAME = 1, 3, 6
"""obu_type (6.2.2)."""

KEY_FRAME = 0
_SWITCH_FRAME = 3
_SELECTED = 2
"""seq_force_screen_content_tools, seq_force_integer_mv: each frame says."""

_HEAD_BYTES = 64
"""More than enough of a frame for its order hint."""


@dataclass(frozen=True, slots=True)
class Av1Sequence:
    """A sequence header, as far as frame headers up to their order hint need it.

    Attributes:
        time_bits: of frame_presentation_time; 0 where frames have none.
        id_bits: of current_frame_id; 0 where frames have none.
        screen_content, integer_motion: seq_force_screen_content_tools, seq_force_integer_mv.
        order_bits: of order_hint; 0 where frames have none.
    """

    time_bits: int
    id_bits: int
    screen_content: int
    integer_motion: int
    order_bits: int


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
        size, shift = 0, 0
        while True:
            if at >= len(data) or shift > 28:
                raise NalError("it ends too early")
            size |= (data[at] & 0x7F) << shift
            shift += 7
            at += 1
            if not data[at - 1] & 0x80:
                break
        if at + size > len(data):
            raise NalError("it ends too early")
        yield head >> 3 & 0xF, data[at : at + size]
        at += size


class Av1References:
    """Follows the order hints of a track's frames, which FORMAT.md has count up by one.

    Frame headers name the slots that they build on, not the frames in there: a frame that is missing
    shows by its number only.

    Attributes:
        key_frame: the last unit holds one.
    """

    def __init__(self) -> None:
        self._sequence: Av1Sequence | None = None
        self._last: int | None = None
        self._started = False
        self.key_frame = False

    def push(self, data: bytes) -> str | None:
        """Follow one temporal unit; returns what is missing, if anything is.

        Raises:
            NalError: a unit that breaks off.
        """
        missing, self.key_frame = None, False
        for kind, content in obus(data):
            if kind == SEQUENCE_HEADER:
                self._sequence = _sequence(BitReader(content))
            elif kind in (FRAME_HEADER, FRAME):
                if self._sequence is None:
                    return "a picture before the first keyframe"
                missing = self._frame(self._sequence, BitReader(content[:_HEAD_BYTES])) or missing
        return missing

    def _frame(self, sequence: Av1Sequence, bits: BitReader) -> str | None:
        if bits.flag():  # show_existing_frame
            return None
        kind, order = _frame_order(sequence, bits)
        last, self._last = self._last, order
        if kind == KEY_FRAME:
            self._started = self.key_frame = True
            return None
        if not self._started:
            return "a picture before the first keyframe"
        if not sequence.order_bits or last is None:
            return None
        expected = (last + 1) % (1 << sequence.order_bits)
        return None if order == expected else f"order_hint {order}, expected {expected}"


def _frame_order(sequence: Av1Sequence, bits: BitReader) -> tuple[int, int]:
    """frame_type and order_hint of a frame header (5.9.2) behind show_existing_frame."""
    kind, shown = bits.u(2), bits.flag()
    if shown:
        bits.u(sequence.time_bits)
    else:
        bits.flag()  # showable_frame
    if not (kind == _SWITCH_FRAME or (kind == KEY_FRAME and shown)):
        bits.flag()  # error_resilient_mode
    bits.flag()  # disable_cdf_update
    screen = bits.u(1) if sequence.screen_content == _SELECTED else sequence.screen_content
    if screen and sequence.integer_motion == _SELECTED:
        bits.flag()
    bits.u(sequence.id_bits)
    if kind != _SWITCH_FRAME:
        bits.flag()  # frame_size_override_flag
    return kind, bits.u(sequence.order_bits)


def _sequence(bits: BitReader) -> Av1Sequence:
    """sequence_header_obu (5.5.1). Reduced still pictures, which no video is made of, are refused."""
    bits.u(4)
    if bits.flag():
        raise NalError("a sequence of one still picture")
    time_bits = _timing_and_points(bits)
    widths = bits.u(4) + 1, bits.u(4) + 1
    bits.u(sum(widths))
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
    return Av1Sequence(time_bits, id_bits, screen, motion, bits.u(3) + 1 if has_order else 0)


def _timing_and_points(bits: BitReader) -> int:
    """Timing and operating points; returns the bits of frame_presentation_time."""
    equal = model = False
    delay_bits = time_bits = 0
    if bits.flag():
        bits.u(64)
        equal = bits.flag()
        if equal:
            bits.ue()  # uvlc() is read as ue(v) is
        model = bits.flag()
        if model:
            delay_bits = bits.u(5) + 1
            bits.u(37)
            time_bits = bits.u(5) + 1
    has_display_delay = bits.flag()
    for _ in range(bits.u(5) + 1):
        bits.u(12)
        if bits.u(5) > 7:
            bits.flag()
        if model and bits.flag():
            bits.u(2 * delay_bits + 1)
        if has_display_delay and bits.flag():
            bits.u(4)
    return time_bits if model and not equal else 0

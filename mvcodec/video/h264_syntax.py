"""What H.264 access units say about themselves: parameter sets and slice headers (ITU-T H.264, 7.3)."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.video.access_unit import Colour, Sequence, UnitFacts, usability_colour
from mvcodec.video.annexb import (
    IDR_SLICE,
    PPS,
    SEI,
    SLICE,
    SPS,
    begins_with_start_code,
    nal_type,
    nal_units,
)
from mvcodec.video.bits import BitReader, NalError, payload
from mvcodec.video.sei import recovers_at_once

_HIGH_PROFILES = frozenset({100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135})
"""The profile_idc whose parameter sets have fields of chroma and bit depth (7.3.2.1.1)."""

_HEAD_BYTES = 64
"""More than enough of a slice for the first fields of its header."""

P_SLICE, B_SLICE, I_SLICE = 0, 1, 2
"""slice_type modulo 5 (table 7-6)."""

MAX_PARAMETER_SET_BYTES = 4096
"""A parameter set has some tens of bytes; a longer one is damage."""

PLAIN_PROFILES = frozenset({66, 77, 88, 100})
"""profile_idc up to High: 8 bits, 4:2:0, decoded everywhere."""

_PARTITIONS = frozenset({2, 3, 4})
_NO_REORDERING = 2
"""pic_order_cnt_type of streams in the order of display."""

MAX_CYCLE = 255
"""num_ref_frames_in_pic_order_cnt_cycle, at most (7.4.2.1.1)."""


@dataclass(frozen=True, slots=True)
class SequenceParameters:
    """A sequence parameter set, as far as mvcodec cares.

    Attributes:
        number: seq_parameter_set_id.
        profile: profile_idc.
        chroma_format: chroma_format_idc; 1 is 4:2:0.
        bit_depth: of luma.
        frame_num_bits: bits of frame_num in slice headers.
        progressive: frame_mbs_only_flag.
        width, height: px after cropping.
        reorder: pictures that may wait for reordering; None where the stream does not say.
        order_type: pic_order_cnt_type; 2 has no reordering.
        colour: None without VUI.
    """

    number: int
    profile: int
    chroma_format: int
    bit_depth: int
    frame_num_bits: int
    progressive: bool
    width: int
    height: int
    reorder: int | None
    order_type: int
    colour: Colour | None


@dataclass(frozen=True, slots=True)
class SliceHeader:
    """The first fields of a slice.

    Attributes:
        first_block: first_mb_in_slice; 0 begins a picture.
        kind: P_SLICE, B_SLICE, I_SLICE, or 3 and 4 for SP and SI.
        picture_set: pic_parameter_set_id.
        idr: in an IDR picture.
        reference: other pictures may refer to it.
        frame_num: see 7.4.3; None where the parameter sets are not known.
    """

    first_block: int
    kind: int
    picture_set: int
    idr: bool
    reference: bool
    frame_num: int | None


class H264Units:
    """Reads access units: their rules, and their frame_num (7.4.3)."""

    def __init__(self) -> None:
        self._sequences: dict[int, SequenceParameters] = {}
        self._picture_sets: dict[int, int] = {}
        self._next: int | None = None
        self._last: int | None = None

    def push(self, data: bytes) -> UnitFacts:
        """See `UnitReader`."""
        broken = [] if begins_with_start_code(data) else [("annex-b", "no start code at its beginning")]
        kinds, recovery, slices, sequences = set(), False, [], []
        for unit in nal_units(data):
            if unit[0] & 0x80:
                raise NalError("a NAL unit with its forbidden bit set")
            kind = nal_type(unit)
            kinds.add(kind)
            if kind in (SLICE, IDR_SLICE):
                slices.append(self._slice(unit, kind))
            elif kind == SPS:
                sequences.append(parse_sequence(unit))
                self._sequences[sequences[-1].number] = sequences[-1]
            elif kind == PPS:
                number, sequence = _picture_set(unit)
                self._picture_sets[number] = sequence
            elif kind == SEI:
                recovery = recovery or recovers_at_once(unit)
        slice_kinds = {piece.kind for piece in slices}
        if B_SLICE in slice_kinds:
            broken.append(("b-frames", "a B slice"))
        if not _PARTITIONS.isdisjoint(kinds):
            broken.append(("partition", "data partitions"))
        missing, pictures = None, 0
        for piece in slices:
            if piece.first_block == 0:
                pictures += 1
                missing = self._picture(piece, broken) or missing
        return UnitFacts(
            keyframe=IDR_SLICE in kinds,
            pictures=pictures,
            parameters=SPS in kinds and PPS in kinds,
            sizes=tuple([(found.width, found.height) for found in sequences]),
            sequences=tuple([_facts(found) for found in sequences]),
            broken=tuple(broken),
            missing=missing,
            recovers=recovery and slice_kinds == {I_SLICE},
        )

    def _slice(self, unit: bytes, kind: int) -> SliceHeader:
        bits = BitReader(payload(unit, limit=_HEAD_BYTES))
        first, slice_type, number = bits.ue(), bits.ue() % 5, bits.ue()
        sequence = self._sequences.get(self._picture_sets.get(number, -1))
        frame_num = None if sequence is None else bits.u(sequence.frame_num_bits)
        return SliceHeader(first, slice_type, number, kind == IDR_SLICE, bool(unit[0] & 0x60), frame_num)

    def _picture(self, piece: SliceHeader, broken: list[tuple[str, str]]) -> str | None:
        """What a picture builds on that never came; `piece` is its first slice."""
        sequence = self._sequences.get(self._picture_sets.get(piece.picture_set, -1))
        if sequence is None or piece.frame_num is None:
            broken.append(("parameter-sets", "a slice whose parameter sets never came"))
            return None
        missing = None
        # The second field of a frame has the number of the first.
        legal = (self._next,) if sequence.progressive else (self._next, self._last)
        if not piece.idr and self._next is None:
            missing = "a picture before the first keyframe"
        elif not piece.idr and piece.frame_num not in legal:
            missing = f"frame_num {piece.frame_num}, expected {self._next}"
        self._last = piece.frame_num
        top = 1 << sequence.frame_num_bits
        self._next = (piece.frame_num + 1) % top if piece.reference else piece.frame_num
        return missing


def _facts(found: SequenceParameters) -> Sequence:
    plain = found.chroma_format == 1 and found.bit_depth == 8 and found.progressive
    unlike = None if plain and found.profile in PLAIN_PROFILES else f"profile_idc {found.profile}"
    reordered = None
    if found.order_type != _NO_REORDERING and found.reorder != 0:
        reordered = "no pic_order_cnt_type 2, no max_num_reorder_frames 0"
    return Sequence(unlike, reordered, found.colour)


def parse_sequence(unit: bytes) -> SequenceParameters:
    """Parse a sequence parameter set (7.3.2.1.1).

    Raises:
        NalError: it breaks off or holds what the standard does not allow.
    """
    if len(unit) > MAX_PARAMETER_SET_BYTES:
        raise NalError(f"a parameter set of {len(unit)} bytes")
    bits = BitReader(payload(unit))
    profile = bits.u(8)
    bits.u(16)  # constraint flags and level
    number = bits.ue()
    chroma, depth = _chroma(bits) if profile in _HIGH_PROFILES else (1, 8)
    frame_num_bits = bits.ue() + 4
    order_type = _picture_order(bits)
    bits.ue()  # max_num_ref_frames
    bits.flag()  # gaps_in_frame_num_value_allowed_flag
    width, height = 16 * (bits.ue() + 1), bits.ue() + 1
    progressive = bits.flag()
    if not progressive:
        bits.flag()
    height *= 16 if progressive else 32
    bits.flag()  # direct_8x8_inference_flag
    left, right, top, bottom = (bits.ue() for _ in range(4)) if bits.flag() else (0, 0, 0, 0)
    across, down = (2 if chroma in (1, 2) else 1), (2 if chroma == 1 else 1) * (1 if progressive else 2)
    width, height = width - across * (left + right), height - down * (top + bottom)
    if frame_num_bits > 16 or width < 1 or height < 1:
        raise NalError("a sequence parameter set that the standard does not allow")
    colour, reorder = _usability(bits) if bits.flag() else (None, None)
    return SequenceParameters(
        number,
        profile,
        chroma,
        depth,
        frame_num_bits,
        progressive,
        width,
        height,
        reorder,
        order_type,
        colour,
    )


def _chroma(bits: BitReader) -> tuple[int, int]:
    chroma = bits.ue()
    if chroma == 3:
        bits.flag()
    depth = bits.ue() + 8
    bits.ue()  # bit depth of chroma
    bits.flag()
    if bits.flag():  # scaling matrices
        for index in range(8 if chroma != 3 else 12):
            if bits.flag():
                _skip_scaling_list(bits, 16 if index < 6 else 64)
    return chroma, depth


def _skip_scaling_list(bits: BitReader, size: int) -> None:
    last = following = 8
    for _ in range(size):
        if following:
            following = (last + bits.se()) % 256
        last = following or last


def _picture_order(bits: BitReader) -> int:
    order_type = bits.ue()
    if order_type == 0:
        bits.ue()
    elif order_type == 1:
        bits.flag()
        bits.se()
        bits.se()
        cycle = bits.ue()
        if cycle > MAX_CYCLE:
            raise NalError(f"a cycle of {cycle} pictures")
        for _ in range(cycle):
            bits.se()
    return order_type


def _usability(bits: BitReader) -> tuple[Colour, int | None]:
    """Video usability information (annex E.1.1): colour, and the pictures that may be reordered."""
    colour = usability_colour(bits)
    if bits.flag():  # timing
        bits.u(65)
    models = 0
    for _ in range(2):
        if bits.flag():
            _skip_decoder_model(bits)
            models += 1
    if models:
        bits.flag()
    bits.flag()  # pic_struct_present_flag
    reorder = None
    if bits.flag():
        bits.flag()
        for _ in range(4):
            bits.ue()
        reorder = bits.ue()
    return colour, reorder


def _skip_decoder_model(bits: BitReader) -> None:
    count = bits.ue() + 1
    if count > 32:
        raise NalError(f"{count} coded picture buffers")
    bits.u(8)
    for _ in range(count):
        bits.ue()
        bits.ue()
        bits.flag()
    bits.u(20)


def _picture_set(unit: bytes) -> tuple[int, int]:
    bits = BitReader(payload(unit, limit=_HEAD_BYTES))
    return bits.ue(), bits.ue()

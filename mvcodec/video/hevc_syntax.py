"""What HEVC access units say about the pictures that they build on (ITU-T H.265, 7.3 and 8.3)."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.video.annexb import nal_units
from mvcodec.video.bits import BitReader, NalError, payload

IDR_KINDS = frozenset({19, 20})
"""nal_unit_type of IDR pictures (table 7-1)."""

LAST_SLICE_KIND = 31
VPS, SPS, PPS = 32, 33, 34

_IRAP = range(16, 24)
_NO_ANCHOR = frozenset({0, 2, 4, 6, 7, 8, 9, 10, 12, 14})
"""Sub-layer non-reference and leading pictures: no later order count builds on theirs (8.3.1)."""

_HEAD_BYTES = 2
_SLICE_BYTES = 512
"""More than enough of a slice for the reference pictures in its header."""

MAX_PARAMETER_SET_BYTES = 4096
MAX_REFERENCE_SETS = 64
MAX_REFERENCES = 16
"""As the standard has them (7.4.3.2.1, A.4.2)."""

_PROFILE_BITS = 88
_PIXEL_SHAPE_EXTENDED = 3

ReferenceSet = tuple[tuple[int, bool], ...]
"""(difference of order counts, whether the picture at hand builds on it) of each picture that stays."""


@dataclass(frozen=True, slots=True)
class HevcSequence:
    """A sequence parameter set, as far as references go.

    Attributes:
        order_bits: bits of slice_pic_order_cnt_lsb.
        reference_sets: the short-term ones that slices name by number.
        separate_planes: separate_colour_plane_flag.
    """

    order_bits: int
    reference_sets: tuple[ReferenceSet, ...]
    separate_planes: bool


@dataclass(frozen=True, slots=True)
class HevcPictureSet:
    """A picture parameter set, as far as slice headers need it."""

    sequence: int
    has_output_flag: bool
    extra_bits: int


def nal_kind(unit: bytes) -> int:
    """nal_unit_type of an HEVC NAL unit."""
    return unit[0] >> 1 & 0x3F


def begins_picture(unit: bytes) -> bool:
    """Whether a NAL unit is the first slice of a picture."""
    return nal_kind(unit) <= LAST_SLICE_KIND and len(unit) > _HEAD_BYTES and bool(unit[2] & 0x80)


class HevcReferences:
    """Follows which pictures of a track are there to build on (8.3.1, 8.3.2); long-term ones are left out."""

    def __init__(self) -> None:
        self._sequences: dict[int, HevcSequence] = {}
        self._picture_sets: dict[int, HevcPictureSet] = {}
        self._held: set[int] = set()
        self._order = 0  # of the picture that the next one's order count builds on
        self._started = False

    def push(self, data: bytes) -> str | None:
        """Follow one access unit; returns what is missing, if anything is.

        Raises:
            NalError: a NAL unit that breaks off or holds what the standard does not allow.
        """
        missing = None
        for unit in nal_units(data):
            kind = nal_kind(unit)
            if kind in (SPS, PPS) and len(unit) > MAX_PARAMETER_SET_BYTES:
                raise NalError(f"a parameter set of {len(unit)} bytes")
            if kind == SPS:
                number, sequence = _sequence(BitReader(payload(unit, _HEAD_BYTES)))
                self._sequences[number] = sequence
            elif kind == PPS:
                number, picture_set = _picture_set(BitReader(payload(unit, _HEAD_BYTES)))
                self._picture_sets[number] = picture_set
            elif begins_picture(unit):
                missing = self._picture(unit, kind) or missing
        return missing

    def _picture(self, unit: bytes, kind: int) -> str | None:
        bits = BitReader(payload(unit, _HEAD_BYTES, _SLICE_BYTES))
        bits.flag()  # first_slice_segment_in_pic_flag
        if kind in _IRAP:
            bits.flag()
        picture_set = self._picture_sets.get(bits.ue())
        sequence = None if picture_set is None else self._sequences.get(picture_set.sequence)
        if kind in IDR_KINDS:
            self._held, self._order, self._started = {0}, 0, True
            return None
        if not self._started:
            return "a picture before the first keyframe"
        if picture_set is None or sequence is None:
            return "a picture whose parameter sets never came"
        bits.u(picture_set.extra_bits)
        bits.ue()  # slice_type
        bits.u(picture_set.has_output_flag + 2 * sequence.separate_planes)
        order = self._full_order(bits.u(sequence.order_bits), sequence.order_bits)
        stays = self._stays(bits, sequence)
        if unit[1] & 7 == 1 and kind not in _NO_ANCHOR:
            self._order = order
        absent = sorted(order + step for step, used in stays if used and order + step not in self._held)
        self._held = {order + step for step, _ in stays if order + step in self._held} | {order}
        if absent:
            return f"picture {order} builds on {', '.join(map(str, absent))}"
        return None

    def _full_order(self, low: int, bits: int) -> int:
        """PicOrderCntVal (8-1)."""
        top = 1 << bits
        low_before = self._order % top
        high = self._order - low_before
        if low < low_before and low_before - low >= top // 2:
            high += top
        elif low > low_before and low - low_before > top // 2:
            high -= top
        return high + low

    @staticmethod
    def _stays(bits: BitReader, sequence: HevcSequence) -> ReferenceSet:
        known = sequence.reference_sets
        if not bits.flag():
            return _reference_set(bits, len(known), known, in_slice=True)
        number = bits.u((len(known) - 1).bit_length()) if known else 0
        if number >= len(known):
            raise NalError("a reference picture set that was not sent")
        return known[number]


def _picture_set(bits: BitReader) -> tuple[int, HevcPictureSet]:
    number, sequence = bits.ue(), bits.ue()
    bits.flag()  # dependent_slice_segments_enabled_flag
    return number, HevcPictureSet(sequence, bits.flag(), bits.u(3))


def _sequence(bits: BitReader) -> tuple[int, HevcSequence]:
    """7.3.2.2, up to the reference picture sets."""
    bits.u(4)
    layers = bits.u(3) + 1
    bits.flag()
    _skip_profile(bits, layers)
    number = bits.ue()
    separate = bits.ue() == _PIXEL_SHAPE_EXTENDED and bits.flag()
    bits.ue()
    bits.ue()
    if bits.flag():  # conformance window
        for _ in range(4):
            bits.ue()
    bits.ue()
    bits.ue()
    order_bits = bits.ue() + 4
    if order_bits > 16:
        raise NalError(f"{order_bits} bits of picture order count")
    for _ in range(3 * (layers if bits.flag() else 1)):
        bits.ue()
    for _ in range(6):  # sizes of blocks and depths of trees
        bits.ue()
    if bits.flag() and bits.flag():
        _skip_scaling_lists(bits)
    bits.u(2)
    if bits.flag():  # PCM
        bits.u(8)
        bits.ue()
        bits.ue()
        bits.flag()
    count = bits.ue()
    if count > MAX_REFERENCE_SETS:
        raise NalError(f"{count} reference picture sets")
    sets: list[ReferenceSet] = []
    for index in range(count):
        sets.append(_reference_set(bits, index, sets, in_slice=False))
    return number, HevcSequence(order_bits, tuple(sets), separate)


def _skip_profile(bits: BitReader, layers: int) -> None:
    """profile_tier_level (7.3.3)."""
    bits.u(_PROFILE_BITS + 8)
    present = [(bits.flag(), bits.flag()) for _ in range(layers - 1)]
    if present:
        bits.u(2 * (8 - len(present)))
    for profile, level in present:
        bits.u(_PROFILE_BITS * profile + 8 * level)


def _skip_scaling_lists(bits: BitReader) -> None:
    """scaling_list_data (7.3.4)."""
    for size in range(4):
        for _ in range(0, 6, 3 if size == 3 else 1):
            if not bits.flag():
                bits.ue()
                continue
            for _ in range((size > 1) + min(64, 16 << 2 * size)):
                bits.se()


def _reference_set(
    bits: BitReader, index: int, before: list[ReferenceSet] | tuple[ReferenceSet, ...], *, in_slice: bool
) -> ReferenceSet:
    """st_ref_pic_set (7.3.7): past pictures from near to far, then future ones."""
    if index and bits.flag():
        return _predicted_set(bits, index, before, in_slice=in_slice)
    past, future = bits.ue(), bits.ue()
    if past + future > MAX_REFERENCES:
        raise NalError(f"{past + future} reference pictures")
    found: list[tuple[int, bool]] = []
    for count, sign in ((past, -1), (future, 1)):
        step = 0
        for _ in range(count):
            step += sign * (bits.ue() + 1)
            found.append((step, bits.flag()))
    return tuple(found)


def _predicted_set(
    bits: BitReader, index: int, before: list[ReferenceSet] | tuple[ReferenceSet, ...], *, in_slice: bool
) -> ReferenceSet:
    """A set by its difference from one before (7-61, 7-62)."""
    back = bits.ue() + 1 if in_slice else 1
    if back > index:
        raise NalError("a reference picture set that builds on none")
    shift = -1 if bits.flag() else 1
    shift *= bits.ue() + 1
    base = (*before[index - back], (0, False))
    found = []
    for step, _ in base:
        used = bits.flag()
        if used or bits.flag():
            found.append((step + shift, used))
    if len(found) > MAX_REFERENCES:
        raise NalError(f"{len(found)} reference pictures")
    # Later sets count through this one in the standard's order: past from near to far, then future.
    past = sorted((one for one in found if one[0] < 0), reverse=True)
    return (*past, *sorted(one for one in found if one[0] > 0))

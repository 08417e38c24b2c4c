"""What HEVC access units say about themselves and the pictures that they build on (ITU-T H.265, 7.3, 8.3)."""

from __future__ import annotations

from dataclasses import dataclass

from mvcodec.video.access_unit import Colour, Sequence, UnitFacts, usability_colour
from mvcodec.video.annexb import begins_with_start_code, nal_units
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
MAX_LONG_TERM = 32
"""As the standard has them (7.4.3.2.1, A.4.2)."""

_MAIN = 1
"""general_profile_idc."""

_PIXEL_SHAPE_EXTENDED = 3

ReferenceSet = tuple[tuple[int, bool], ...]
"""(difference of order counts, whether the picture at hand builds on it) of each picture that stays."""


@dataclass(frozen=True, slots=True)
class HevcSequence:
    """A sequence parameter set, as far as mvcodec cares.

    Attributes:
        size: (width, height), px after cropping.
        facts: profile, reordering and colour.
        order_bits: bits of slice_pic_order_cnt_lsb.
        reference_sets: the short-term ones that slices name by number.
        separate_planes: separate_colour_plane_flag.
    """

    size: tuple[int, int]
    facts: Sequence
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


class HevcUnits:
    """Reads access units: their rules, and which pictures are there to build on (8.3.1, 8.3.2).

    Long-term reference pictures are left out.
    """

    def __init__(self) -> None:
        self._sequences: dict[int, HevcSequence] = {}
        self._picture_sets: dict[int, HevcPictureSet] = {}
        self._held: set[int] = set()
        self._order = 0  # of the picture that the next one's order count builds on
        self._shown = 0  # order count of the last picture
        self._started = False

    def push(self, data: bytes) -> UnitFacts:
        """See `UnitReader`."""
        broken = [] if begins_with_start_code(data) else [("annex-b", "no start code at its beginning")]
        missing, kinds, pictures, sequences = None, set(), 0, []
        for unit in nal_units(data):
            kind = nal_kind(unit)
            kinds.add(kind)
            if kind in (SPS, PPS) and len(unit) > MAX_PARAMETER_SET_BYTES:
                raise NalError(f"a parameter set of {len(unit)} bytes")
            if kind == SPS:
                number, sequence = parse_sequence(BitReader(payload(unit, _HEAD_BYTES)))
                self._sequences[number] = sequence
                sequences.append(sequence)
            elif kind == PPS:
                number, picture_set = _picture_set(BitReader(payload(unit, _HEAD_BYTES)))
                self._picture_sets[number] = picture_set
            elif begins_picture(unit):
                pictures += 1
                missing = self._picture(unit, kind, broken) or missing
        return UnitFacts(
            keyframe=bool(kinds & IDR_KINDS),
            pictures=pictures,
            parameters={VPS, SPS, PPS} <= kinds,
            sizes=tuple(sequence.size for sequence in sequences),
            sequences=tuple(sequence.facts for sequence in sequences),
            broken=tuple(broken),
            missing=missing,
            recovers=bool(kinds & set(_IRAP)),
        )

    def _picture(self, unit: bytes, kind: int, broken: list[tuple[str, str]]) -> str | None:
        bits = BitReader(payload(unit, _HEAD_BYTES, _SLICE_BYTES))
        bits.flag()  # first_slice_segment_in_pic_flag
        if kind in _IRAP:
            bits.flag()
        picture_set = self._picture_sets.get(bits.ue())
        sequence = None if picture_set is None else self._sequences.get(picture_set.sequence)
        idr = kind in IDR_KINDS
        if idr:
            self._held, self._order, self._shown, self._started = {0}, 0, 0, True
        elif kind in _IRAP and not self._started:
            self._started = True
        elif not self._started:
            return "a picture before the first keyframe"
        if picture_set is None or sequence is None:
            return "a picture whose parameter sets never came"
        bits.u(picture_set.extra_bits)
        bits.ue()  # slice_type
        if picture_set.has_output_flag and not bits.flag():
            broken.append(("hidden", "a picture that is not shown"))
        bits.u(2 * sequence.separate_planes)
        if idr:
            return None
        order = self._full_order(bits.u(sequence.order_bits), sequence.order_bits)
        if order <= self._shown:
            broken.append(("reorder", f"picture {order} comes after picture {self._shown}"))
        self._shown = order
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


def parse_sequence(bits: BitReader) -> tuple[int, HevcSequence]:
    """Number and content of a sequence parameter set (7.3.2.2).

    Raises:
        NalError: it breaks off or holds what the standard does not allow.
    """
    bits.u(4)
    layers = bits.u(3) + 1
    bits.flag()
    profile, is_main = _profile(bits, layers)
    number = bits.ue()
    chroma = bits.ue()
    separate = chroma == _PIXEL_SHAPE_EXTENDED and bits.flag()
    width, height = bits.ue(), bits.ue()
    if bits.flag():  # conformance window
        left, right, top, bottom = (bits.ue() for _ in range(4))
        width -= (2 if chroma in (1, 2) else 1) * (left + right)
        height -= (2 if chroma == 1 else 1) * (top + bottom)
    if width < 1 or height < 1:
        raise NalError("a sequence parameter set that the standard does not allow")
    depths = bits.ue() + 8, bits.ue() + 8
    order_bits = bits.ue() + 4
    if order_bits > 16:
        raise NalError(f"{order_bits} bits of picture order count")
    reorder = 0
    for _ in range(layers if bits.flag() else 1):
        bits.ue()
        reorder = bits.ue()  # of the highest layer, in the end
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
    sets = _reference_sets(bits)
    if bits.flag():  # long-term reference pictures
        bits.u(_long_term_count(bits) * (order_bits + 1))
    bits.u(2)
    colour, fields = _usability(bits) if bits.flag() else (None, False)
    plain = is_main and chroma == 1 and depths == (8, 8) and not fields
    facts = Sequence(
        None if plain else f"general_profile_idc {profile}, {depths[0]} bits, chroma_format_idc {chroma}",
        f"sps_max_num_reorder_pics {reorder}" if reorder else None,
        colour,
    )
    return number, HevcSequence((width, height), facts, order_bits, sets, separate)


def _long_term_count(bits: BitReader) -> int:
    count = bits.ue()
    if count > MAX_LONG_TERM:
        raise NalError(f"{count} long-term reference pictures")
    return count


def _reference_sets(bits: BitReader) -> tuple[ReferenceSet, ...]:
    count = bits.ue()
    if count > MAX_REFERENCE_SETS:
        raise NalError(f"{count} reference picture sets")
    sets: list[ReferenceSet] = []
    for index in range(count):
        sets.append(_reference_set(bits, index, sets, in_slice=False))
    return tuple(sets)


def _usability(bits: BitReader) -> tuple[Colour, bool]:
    """Video usability information (annex E.2.1): colour, and whether pictures are fields."""
    colour = usability_colour(bits)
    bits.flag()  # neutral_chroma_indication_flag
    return colour, bits.flag()


def _profile(bits: BitReader, layers: int) -> tuple[int, bool]:
    """profile_tier_level (7.3.3): general_profile_idc, and whether decoders of Main decode it."""
    bits.u(3)  # profile space and tier
    profile = bits.u(5)
    compatible = bits.u(32)
    bits.u(48 + 8)  # constraints and level
    present = [(bits.flag(), bits.flag()) for _ in range(layers - 1)]
    if present:
        bits.u(2 * (8 - len(present)))
    for has_profile, has_level in present:
        bits.u(88 * has_profile + 8 * has_level)
    return profile, profile == _MAIN or bool(compatible >> (31 - _MAIN) & 1)


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

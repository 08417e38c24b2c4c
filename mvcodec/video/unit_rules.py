"""The rules of FORMAT.md for access units, codec by codec."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol

from mvcodec.stream import TrackKind
from mvcodec.video.annexb import nal_units
from mvcodec.video.bits import NalError
from mvcodec.video.h264_syntax import B_SLICE, AccessUnit, H264Parser, SequenceParameters

Broken = Iterator[tuple[str, str]]
"""(code, message) of each rule that is broken."""

PLAIN_PROFILES = frozenset({66, 77, 88, 100})
"""profile_idc up to High: 8 bits, 4:2:0, decoded everywhere."""

_PARTITIONS = frozenset({2, 3, 4})
_BT709 = 1
_SPS, _PPS = 7, 8
_EXPECTED_COLOUR = (_BT709, _BT709, _BT709)


class UnitRules(Protocol):
    """Checks the access units of one track in order."""

    def push(self, data: bytes, keyframe: bool) -> Broken:
        """What is wrong with an access unit; `keyframe`: a header came with it."""
        ...


class H264Rules:
    """H.264: one picture a unit, no B slices, IDR with SPS and PPS where a keyframe is due, tags.

    Args:
        kind: what the track carries.
        size: (width, height) as coded.
    """

    def __init__(self, kind: TrackKind, size: tuple[int, int]) -> None:
        self._kind, self._size = kind, size
        self._parser = H264Parser()
        self._next: int | None = None

    def push(self, data: bytes, keyframe: bool) -> Broken:
        """See `UnitRules`."""
        if not data.startswith((b"\x00\x00\x01", b"\x00\x00\x00\x01")):
            yield "annex-b", "no start code at its beginning"
        try:
            unit = self._parser.push(data)
        except NalError as error:
            yield "nal", f"a damaged NAL unit ({error})"
            return
        yield from self._structure(unit, keyframe)
        for sequence in unit.sequence_sets:
            yield from self._sequence(sequence)
        yield from self._references(unit)

    def _structure(self, unit: AccessUnit, keyframe: bool) -> Broken:
        if unit.pictures != 1:
            yield "one-picture", f"{unit.pictures} pictures in one message"
        if any(piece.kind == B_SLICE for piece in unit.slices):
            yield "b-frames", "a B slice"
        if _PARTITIONS & set(unit.kinds):
            yield "partition", "data partitions"
        if keyframe and not unit.idr:
            yield "keyframe", "no IDR picture though a header came with it"
        if keyframe and not {_SPS, _PPS} <= set(unit.kinds):
            yield "parameter-sets", "a keyframe without SPS and PPS"
        if unit.idr and not keyframe:
            yield "keyframe", "an IDR picture without a header"

    def _sequence(self, sequence: SequenceParameters) -> Broken:
        plain = sequence.chroma_format == 1 and sequence.bit_depth == 8 and sequence.progressive
        if sequence.profile not in PLAIN_PROFILES or not plain:
            yield (
                "profile",
                f"profile_idc {sequence.profile}, expected High or lower, 8 bits, 4:2:0, progressive",
            )
        if (sequence.width, sequence.height) != self._size:
            found, expected = (f"{w}x{h}" for w, h in ((sequence.width, sequence.height), self._size))
            yield "size", f"pictures of {found}, expected {expected} as the header says"
        if sequence.order_type != 2 and sequence.reorder != 0:
            yield (
                "reorder",
                "pictures may be reordered (no pic_order_cnt_type 2, no max_num_reorder_frames 0)",
            )
        colour = sequence.colour
        full = self._kind is TrackKind.DISPARITY
        if colour is None or colour.full_range != full:
            yield "colour", f"expected video_full_range_flag = {int(full)}"
        elif not full and (colour.primaries, colour.transfer, colour.matrix) != _EXPECTED_COLOUR:
            yield "colour", "expected BT.709 primaries, transfer and matrix (1, 1, 1)"

    def _references(self, unit: AccessUnit) -> Broken:
        for piece in unit.slices:
            if piece.first_block:
                continue
            top = self._parser.frame_num_range(piece)
            if top is None or piece.frame_num is None:
                yield "parameter-sets", "a slice whose parameter sets never came"
                continue
            if not piece.idr and self._next is None:
                yield "missing-reference", "a picture before the first keyframe"
            elif not piece.idr and piece.frame_num != self._next:
                yield (
                    "missing-reference",
                    f"frame_num {piece.frame_num}, expected {self._next}",
                )
            self._next = (piece.frame_num + 1) % top if piece.reference else piece.frame_num


_HEVC_IDR = frozenset({19, 20})
_HEVC_SETS = frozenset({32, 33, 34})
_HEVC_LAST_SLICE = 31


class HevcRules:
    """HEVC: one picture a unit, IDR with VPS, SPS and PPS where a keyframe is due."""

    def __init__(self) -> None:
        self._seen_keyframe = False

    def push(self, data: bytes, keyframe: bool) -> Broken:
        """See `UnitRules`."""
        units = [unit for unit in nal_units(data) if len(unit) > 2]
        kinds = {unit[0] >> 1 & 0x3F for unit in units}
        pictures = sum(bool(unit[0] >> 1 & 0x3F <= _HEVC_LAST_SLICE and unit[2] & 0x80) for unit in units)
        if pictures != 1:
            yield "one-picture", f"{pictures} pictures in one message"
        idr = bool(kinds & _HEVC_IDR)
        if keyframe != idr:
            yield (
                "keyframe",
                "an IDR picture without a header" if idr else "no IDR picture though a header came",
            )
        if keyframe and not kinds >= _HEVC_SETS:
            yield "parameter-sets", "a keyframe without VPS, SPS and PPS"
        if not self._seen_keyframe and not idr:
            yield "missing-reference", "a picture before the first keyframe"
        self._seen_keyframe |= idr


_AV1_SEQUENCE, _AV1_FRAME_HEADER, _AV1_FRAME = 1, 3, 6


class Av1Rules:
    """AV1: one frame a unit, a sequence header where a keyframe is due, OBUs that are whole."""

    def push(self, data: bytes, keyframe: bool) -> Broken:
        """See `UnitRules`."""
        try:
            kinds = list(_obu_kinds(data))
        except NalError as error:
            yield "obu", f"a damaged OBU ({error})"
            return
        if not {_AV1_FRAME, _AV1_FRAME_HEADER} & set(kinds):
            yield "one-picture", "no frame in a message"
        if keyframe and _AV1_SEQUENCE not in kinds:
            yield "parameter-sets", "a keyframe without sequence header"


def _obu_kinds(data: bytes) -> Iterator[int]:
    """obu_type of each open bitstream unit (AV1 specification, 5.3)."""
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
        at += size
        if at > len(data):
            raise NalError("it ends too early")
        yield head >> 3 & 0xF


UNIT_RULES: dict[str, Callable[[TrackKind, tuple[int, int]], UnitRules]] = {
    "h264": H264Rules,
    "hevc": lambda _kind, _size: HevcRules(),
    "av1": lambda _kind, _size: Av1Rules(),
}

"""The rules of FORMAT.md for access units, codec by codec."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol

from mvcodec.stream import TrackKind
from mvcodec.video import av1_syntax, hevc_syntax
from mvcodec.video.annexb import nal_units
from mvcodec.video.av1_syntax import Av1References
from mvcodec.video.bits import NalError
from mvcodec.video.h264_syntax import B_SLICE, AccessUnit, H264Parser, SequenceParameters
from mvcodec.video.hevc_syntax import HevcReferences

Broken = Iterator[tuple[str, str]]
"""(code, message) of each rule that is broken."""

PLAIN_PROFILES = frozenset({66, 77, 88, 100})
"""profile_idc up to High: 8 bits, 4:2:0, decoded everywhere."""

_PARTITIONS = frozenset({2, 3, 4})
_BT709 = 1
_SPS, _PPS = 7, 8
_EXPECTED_COLOUR = (_BT709, _BT709, _BT709)


class UnitRules(Protocol):
    """Checks the access units of one track in order.

    Attributes:
        keyframe: the last unit is one, as far as it could be parsed.
    """

    keyframe: bool

    def push(self, data: bytes, keyframe: bool | None) -> Broken:
        """What is wrong with an access unit.

        Args:
            keyframe: a header came with it; None: there are no headers, and any unit may be a keyframe.
        """
        ...


class H264Rules:
    """H.264: one picture a unit, no B slices, IDR with SPS and PPS where a keyframe is due, tags.

    Args:
        kind: what the track carries; None where no header says it: profile, colour and size are free.
        size: (width, height) as coded.
    """

    def __init__(self, kind: TrackKind | None, size: tuple[int, int]) -> None:
        self._kind, self._size = kind, size
        self.keyframe = False
        self._parser = H264Parser()
        self._next: int | None = None

    def push(self, data: bytes, keyframe: bool | None) -> Broken:
        """See `UnitRules`."""
        self.keyframe = False
        if not data.startswith((b"\x00\x00\x01", b"\x00\x00\x00\x01")):
            yield "annex-b", "no start code at its beginning"
        try:
            unit = self._parser.push(data)
        except NalError as error:
            yield "nal", f"a damaged NAL unit ({error})"
            return
        self.keyframe = unit.idr
        yield from self._structure(unit, unit.idr if keyframe is None else keyframe)
        for sequence in unit.sequence_sets if self._kind is not None else ():
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


class HevcRules:
    """HEVC: one picture a unit, IDR with VPS, SPS and PPS where a keyframe is due, references."""

    def __init__(self) -> None:
        self._references = HevcReferences()
        self.keyframe = False

    def push(self, data: bytes, keyframe: bool | None) -> Broken:
        """See `UnitRules`."""
        units = nal_units(data)
        kinds = {hevc_syntax.nal_kind(unit) for unit in units}
        pictures = sum(map(hevc_syntax.begins_picture, units))
        if pictures != 1:
            yield "one-picture", f"{pictures} pictures in one message"
        self.keyframe = idr = bool(kinds & hevc_syntax.IDR_KINDS)
        keyframe = idr if keyframe is None else keyframe
        if keyframe != idr:
            yield (
                "keyframe",
                "an IDR picture without a header" if idr else "no IDR picture though a header came",
            )
        if keyframe and not kinds >= {hevc_syntax.VPS, hevc_syntax.SPS, hevc_syntax.PPS}:
            yield "parameter-sets", "a keyframe without VPS, SPS and PPS"
        try:
            missing = self._references.push(data)
        except NalError as error:
            yield "nal", f"a damaged NAL unit ({error})"
            return
        if missing is not None:
            yield "missing-reference", missing


class Av1Rules:
    """AV1: one frame a unit, a key frame with a sequence header where one is due, order of frames."""

    def __init__(self) -> None:
        self._references = Av1References()
        self.keyframe = False

    def push(self, data: bytes, keyframe: bool | None) -> Broken:
        """See `UnitRules`."""
        self.keyframe = False
        try:
            kinds = [kind for kind, _ in av1_syntax.obus(data)]
            missing = self._references.push(data)
        except NalError as error:
            yield "obu", f"a damaged OBU ({error})"
            return
        self.keyframe = self._references.key_frame
        keyframe = self.keyframe if keyframe is None else keyframe
        frames = sum(kind in (av1_syntax.FRAME, av1_syntax.FRAME_HEADER) for kind in kinds)
        if frames != 1:
            yield "one-picture", f"{frames} frames in one message"
        if keyframe and av1_syntax.SEQUENCE_HEADER not in kinds:
            yield "parameter-sets", "a keyframe without sequence header"
        elif keyframe != self._references.key_frame:
            found = "no key frame though a header came" if keyframe else "a key frame without a header"
            yield "keyframe", found
        if missing is not None:
            yield "missing-reference", missing


UNIT_RULES: dict[str, Callable[[TrackKind | None, tuple[int, int]], UnitRules]] = {
    "h264": H264Rules,
    "hevc": lambda _kind, _size: HevcRules(),
    "av1": lambda _kind, _size: Av1Rules(),
}

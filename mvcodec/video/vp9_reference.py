"""VP9 whose references are a track's own past and pictures from outside: predictions of the one to be coded.

Every block chooses, by rate and distortion, between what was decoded before and what was predicted. Golden
and alternative reference are kept free for the predictions: they are put there before each picture and
never updated by one. A keyframe refers to no past: encoder and decoder begin anew, with one or two grey
frames that give the references rooms of their own, in front of the keyframe's own.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mvcodec.errors import MissingReference, SettingError, StreamError
from mvcodec.stream import Track, TrackKind
from mvcodec.video import libvpx
from mvcodec.video.access_unit import UnitFacts
from mvcodec.video.bits import NalError
from mvcodec.video.codec import Codec, Planes
from mvcodec.video.past import MOST_SHARE, Past, best_share
from mvcodec.video.vp9 import VP9
from mvcodec.video.vp9_syntax import parse_frame

MOST_REFERENCES = 2
MAX_QUANTIZER = 63
SPEEDS = (0, 8)
BLOCK = 8
_GREY = 128
_HEAD = struct.Struct("<IB")
_SIZE = struct.Struct("<H")
_SHARE = 16
_PLACES = (libvpx.GOLDEN, libvpx.ALTREF)
_NOT = (libvpx.NO_GOLDEN, libvpx.NO_ALTREF)
_KEEP = libvpx.KEEP_GOLDEN | libvpx.KEEP_ALTREF


@dataclass(frozen=True, slots=True)
class ReferenceSettings:
    """What the encoder of one track needs.

    Attributes:
        width, height: of the pictures, px; both even.
        quantizer: 0 (finest)..63.
        references: predictions for each picture, 1 or 2.
        speed: 0 (best)..8, libvpx's cpu-used.

    Raises:
        SettingError: a value is outside its range.
    """

    width: int
    height: int
    quantizer: int
    references: int = 1
    speed: int = 2

    def __post_init__(self) -> None:
        for name, low, high in (
            ("quantizer", 0, MAX_QUANTIZER),
            ("references", 1, MOST_REFERENCES),
            ("speed", *SPEEDS),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise SettingError(f"ReferenceSettings.{name}", value, f"{low}..{high}")


class ReferenceEncoder(Protocol):
    """Codes one track with predictions from outside. One picture in, its unit out, at once."""

    def push(self, planes: Planes, predictions: Sequence[Planes], keyframe: bool) -> bytes:
        """Code a picture, which may refer to the predictions, and to the last one if it is no keyframe."""
        ...


class ReferenceDecoder(Protocol):
    """Decodes one track with the same predictions."""

    def push(self, data: bytes, predictions: Sequence[Planes], keyframe: bool, label: str) -> Planes:
        """Decode a unit: the encoder's picture, bit by bit.

        Args:
            label: what to call the unit in an error.

        Raises:
            MissingReference: its last picture or its predictions are not those of the encoder.
            StreamError: it is damaged, or not of the form that the encoder writes.
        """
        ...


class Vp9ReferenceEncoder:
    """See `ReferenceEncoder`. It decodes what it codes: the next prediction may have a share of that."""

    @property
    def decoded(self) -> Planes:
        """The last picture as a decoder has it."""
        assert self._mirror.past is not None
        return self._mirror.past

    def __init__(self, settings: ReferenceSettings) -> None:
        self._settings = settings
        self._encoder: libvpx.Vp9Encoder | None = None
        self._mirror = Vp9ReferenceDecoder((settings.width, settings.height))

    def push(self, planes: Planes, predictions: Sequence[Planes], keyframe: bool) -> bytes:
        """See `ReferenceEncoder`."""
        assert len(predictions) == self._settings.references
        start: list[bytes] = []
        if keyframe or self._encoder is None:
            self._encoder, start = self._started()
        share = 0
        if not start:
            assert self._mirror.past is not None
            share, first = best_share(predictions[0], self._mirror.past, planes)
            predictions = [first, *predictions[1:]]
        for place, prediction in zip(_PLACES, predictions, strict=False):
            self._encoder.set_reference(place, _joined(prediction))
        flags = _KEEP | sum(_NOT[len(predictions) :]) | (libvpx.NO_LAST if start else 0)
        frame = self._encoder.encode(_joined(planes), flags)
        unit = ReferenceUnit(checksum(predictions), tuple(start), frame, share)
        self._mirror.decode(unit, predictions)
        return unit.to_bytes()

    def _started(self) -> tuple[libvpx.Vp9Encoder, list[bytes]]:
        """A new encoder, and the frames that give its references rooms of their own."""
        settings = self._settings
        width, height = frame_size((settings.width, settings.height))
        encoder = libvpx.Vp9Encoder(width, height, settings.quantizer, settings.speed)
        grey = np.full(width * height * 3 // 2, _GREY, np.uint8)
        start = [encoder.encode(grey, libvpx.FORCE_KEY)]
        if settings.references > 1:
            start.append(encoder.encode(grey, libvpx.KEEP_LAST | libvpx.KEEP_ALTREF))
        return encoder, start


class Vp9ReferenceDecoder:
    """See `ReferenceDecoder`.

    Args:
        size: (width, height) of the pictures as coded, px.

    Attributes:
        past: the last picture.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self.past: Planes | None = None
        self._decoder: libvpx.Vp9Decoder | None = None

    def push(self, data: bytes, predictions: Sequence[Planes], keyframe: bool, label: str) -> Planes:
        """See `ReferenceDecoder`."""
        try:
            unit = ReferenceUnit.parse(data)
            if bool(unit.start) != keyframe:
                raise NalError(f"{len(unit.start)} frames in front of {'a' if keyframe else 'no'} keyframe")
            if keyframe and len(unit.start) != len(predictions):
                raise NalError(
                    f"{len(unit.start)} frames in front of a keyframe of {len(predictions)} predictions"
                )
            if not keyframe and self._decoder is None:
                raise MissingReference(label, "a picture that builds on one that is missing", "a keyframe")
            if unit.share and self.past is not None:
                predictions = [Past(predictions[0], self.past).blended(unit.share), *predictions[1:]]
            if unit.checksum != checksum(predictions):
                found = "a prediction that is not the encoder's"
                raise MissingReference(label, found, f"checksum {unit.checksum:08x}")
            return self.decode(unit, predictions)
        except (libvpx.LibvpxError, NalError) as error:
            raise StreamError(label, f"a damaged picture ({error})", "a VP9 frame") from None

    def decode(self, unit: ReferenceUnit, predictions: Sequence[Planes]) -> Planes:
        """Decode a unit that is known to fit, with predictions that have the past's share in them."""
        # Should something fail below, only a keyframe can follow.
        decoder, self._decoder = self._decoder, None
        if unit.start:
            decoder = libvpx.Vp9Decoder(*frame_size(self._size))
            for number, grey in enumerate(unit.start):
                _check(grey, frame_size(self._size) if number == 0 else None)
                decoder.decode(grey)
        assert decoder is not None
        _check(unit.frame, None)
        for place, prediction in zip(_PLACES, predictions, strict=False):
            decoder.set_reference(place, _joined(prediction))
        found = _cropped(decoder.decode(unit.frame), self._size)
        self._decoder, self.past = decoder, found
        return found


def _check(data: bytes, size: tuple[int, int] | None) -> None:
    """Refuse unseen what would take memory, or is another frame than the encoder writes.

    Args:
        size: of the key frame that it must be; None: it must be an inter frame of its reference's size.

    Raises:
        NalError: it is not.
    """
    frame = parse_frame(data)
    if frame.again or not frame.shown or frame.key != (size is not None):
        raise NalError("a frame of another kind")
    if frame.size != size:
        raise NalError("a picture of another size")
    if frame.sequence is not None and frame.sequence.unlike is not None:
        raise NalError(f"a frame of {frame.sequence.unlike}")


def frame_size(size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of the VP9 frames for pictures of a size: the next multiples of BLOCK.

    libvpx takes no reference from outside whose sides are none.
    """
    width, height = size
    return -(-width // BLOCK) * BLOCK, -(-height // BLOCK) * BLOCK


def _joined(planes: Planes) -> libvpx.Bytes:
    """I420 in one piece, of `frame_size`: the last column and row are repeated."""
    height, width = planes.y.shape
    right, below = (to - of for to, of in zip(frame_size((width, height)), (width, height), strict=True))
    parts = [planes.y, planes.u, planes.v]
    if right or below:
        margins = [((0, below // part), (0, right // part)) for part in (1, 2, 2)]
        parts = [np.pad(plane, margin, mode="edge") for plane, margin in zip(parts, margins, strict=True)]
    return np.concatenate([plane.ravel() for plane in parts])


def _cropped(planes: tuple[libvpx.Bytes, libvpx.Bytes, libvpx.Bytes], size: tuple[int, int]) -> Planes:
    width, height = size
    y, u, v = planes
    half = slice(height // 2), slice(width // 2)
    return Planes(*(np.ascontiguousarray(part) for part in (y[:height, :width], u[half], v[half])))


def checksum(predictions: Sequence[Planes]) -> int:
    """CRC-32 of predictions: rows of Y, Cb and Cr, one picture after the other."""
    value = 0
    for planes in predictions:
        for plane in (planes.y, planes.u, planes.v):
            value = zlib.crc32(np.ascontiguousarray(plane).data, value)
    return value


@dataclass(frozen=True, slots=True)
class ReferenceUnit:
    """One message of a predicted track.

    Attributes:
        checksum: CRC-32 of its predictions.
        start: the grey frames in front of a keyframe; nothing else has any.
        frame: the picture's own.
        share: of the past in its first prediction, 0 (none)..MOST_SHARE; a keyframe has none.
    """

    checksum: int
    start: tuple[bytes, ...]
    frame: bytes
    share: int = 0

    def to_bytes(self) -> bytes:
        """As FORMAT.md has it."""
        start = b"".join(_SIZE.pack(len(each)) + each for each in self.start)
        return _HEAD.pack(self.checksum, len(self.start) + _SHARE * self.share) + start + self.frame

    @classmethod
    def parse(cls, data: bytes) -> ReferenceUnit:
        """Parse what `to_bytes` wrote.

        Raises:
            NalError: it is not that.
        """
        if len(data) < _HEAD.size:
            raise NalError("it ends too early")
        value, both = _HEAD.unpack_from(data)
        share, count = divmod(both, _SHARE)
        if count > MOST_REFERENCES:
            raise NalError(f"{count} frames in front of its own")
        if share > (0 if count else MOST_SHARE):
            raise NalError(f"share {share} of the past")
        start, at = [], _HEAD.size
        for _ in range(count):
            size = int.from_bytes(data[at : at + _SIZE.size], "little")
            at += _SIZE.size
            start.append(data[at : at + size])
            at += size
        if at >= len(data) or not all(start):
            raise NalError("it ends too early")
        return cls(value, tuple(start), data[at:], share)


class ReferenceUnits:
    """Reads the messages of a predicted track, for who does not decode them; see `UnitReader`."""

    def __init__(self) -> None:
        self._started = False

    def push(self, data: bytes) -> UnitFacts:
        """See `UnitReader`."""
        unit = ReferenceUnit.parse(data)
        found = [parse_frame(piece) for piece in (*unit.start, unit.frame)]
        self._started |= bool(unit.start)
        return UnitFacts(
            keyframe=bool(unit.start),
            pictures=1,
            parameters=bool(unit.start),
            sizes=tuple(frame.size for frame in found if frame.size is not None),
            sequences=tuple(frame.sequence for frame in found if frame.sequence is not None),
            broken=() if all(frame.shown for frame in found) else (("hidden", "a frame that is not shown"),),
            missing=None if self._started else "a picture before the first keyframe",
        )


PREDICTED = replace(
    VP9,
    title="VP9 with predictions from outside",
    units=ReferenceUnits,
    words=replace(VP9.words, unit="a unit of predicted VP9", parameters="the frames in front of it"),
)
"""What validating and recovering must know of predicted tracks; it is none of the table of codecs."""


def unit_codec(track: Track, codec: Codec) -> Codec:
    """What reads the units of a track; `codec` is the header's."""
    return PREDICTED if track.kind in (TrackKind.PREDICTED, TrackKind.ENHANCED) else codec

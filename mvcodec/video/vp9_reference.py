"""VP9 whose references are a track's own past and pictures from outside: predictions of the one to be coded.

Every block chooses, by rate and distortion, between what was decoded before and what was predicted. Golden
and alternative reference are kept free for the predictions: they are put there before each picture and
never updated by one. A keyframe refers to no past: encoder and decoder begin anew, with one or two grey
frames that give the references rooms of their own, in front of the keyframe's own.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mvcodec.errors import SettingError, StreamError
from mvcodec.video import libvpx
from mvcodec.video.bits import NalError
from mvcodec.video.codec import Planes
from mvcodec.video.vp9_syntax import parse_frame

MOST_REFERENCES = 2
MAX_QUANTIZER = 63
SPEEDS = (0, 8)
_GREY = 128
_START_QUANTIZER = 63
_SIZE = struct.Struct("<H")
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
            StreamError: it is damaged, or not of the form that the encoder writes.
        """
        ...


class Vp9ReferenceEncoder:
    """See `ReferenceEncoder`."""

    def __init__(self, settings: ReferenceSettings) -> None:
        self._settings = settings
        self._encoder: libvpx.Vp9Encoder | None = None

    def push(self, planes: Planes, predictions: Sequence[Planes], keyframe: bool) -> bytes:
        """See `ReferenceEncoder`."""
        assert len(predictions) == self._settings.references
        start: list[bytes] = []
        if keyframe or self._encoder is None:
            self._encoder, start = self._started()
        for place, prediction in zip(_PLACES, predictions, strict=False):
            self._encoder.set_reference(place, _joined(prediction))
        flags = _KEEP | sum(_NOT[len(predictions) :]) | (libvpx.NO_LAST if start else 0)
        frame = self._encoder.encode(_joined(planes), flags)
        return _packed(start, frame)

    def _started(self) -> tuple[libvpx.Vp9Encoder, list[bytes]]:
        """A new encoder, and the frames that give its references rooms of their own."""
        settings = self._settings
        width, height = settings.width, settings.height
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
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._decoder: libvpx.Vp9Decoder | None = None

    def push(self, data: bytes, predictions: Sequence[Planes], keyframe: bool, label: str) -> Planes:
        """See `ReferenceDecoder`."""
        start, frame = _unpacked(data, label)
        if bool(start) != keyframe:
            found = f"{len(start)} frames in front of {'a' if keyframe else 'no'} keyframe"
            raise StreamError(label, found, "some in front of a keyframe, and of nothing else")
        try:
            if start:
                self._decoder = libvpx.Vp9Decoder(*self._size)
                for number, grey in enumerate(start):
                    _check(grey, self._size if number == 0 else None)
                    self._decoder.decode(grey)
            if self._decoder is None:
                raise StreamError(label, "a picture that builds on one that is missing", "a keyframe")
            _check(frame, None)
            for place, prediction in zip(_PLACES, predictions, strict=False):
                self._decoder.set_reference(place, _joined(prediction))
            return Planes(*self._decoder.decode(frame))
        except (libvpx.LibvpxError, NalError) as error:
            self._decoder = None
            raise StreamError(label, f"a damaged picture ({error})", "a VP9 frame") from None


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


def _joined(planes: Planes) -> libvpx.Bytes:
    return np.concatenate([plane.ravel() for plane in (planes.y, planes.u, planes.v)])


def _packed(start: Sequence[bytes], frame: bytes) -> bytes:
    """One unit: how many frames are in front, each with its size, then the frame."""
    return bytes([len(start)]) + b"".join(_SIZE.pack(len(each)) + each for each in start) + frame


def _unpacked(data: bytes, label: str) -> tuple[list[bytes], bytes]:
    start: list[bytes] = []
    at = 1
    count = data[0] if data else 0
    if data and count <= MOST_REFERENCES:
        for _ in range(count):
            if at + _SIZE.size > len(data):
                break
            (size,) = _SIZE.unpack_from(data, at)
            at += _SIZE.size
            start.append(data[at : at + size])
            at += size
    if not data or count > MOST_REFERENCES or len(start) != count or at >= len(data):
        raise StreamError(label, "a unit whose parts are not as long as it says", "frames with their sizes")
    return start, data[at:]

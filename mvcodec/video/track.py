"""One track on its way back to pictures, with all checks that a stream from outside needs."""

from __future__ import annotations

from collections.abc import Callable

from mvcodec.errors import MissingReference, StreamError
from mvcodec.stream import Packet
from mvcodec.video.codec import Codec, Planes
from mvcodec.video.reference_watch import ReferenceWatch
from mvcodec.video.vp9_reference import PREDICTED, Vp9ReferenceDecoder, frame_size


class TrackDecoder:
    """Decodes one track: one access unit in, its picture out, or an error that says why not.

    Args:
        codec: of the track.
        size: (width, height) of its pictures as coded.

    Attributes:
        lost: its next picture builds on one that never came or was damaged; a keyframe heals that.
    """

    def __init__(self, codec: Codec, size: tuple[int, int]) -> None:
        self._codec, self._size = codec, size
        self._decoder = codec.decoder()
        self._watch = ReferenceWatch(codec, size)
        self.lost = False

    def push(self, data: bytes, keyframe: bool, label: str, index: int | None = None) -> Planes:
        """Decode an access unit.

        Args:
            keyframe: it stands on its own.
            label: what to call it in an error.
            index: number of its frame set.

        Raises:
            MissingReference: it builds on a picture that is not there.
            StreamError: it is damaged, or of another size.
        """
        if keyframe and self.lost:
            self._decoder = self._codec.decoder()
            self.lost = False
        if self.lost:
            raise MissingReference(label, "a picture that builds on one that is missing", "a keyframe")
        try:
            return self._decode(data, label, index)
        except StreamError:
            self.lost = True
            raise

    def _decode(self, data: bytes, label: str, index: int | None) -> Planes:
        self._watch.push(data, label, index)
        found = self._decoder.push(data, label)
        if len(found) != 1:
            raise StreamError(label, f"{len(found)} pictures in an access unit", "one")
        width, height = found[0].size
        if (width, height) != self._size:
            raise StreamError(label, f"a picture of {width}x{height}", f"{self._size[0]}x{self._size[1]}")
        return found[0]


class PredictedTrackDecoder:
    """Decodes one track of pictures that are predicted from outside.

    Args:
        size: (width, height) of its pictures, both even.

    Attributes:
        lost: as `TrackDecoder`'s.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._decoder = Vp9ReferenceDecoder(size)
        self._watch = ReferenceWatch(PREDICTED, frame_size(size))
        self.lost = False

    def push(self, packet: Packet, label: str, predictions: Callable[[], list[Planes]] | None) -> Planes:
        """Decode a unit.

        Args:
            label: what to call it in an error.
            predictions: makes its predictions; None where what they need is missing.

        Raises:
            MissingReference: a picture that it builds on is not there, or not the encoder's.
            StreamError: it is damaged, or of another size.
        """
        if packet.keyframe and self.lost:
            self._decoder, self._watch = (
                Vp9ReferenceDecoder(self._size),
                ReferenceWatch(PREDICTED, frame_size(self._size)),
            )
        self.lost = self.lost and not packet.keyframe
        if self.lost or predictions is None:
            self.lost = True
            raise MissingReference(label, "a picture that builds on one that is missing", "a keyframe")
        try:
            self._watch.push(packet.data, label, packet.index)
            return self._decoder.push(packet.data, predictions(), packet.keyframe, label)
        except StreamError:
            self.lost = True
            raise

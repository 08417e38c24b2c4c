"""Codes real cameras from each other: which from which, and the pictures themselves."""

from __future__ import annotations

from collections.abc import Mapping

from mvcodec.array import CameraArray, Position
from mvcodec.stream import PredictedCamera, StreamHeader, Track
from mvcodec.synthesis.frame_prediction import FramePrediction
from mvcodec.video.codec import PRESETS, Codec, CodedPicture, Planes
from mvcodec.video.colour import even_size
from mvcodec.video.vp9_reference import (
    MAX_QUANTIZER,
    ReferenceSettings,
    Vp9ReferenceEncoder,
)
from mvcodec.workers import run_all

SPEEDS = dict(zip(PRESETS, (8, 7, 6, 5, 4, 3, 1, 1, 0, 0), strict=True))
"""libvpx's cpu-used for the efforts that x264 has names for."""

CAMERA_LINE = (1.8, -18.0)
"""(slope, offset): ``slope * qp + offset`` is the quantizer of predicted cameras beside libx264's QP for the
others. Where pictures are fine it is coarser than `LAYER_LINE`: bits are better spent in the first camera,
which all others are predicted from (docs/measurements.md)."""

LAYER_LINE = (2.0, -25.0)
"""The same for views of an enhancement layer and its QP."""


def prediction_order(array: CameraArray) -> tuple[PredictedCamera, ...]:
    """Every real camera but the first, row by row, each from those around it that come before it.

    Where one above and one beside it are there, those at the diagonal are left out: they are farther away.
    """
    rows, cols = array.real_rows, array.real_cols
    found = []
    for down, row in enumerate(rows):
        for across, col in enumerate(cols):
            around = [(down - 1, across), (down, across - 1)]
            if down == 0 or across == 0:
                around.append((down - 1, across + 1))
            references = tuple(
                (rows[y], cols[x]) for y, x in around if 0 <= y < len(rows) and 0 <= x < len(cols)
            )
            if references:
                found.append(PredictedCamera((row, col), references))
    return tuple(found)


def predicted_quantizer(quality: float, codec: Codec, line: tuple[float, float]) -> float:
    """The quantizer, 1..63, not rounded, of predicted pictures for a QP or CRF on the codec's own scale.

    Args:
        line: CAMERA_LINE or LAYER_LINE.
    """
    slope, offset = codec.qp_line
    of_x264 = (quality - offset) / slope
    return min(max(line[0] * of_x264 + line[1], 1.0), float(MAX_QUANTIZER))


def reference_count(second_reference: str) -> int:
    """How many predictions each picture has; `second_reference` is one of REFERENCE_CODECS."""
    return 1 if second_reference == "none" else 2


class PredictedCameras:
    """Codes the predicted cameras of a stream. What they are predicted from is decoded here, as decoders do.

    Args:
        header: the stream's.
        codec: of the tracks that play alone.
        quantizer: 0..63, of predicted pictures.
        preset: effort, one of PRESETS.

    Raises:
        LibvpxMissing: there is no libvpx.
    """

    def __init__(self, header: StreamHeader, codec: Codec, quantizer: int, preset: str) -> None:
        size = even_size(header.array.width, header.array.height)
        references = reference_count(header.second_reference)
        settings = ReferenceSettings(*size, quantizer, references, SPEEDS[preset])
        tracks = [header.picture_track(each.camera) for each in header.predicted]
        self._header = header
        self._needed = {track for each in header.predicted for track in header.needed_tracks(each)}
        self._decoders = {track: codec.decoder() for track in self._needed - set(tracks)}
        self._encoders = {track: Vp9ReferenceEncoder(settings) for track in tracks}

    def push(
        self, coded: Mapping[Track, CodedPicture], pictures: Mapping[Position, Planes], keyframe: bool
    ) -> dict[Track, CodedPicture]:
        """Code the predicted cameras of one frame set.

        Args:
            coded: the frame set's pictures and maps that play alone.
            pictures: what the predicted cameras saw.
        """
        tracks = list(self._decoders)
        planes = run_all(self._decode, tracks, [coded[track] for track in tracks])
        frame = FramePrediction(self._header, dict(zip(tracks, planes, strict=True)))
        found: dict[Track, CodedPicture] = {}
        for each in self._header.predicted:
            track = self._header.picture_track(each.camera)
            second = self._header.second_reference
            predictions = frame.predict(each.camera, each.references, second)
            data = self._encoders[track].push(pictures[each.camera], predictions, keyframe)
            found[track] = CodedPicture(data, keyframe)
            if track in self._needed:
                frame.add(each.camera, self._encoders[track].decoded)
        return found

    def _decode(self, track: Track, coded: CodedPicture) -> Planes:
        (planes,) = self._decoders[track].push(coded.data, track.topic)
        return planes

"""What of one frame set is decoded, and the predictions that are made from it: the same for both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvcodec.array import Position
from mvcodec.stream import StreamHeader, Track, TrackKind
from mvcodec.synthesis.prediction import (
    IntMap,
    PredictionSource,
    full_map,
    predict,
    predicted_disparity,
)
from mvcodec.video.codec import Planes


class FramePrediction:
    """Predicts pictures of one frame set.

    Args:
        header: the stream's.
        planes: of the tracks that are decoded by now, as decoded: maps, and the pictures along whose edges
            maps of half size are enlarged. The maps of other cameras are enlarged without.
    """

    def __init__(self, header: StreamHeader, planes: Mapping[Track, Planes]) -> None:
        self._header = header
        self._codes = {
            track.camera: found.y for track, found in planes.items() if track.kind is TrackKind.DISPARITY
        }
        self._planes: dict[Position, Planes] = {
            track.camera: found
            for track, found in planes.items()
            if track.kind is not TrackKind.DISPARITY and track.camera is not None
        }
        self._edges = dict(self._planes)
        self._maps: dict[Position, IntMap] = {}
        self._sources: dict[Position, PredictionSource] = {}

    def add(self, place: Position, planes: Planes) -> None:
        """A picture that was decoded after others."""
        self._planes[place] = planes

    def predict(
        self, place: Position, references: Sequence[Position], second_reference: str = "none"
    ) -> list[Planes]:
        """What the picture of a place may build on, from references, which are decoded, as are their maps.

        Args:
            second_reference: one of REFERENCE_CODECS.
        """
        sources = [self._source(other) for other in references]
        found = [predict(self._header.array, sources, place, self.disparity(place))]
        if second_reference == "nearest":
            found.append(self._planes[_nearest(place, references)])
        return found

    def _source(self, place: Position) -> PredictionSource:
        if place not in self._sources:
            self._sources[place] = PredictionSource(place, self._planes[place], self.disparity(place))
        return self._sources[place]

    def disparity(self, place: Position) -> IntMap:
        """The map of a place, 64ths of a pixel: its own, or made from those around it."""
        if place not in self._maps:
            header = self._header
            around, span = header.maps_around(place), header.disparity_range_px
            if around == (place,):
                some = next(iter(self._planes.values())).y
                luma = self._edges[place].y if place in self._edges else np.zeros_like(some)
                self._maps[place] = full_map(self._codes[place], luma, span, header.disparity_scale)
            else:
                maps = {camera: self.disparity(camera) for camera in around}
                self._maps[place] = predicted_disparity(header.array, maps, place, span)
        return self._maps[place]


def _nearest(place: Position, references: Sequence[Position]) -> Position:
    """The reference that is the fewest steps away, by their squares; the first one of those."""
    return min(references, key=lambda other: (other[0] - place[0]) ** 2 + (other[1] - place[1]) ** 2)

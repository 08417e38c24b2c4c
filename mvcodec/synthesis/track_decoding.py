"""Every track of a stream back to planes, strictly: what encoders mirror, and what files are held against."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from mvcodec.enhancement import EnhancementHeader
from mvcodec.stream import Packet, StreamHeader, Track, TrackKind
from mvcodec.synthesis.frame_prediction import FramePrediction
from mvcodec.video.codec import Planes
from mvcodec.video.codecs import find_codec
from mvcodec.video.map_size import track_sizes
from mvcodec.video.track import PredictedTrackDecoder
from mvcodec.workers import run_all


class StreamTracks:
    """Decodes the frame sets of a stream in order, none left out.

    Args:
        header: the stream's.
        layer: its enhancement layer's, to decode that too.
    """

    def __init__(self, header: StreamHeader, layer: EnhancementHeader | None = None) -> None:
        codec = find_codec(header.codec)
        sizes = track_sizes(header.array.width, header.array.height, header.disparity_scale)
        self._header = header
        self._predicted = {header.picture_track(each.camera): each for each in header.predicted}
        self._alone = {track: codec.decoder() for track in header.tracks if track not in self._predicted}
        self._views = {} if layer is None else {each.track: each for each in layer.views}
        self._layer_second = "none" if layer is None else layer.second_reference
        size = sizes[TrackKind.TEXTURE]
        self._others = {track: PredictedTrackDecoder(size) for track in (*self._predicted, *self._views)}

    def decode(self, packets: Iterable[Packet]) -> dict[Track, Planes]:
        """The planes of one frame set, in the order of the tracks, then those of the layer's views."""
        by_track = {packet.track: packet for packet in packets}
        found = dict(zip(self._alone, run_all(self._decode, [by_track[t] for t in self._alone]), strict=True))
        frame = FramePrediction(self._header, found)
        for track, each in self._predicted.items():
            make = partial(frame.predict, each.camera, each.references, self._header.second_reference)
            found[track] = self._others[track].push(by_track[track], track.topic, make)
            frame.add(each.camera, found[track])
        frame = FramePrediction(self._header, found)
        for track, view in self._views.items():
            make = partial(frame.predict, view.view, view.references, self._layer_second)
            found[track] = self._others[track].push(by_track[track], track.topic, make)
            frame.add(view.view, found[track])
        return {track: found[track] for track in (*self._header.tracks, *self._views)}

    def _decode(self, packet: Packet) -> Planes:
        (planes,) = self._alone[packet.track].push(packet.data, packet.track.topic)
        return planes

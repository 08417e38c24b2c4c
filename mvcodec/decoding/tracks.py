"""The tracks of a stream, each with its decoder: packets of a frame set in, planes out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from mvcodec.array import Position
from mvcodec.container.assembly import PacketSet
from mvcodec.errors import MissingReference, SettingError, StreamError
from mvcodec.stream import Packet, StreamHeader, Track, TrackKind
from mvcodec.synthesis.frame_prediction import FramePrediction
from mvcodec.video.codec import Planes
from mvcodec.video.codecs import find_codec
from mvcodec.video.map_size import track_sizes
from mvcodec.video.track import PredictedTrackDecoder, TrackDecoder
from mvcodec.workers import Job, settle, submit


class Tracks:
    """Fresh decoders of all tracks that a header names; without one, of none.

    Args:
        name: what messages call the stream.

    Raises:
        StreamError: the header names no codec that is known here.
    """

    def __init__(self, header: StreamHeader | None = None, name: str = "stream") -> None:
        self._header = header
        self._decoders: dict[Track, TrackDecoder] = {}
        self._predicted: dict[Track, PredictedTrackDecoder] = {}
        if header is None:
            return
        try:
            codec = find_codec(header.codec)
        except SettingError as error:
            raise StreamError(name, f"codec {error.found}", error.expected) from None
        sizes = track_sizes(header.array.width, header.array.height, header.disparity_scale)
        for track in header.tracks:
            if track.kind is TrackKind.PREDICTED:
                self._predicted[track] = PredictedTrackDecoder(sizes[TrackKind.TEXTURE])
            else:
                self._decoders[track] = TrackDecoder(codec, sizes[track.kind])

    def __contains__(self, track: object) -> bool:
        return track in self._decoders or track in self._predicted

    def begin(
        self,
        packets: PacketSet,
        label: Callable[[Packet], str],
        before: Mapping[Track, Job[Planes | None]],
    ) -> dict[Track, Job[Planes | None]]:
        """Begin to decode every track of a frame set, side by side.

        Args:
            label: what to call a packet in an error.
            before: what was begun and not finished of the frame set before.

        Returns:
            By track, what will have its planes; None where its packet is missing.
        """
        jobs = {
            track: submit(_decode_after, before.get(track), self._decoders[track], packet, label(packet))
            for track, packet in packets.packets.items()
            if track in self._decoders
        }
        for track in packets.missing:
            if track in self._decoders:
                jobs[track] = submit(_lose_after, before.get(track), self._decoders[track])
            else:
                self._predicted[track].lost = True
        return jobs

    def finish(
        self,
        packets: PacketSet,
        jobs: Mapping[Track, Job[Planes | None]],
        label: Callable[[Packet], str],
    ) -> tuple[dict[Track, Planes], dict[Position, StreamError]]:
        """Decode what is left of a frame set that was begun.

        Args:
            jobs: what `begin` gave.
            label: what to call a packet in an error.

        Returns:
            Planes of each track that is there; and of each camera that something is missing of, what.

        Raises:
            StreamError: damage.
        """
        settle(jobs.values())
        planes: dict[Track, Planes] = {}
        reasons: dict[Position, StreamError] = {}
        for track in packets.missing:
            name = label(replace(packets.first, track=track))
            _note(reasons, track, StreamError(name, "no packet", "one for each track of a frame set"))
        for track, job in jobs.items():
            try:
                found = job.result()
            except MissingReference as error:
                _note(reasons, track, error)
            else:
                if found is not None:
                    planes[track] = found
        if self._predicted and self._header is not None:
            self._predict(self._header, packets, label, planes, reasons)
        return planes, reasons

    def _predict(
        self,
        header: StreamHeader,
        packets: PacketSet,
        label: Callable[[Packet], str],
        planes: dict[Track, Planes],
        reasons: dict[Position, StreamError],
    ) -> None:
        """Decode the cameras that are predicted from others, one after the other."""
        frame = FramePrediction(header, planes)
        for each in header.predicted:
            track = header.picture_track(each.camera)
            packet = packets.packets.get(track)
            if packet is None:
                continue
            whole = header.needed_tracks(each) <= planes.keys()
            second = header.second_reference
            make = partial(frame.predict, each.camera, each.references, second) if whole else None
            try:
                found = self._predicted[track].push(packet, label(packet), make)
            except MissingReference as error:
                _note(reasons, track, error)
            else:
                planes[track] = found
                frame.add(each.camera, found)


def _decode_after(
    before: Job[Planes | None] | None, decoder: TrackDecoder, packet: Packet, label: str
) -> Planes | None:
    if before is not None:
        settle([before])
    return decoder.push(packet.data, packet.keyframe, label, packet.index)


def _lose_after(before: Job[Planes | None] | None, decoder: TrackDecoder) -> None:
    if before is not None:
        settle([before])
    decoder.lost = True


def _note(reasons: dict[Position, StreamError], track: Track, error: StreamError) -> None:
    assert track.camera is not None
    reasons.setdefault(track.camera, error)

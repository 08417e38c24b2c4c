"""What can be read of a damaged or unfinished file -> a clean one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO, Literal, get_args

from mvcodec.conformance.usable_tracks import UsableLayer, UsableTracks
from mvcodec.container import McapReader, McapWriter
from mvcodec.container.assembly import Assembler, PacketSet
from mvcodec.container.declared import DROPPED_KEY
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.decoding.estimated_maps import can_be_estimated
from mvcodec.enhancement import LAYER_TRACK
from mvcodec.errors import SettingError, StreamError
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track, TrackKind

Incomplete = Literal["keep", "drop"]

Tell = Callable[[StreamError], None]

_HELD_DEPTHS = 2
"""Frame sets whose depth may wait: the one at hand and the next."""


@dataclass(frozen=True, slots=True)
class Recovered:
    """What `recover` did.

    Attributes:
        frames: frame sets in the new file.
        incomplete: how many of them lack a camera's picture or map, a depth image, or a view of the
            enhancement layer.
        dropped: frame sets that were read but left out.
    """

    frames: int
    incomplete: int
    dropped: int


def recover(
    source: str | Path | BinaryIO,
    target: BinaryIO | Path,
    tell: Tell,
    limits: Limits = DEFAULT_LIMITS,
    incomplete: Incomplete = "keep",
) -> Recovered:
    """Copy every frame set that can be decoded, its depth too; the video is copied, not coded again.

    Pictures that build on missing ones are left out, up to their camera's next keyframe.

    Args:
        tell: takes each damage found.
        incomplete: of frame sets in which a picture or map is missing, ``keep`` the other cameras, as
            the decoder does; or ``drop`` them, and all up to the next keyframe that is complete.

    Raises:
        InputError: the source cannot be opened.
        StreamError: there is nothing in it that can be decoded, or its codec is unknown.
        OutputError: the system refuses to write.
    """
    if incomplete not in get_args(Incomplete):
        raise SettingError("incomplete", incomplete, " or ".join(get_args(Incomplete)))
    with (
        McapReader.open(source, limits, tell, depth=True, layer=True) as reader,
        McapWriter(target) as writer,
    ):
        assembler = Assembler(reader.name, tell)
        assembler.start(reader.header.tracks)
        tracks = UsableTracks(reader.header, reader.name)
        copier = _Copier(reader.header, writer, tracks, assembler.label, tell, keep=incomplete == "keep")
        for _, packet in reader.packets():
            if packet.track.kind is TrackKind.DEPTH:
                copier.add_depth(packet)
            elif packet.track.kind in (TrackKind.LAYER, TrackKind.ENHANCED):
                copier.add_layer(packet)
            else:
                copier.push(assembler.push(packet))
        if not reader.cut_off:
            copier.push(assembler.flush())
        copier.flush()
        if not writer.frame_count:
            kind = "frame set" if incomplete == "keep" else "complete frame set"
            raise StreamError(reader.name, f"no {kind} that can be decoded", "one at least")
        if reader.dropped is not None:
            writer.note({DROPPED_KEY: str(reader.dropped)})
    return Recovered(writer.frame_count, copier.incomplete, copier.dropped)


class _Copier:
    """Writes the frame sets that a decoder can decode. All headers of the new file say the same.

    A frame set is written when the next one comes, since its depth stands behind its video.
    """

    def __init__(
        self,
        header: StreamHeader,
        writer: McapWriter,
        tracks: UsableTracks,
        label: Callable[[Packet], str],
        tell: Tell,
        *,
        keep: bool,
    ) -> None:
        self._header, self._writer, self._tracks = header, writer, tracks
        self._label, self._tell, self._keep = label, tell, keep
        self._last: Packet | None = None
        self._held: list[Packet] = []
        self._depth: dict[int, dict[Track, Packet]] = {}
        self._depth_tracks: set[Track] = set()
        self._layer: dict[int, dict[Track, Packet]] = {}
        self._usable_layer = UsableLayer(header, tracks, label, tell)
        self._absent: set[Track] = set()
        self._waits = True
        self.incomplete = self.dropped = 0

    def push(self, sets: list[PacketSet]) -> None:
        """Take what came of frame sets."""
        for found in sets:
            self._push(found)

    def add_depth(self, packet: Packet) -> None:
        """Take a depth image, which goes with its frame set's pictures."""
        if self._last is None or packet.index >= self._last.index:
            self._depth.setdefault(packet.index, {}).setdefault(packet.track, packet)
            if len(self._depth) > _HELD_DEPTHS:
                del self._depth[min(self._depth)]

    def add_layer(self, packet: Packet) -> None:
        """Take a packet of the enhancement layer, which goes with its frame set's pictures."""
        if self._last is None or packet.index >= self._last.index:
            self._layer.setdefault(packet.index, {}).setdefault(packet.track, packet)
            if len(self._layer) > _HELD_DEPTHS:
                del self._layer[min(self._layer)]

    def flush(self) -> None:
        """Write the frame set that waits for its depth."""
        if not self._held:
            return
        first = self._held[0]
        depth = self._depth.pop(first.index, {})
        self._depth_tracks |= depth.keys()
        tracks = set(self._header.tracks) | self._depth_tracks
        base = {packet.track: packet for packet in self._held}
        there = base.keys() | depth.keys()
        self._tell_absent(tracks - there, first)
        video = {track: packet for track, packet in base.items() if track != HEADER_TRACK}
        layer = self._usable_layer.usable(video, self._layer.pop(first.index, {}))
        self.incomplete += not (tracks <= there and self._usable_layer.complete(layer))
        head = [packet for packet in layer if packet.track == LAYER_TRACK]
        depths = sorted(depth.values(), key=lambda packet: packet.track.topic)
        start, rest = self._held[: len(head)], self._held[len(head) :]
        self._writer.push([*start, *head, *rest, *layer[len(head) :], *depths])
        self._held = []

    def _push(self, found: PacketSet) -> None:
        self.flush()
        first = found.first
        if self._last is not None and first.time_ns <= self._last.time_ns:
            self._tracks.lose(self._header.tracks)
            self._drop()
            return
        usable = self._usable(found)
        complete = len(usable) == len(self._header.tracks)
        if not (complete or self._keep):
            self._tell_absent(set(self._header.tracks) - usable.keys(), first)
            self._drop()
            return
        if found.header is not None and self._can_be_shown(usable):
            self._waits = False
        if self._waits or not usable:
            self._usable_layer.lose()
            self.dropped += 1
            return
        packets = [usable[track] for track in self._header.tracks if track in usable]
        if found.header is not None:
            if self._last is None and first.index != self._header.first_frame:
                self._header = replace(self._header, first_frame=first.index)
            packets.insert(0, replace(found.header, data=self._header.to_json()))
        self._held, self._last = packets, first

    def _drop(self) -> None:
        self._usable_layer.lose()
        self._waits = True
        self.dropped += 1

    def _usable(self, found: PacketSet) -> dict[Track, Packet]:
        """The packets that a decoder can decode."""
        self._tracks.lose(found.missing)
        usable = {}
        for track, packet in found.packets.items():
            error = self._tracks.check(packet, self._label(packet))
            if error is None:
                usable[track] = packet
            elif track not in self._absent:
                self._absent.add(track)
                self._tell(error)
        self._drop_unpredicted(usable)
        return usable

    def _drop_unpredicted(self, usable: dict[Track, Packet]) -> None:
        """Leave out predicted pictures whose predictions cannot be made."""
        for each in self._header.predicted:
            track = self._header.picture_track(each.camera)
            if track in usable and not self._header.needed_tracks(each) <= usable.keys():
                packet = usable.pop(track)
                self._tracks.lose([track])
                if track not in self._absent:
                    self._absent.add(track)
                    found = "a picture whose references are missing"
                    self._tell(StreamError(self._label(packet), found, "all of them"))

    def _can_be_shown(self, usable: dict[Track, Packet]) -> bool:
        """Whether there is a camera with picture and map, without which nothing is decoded."""
        if not self._header.map_cameras:
            array = self._header.array
            there = [camera for camera in array.real if self._header.picture_track(camera) in usable]
            return can_be_estimated(array, there)
        return any(
            self._header.picture_track(camera) in usable and Track(TrackKind.DISPARITY, camera) in usable
            for camera in self._header.map_cameras
        )

    def _tell_absent(self, missing: set[Track], first: Packet) -> None:
        """Tell which tracks are missing from now on."""
        for track in sorted(missing - self._absent, key=lambda track: track.topic):
            label = self._label(replace(first, track=track))
            self._tell(StreamError(label, "no packet", "one for each track of a frame set"))
        self._absent = missing

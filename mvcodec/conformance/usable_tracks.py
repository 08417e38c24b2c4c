"""Which packets of damaged streams can be decoded, known without decoding any."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from mvcodec.enhancement import LAYER_TRACK, EnhancementHeader
from mvcodec.errors import StreamError
from mvcodec.stream import Packet, StreamHeader, Track, TrackKind
from mvcodec.video.codecs import CODECS
from mvcodec.video.map_size import track_sizes
from mvcodec.video.reference_watch import ReferenceWatch
from mvcodec.video.vp9_reference import unit_codec


class UsableTracks:
    """Knows of each track whether its pictures still can be decoded.

    Raises:
        StreamError: the header's codec is unknown.
    """

    def __init__(self, header: StreamHeader, name: str) -> None:
        if header.codec not in CODECS:
            raise StreamError(name, f"codec {header.codec}", " or ".join(CODECS))
        array = header.array
        self._sizes = track_sizes(array.width, array.height, header.disparity_scale)
        self._codec = CODECS[header.codec]
        self._watches: dict[Track, ReferenceWatch] = {}

    def lose(self, tracks: Iterable[Track]) -> None:
        """Pictures of these tracks are missing."""
        for track in tracks:
            self._watches.pop(track, None)

    def check(self, packet: Packet, label: str) -> StreamError | None:
        """Why a packet cannot be decoded; None where it can."""
        if packet.keyframe:
            size = self._sizes[packet.track.kind]
            codec = unit_codec(packet.track, self._codec)
            self._watches[packet.track] = ReferenceWatch(codec, size)
        watch = self._watches.get(packet.track)
        if watch is None:
            return StreamError(label, "a picture that builds on one that is missing", "a keyframe")
        try:
            watch.push(packet.data, label, packet.index)
        except StreamError as error:
            self.lose([packet.track])
            return error
        return None


class UsableLayer:
    """What of an enhancement layer can be decoded, frame set by frame set.

    Args:
        base: the stream's header.
        tracks: of the stream.
        label: what to call a packet in a message.
        tell: told once of each view that is left out.
    """

    def __init__(
        self,
        base: StreamHeader,
        tracks: UsableTracks,
        label: Callable[[Packet], str],
        tell: Callable[[StreamError], None],
    ) -> None:
        self._base, self._tracks, self._label, self._tell = base, tracks, label, tell
        self._head: tuple[Packet, EnhancementHeader] | None = None
        self._known: set[Track] = set()
        self._absent: set[Track] = set()

    def lose(self) -> None:
        """A frame set is left out as a whole."""
        self._tracks.lose(self._known)

    def usable(self, base: Mapping[Track, Packet], layer: Mapping[Track, Packet]) -> list[Packet]:
        """Of a frame set: the layer's header, at a keyframe, and the units that can be decoded.

        Args:
            base: the packets that are kept.
            layer: those of the layer that came.
        """
        first = next(iter(base.values()))
        if LAYER_TRACK in layer:
            self._read_head(layer[LAYER_TRACK])
        if self._head is None:
            return []
        head, known = self._head
        found = [replace(head, index=first.index, time_ns=first.time_ns)] if first.keyframe else []
        there = {
            packet.track.camera for packet in base.values() if packet.track.kind is not TrackKind.DISPARITY
        }
        for each in known.views:
            packet = layer.get(each.track)
            if packet is None and each.track not in self._known:
                continue  # a view that was left out of the file
            self._known.add(each.track)
            needed = self._base.needed_maps(each.view, each.references)
            whole = there.issuperset(each.references) and needed <= base.keys()
            error = self._trouble(packet or replace(first, track=each.track), packet is not None, whole)
            if error is None:
                assert packet is not None
                self._absent.discard(each.track)
                there.add(each.view)
                found.append(packet)
                continue
            self._tracks.lose([each.track])
            if each.track not in self._absent:
                self._absent.add(each.track)
                self._tell(error)
        return found

    def complete(self, packets: Iterable[Packet]) -> bool:
        """Whether a frame set has all views that the file has."""
        return self._known <= {packet.track for packet in packets}

    def _read_head(self, packet: Packet) -> None:
        """All headers of the new file say the same: the first one that is whole."""
        if self._head is not None:
            return
        try:
            layer = EnhancementHeader.from_json(packet.data, self._base, self._label(packet))
        except StreamError as error:
            self._tell(error)
        else:
            self._head = packet, layer

    def _trouble(self, packet: Packet, came: bool, whole: bool) -> StreamError | None:
        label = self._label(packet)
        if not came:
            return StreamError(label, "no packet", "one for each view of a frame set")
        if not whole:
            return StreamError(label, "a picture whose references are missing", "all of them")
        return self._tracks.check(packet, label)

"""Packets -> frame sets, whole or not; says what is missing or out of place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mvcodec.errors import StreamError
from mvcodec.stream import HEADER_TRACK, Packet, Track


@dataclass(frozen=True, slots=True, eq=False)
class PacketSet:
    """The packets of one frame set.

    Attributes:
        header: its header's packet; None unless it is a keyframe.
        packets: by video track, those that came.
        missing: the video tracks of which none came.
    """

    header: Packet | None
    packets: dict[Track, Packet]
    missing: tuple[Track, ...]

    @property
    def first(self) -> Packet:
        """A packet of it, which has its index and time."""
        return next(iter(self.packets.values()))


class Assembler:
    """Collects packets until their frame set is whole, or the next one begins.

    Packets that come twice, or after a later frame set, are told and dropped.

    Args:
        name: of the stream, for messages.
        tell: takes what is out of place.
    """

    def __init__(self, name: str, tell: Callable[[StreamError], None]) -> None:
        self._name, self._tell = name, tell
        self._tracks: tuple[Track, ...] = ()
        self._header: Packet | None = None
        self._pending: dict[Track, Packet] = {}
        self._last: Packet | None = None
        self._told: int | None = None

    def start(self, tracks: Sequence[Track]) -> None:
        """Expect these video tracks from now on; forget everything before."""
        self._tracks = tuple(tracks)
        self._header, self._pending, self._last, self._told = None, {}, None, None

    def push(self, packet: Packet) -> list[PacketSet]:
        """Take a packet; returns the frame sets that it ends: its own, or one with missing packets.

        Raises:
            StreamError: a track that is none of those expected.
        """
        if packet.track == HEADER_TRACK:
            done = self.flush()
            self._header = packet
            return done
        if packet.track not in self._tracks:
            raise StreamError(self.label(packet), "a track that the header does not name", "a real camera's")
        waiting = next(iter(self._pending.values()), None)
        done = []
        if waiting is None or packet.index != waiting.index:
            latest = waiting or self._last
            if latest is not None and packet.index <= latest.index:
                self._misplaced(packet, f"frame {packet.index} after frame {latest.index}")
                return []
            done = self._finish()
        elif packet.track in self._pending:
            self._misplaced(packet, "two packets of one frame set")
            return []
        self._pending[packet.track] = packet
        if len(self._pending) == len(self._tracks):
            done += self._finish()
        return done

    def flush(self) -> list[PacketSet]:
        """The frame set that waits for missing packets, if there is one."""
        return self._finish()

    def drop(self) -> None:
        """Forget what waits."""
        self._header, self._pending = None, {}

    def label(self, packet: Packet) -> str:
        """What to call a packet in a message: topic and time."""
        return f"{self._name}: {packet.track.topic} at {packet.time_ns / 1e9:.3f} s"

    def _finish(self) -> list[PacketSet]:
        packets, self._pending = self._pending, {}
        if not packets:
            return []
        first = next(iter(packets.values()))
        if self._last is not None and first.time_ns <= self._last.time_ns:
            found = f"a time not after that of frame {self._last.index}"
            label = f"{self._name}: frame {first.index} at {first.time_ns / 1e9:.3f} s"
            topic = first.track.topic
            self._tell(StreamError(label, found, "times that increase", topic, first.time_ns))
        header, self._header = self._header, None
        if header is not None and header.index != first.index:
            header = None
        self._last = first
        missing = tuple(track for track in self._tracks if track not in packets)
        return [PacketSet(header, packets, missing)]

    def _misplaced(self, packet: Packet, found: str) -> None:
        """Tell it, once for each frame set."""
        if packet.index != self._told:
            self._told = packet.index
            expected, topic = "frame sets in order, each once", packet.track.topic
            self._tell(StreamError(self.label(packet), found, expected, topic, packet.time_ns))

"""What ``info`` would say of a stream that has gone out through a pipe, which nobody can read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from mvcodec.cli.standard_streams import CountedOutput
from mvcodec.container import McapWriter
from mvcodec.container.file_facts import Bits, StreamInfo
from mvcodec.output.live_view import LiveView
from mvcodec.stream import Packet, StreamHeader, TrackKind


class TalliedWriter(McapWriter):
    """Writes to standard output and counts what goes there; arguments as McapWriter's."""

    def __init__(self, target: CountedOutput, chunk_ms: int, listener: LiveView | None) -> None:
        super().__init__(target, chunk_ms, listener)
        self._output = target
        self._header: StreamHeader | None = None
        self._bytes: Counter[TrackKind] = Counter()
        self._times_ns: list[int] = []

    def push(self, packets: Sequence[Packet]) -> None:
        """Write one frame set's packets and count them."""
        super().push(packets)
        if self._header is None:
            self._header = StreamHeader.from_json(packets[0].data)
        self._times_ns = [*self._times_ns[:1], packets[0].time_ns]
        for packet in packets:
            self._bytes[packet.track.kind] += len(packet.data)

    def info(self) -> StreamInfo:
        """What was written, once the writer is closed and something was."""
        assert self._header is not None
        total = 8 * self._output.written
        bits = Bits.of(total, {kind: 8 * self._bytes[kind] for kind in TrackKind})
        return StreamInfo(
            self._header, self.frame_count, bits, span_ns=(self._times_ns[0], self._times_ns[-1])
        )

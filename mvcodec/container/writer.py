"""Packets -> one MCAP file that grows by whole chunks; see FORMAT.md."""

from __future__ import annotations

import io
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, BinaryIO, Self

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer

import mvcodec
from mvcodec.container import schemas
from mvcodec.errors import OutputError, StreamClosed
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, TrackKind

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

CHUNK_NS = 500_000_000
"""The most stream time that a chunk holds, hence what a power cut can lose."""

METADATA_NAME = "mvcodec"
LIBRARY = f"mvcodec {mvcodec.__version__}"


class McapWriter:
    """Writes packets into a file, from the first frame set on.

    Args:
        target: path, or an open binary file, which may be a pipe and stays open.

    Raises (from `push` and `close`):
        OutputError: the system refuses to open or write.
    """

    def __init__(self, target: BinaryIO | Path) -> None:
        self._target = target
        self._name = str(target if isinstance(target, Path) else getattr(target, "name", "output"))
        self._file: io.BufferedWriter | None = None
        self._mcap: Writer | None = None
        self._channels: dict[str, int] = {}
        self._rig: tuple[schemas.RigMessage, ...] = ()
        self._codec = ""
        self._chunk_start_ns: int | None = None
        self._closed = False
        self.frame_count = 0

    def push(self, packets: Sequence[Packet]) -> None:
        """Write one frame set's packets, as `Encoder.push` returns them (the header's first).

        Raises:
            StreamClosed: after `close`.
        """
        if self._closed:
            raise StreamClosed("the file was closed; it takes no more packets")
        try:
            mcap = self._mcap or self._start(packets[0])
            self._push(mcap, packets)
        except OSError as error:
            raise OutputError(self._name, error.strerror or error) from None

    def close(self) -> None:
        """Complete the file with its summary. No file appears where nothing was pushed."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._mcap is not None:
                self._mcap.finish()  # type: ignore[no-untyped-call]
            if self._file is not None:
                self._file.close()  # a file that was handed in stays open: see _Pipe
        except OSError as error:
            raise OutputError(self._name, error.strerror or error) from None
        finally:
            if self._file is not None:
                # After a failure the buffer would be written again, and fail again, at exit.
                with suppress(OSError):
                    self._file.raw.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _push(self, mcap: Writer, packets: Sequence[Packet]) -> None:
        time_ns, keyframe = packets[0].time_ns, packets[0].track.kind is TrackKind.HEADER
        start = self._chunk_start_ns
        # A chunk starts at each keyframe, so that a reader reaches keyframes by the chunk index.
        if start is not None and (keyframe or time_ns - start >= CHUNK_NS):
            mcap.flush()  # type: ignore[no-untyped-call]
            start = None
        self._chunk_start_ns = time_ns if start is None else start
        for packet in packets:
            if packet.track.kind is TrackKind.HEADER:
                self._add(mcap, packet.track.topic, packet, packet.data)
                for message in self._rig:
                    self._add(mcap, message.topic, packet, message.at(time_ns))
            else:
                self._add(mcap, packet.track.topic, packet, schemas.video_message(packet, self._codec))
        self.frame_count += 1

    def _add(self, mcap: Writer, topic: str, packet: Packet, data: bytes) -> None:
        mcap.add_message(self._channels[topic], packet.time_ns, data, packet.time_ns, sequence=packet.index)

    def _start(self, first: Packet) -> Writer:
        header = StreamHeader.from_json(first.data)
        self._codec, self._rig = header.codec, schemas.rig_messages(header.array)
        target = self._target
        self._file = target.open("wb") if isinstance(target, Path) else io.BufferedWriter(_Pipe(target))
        # Chunks end where `_push` says, never by size. Summary offsets are optional, and checkers
        # fault those of empty groups (a file without attachments).
        self._mcap = Writer(
            self._file, chunk_size=1 << 62, compression=CompressionType.ZSTD, use_summary_offsets=False
        )
        self._mcap.start(profile="", library=LIBRARY)
        self._mcap.add_metadata(METADATA_NAME, {"header": first.data.decode()})
        self._register(self._mcap, header)
        return self._mcap

    def _register(self, mcap: Writer, header: StreamHeader) -> None:
        schema = mcap.register_schema(
            schemas.HEADER_SCHEMA_NAME, SchemaEncoding.JSONSchema, schemas.HEADER_SCHEMA
        )
        topic = HEADER_TRACK.topic
        self._channels[topic] = mcap.register_channel(topic, MessageEncoding.JSON, schema)
        ids = {
            kind: mcap.register_schema(name, SchemaEncoding.Protobuf, data)
            for kind, (name, data) in schemas.PROTOBUF_SCHEMAS.items()
        }
        kinds = {message.topic: message.kind for message in self._rig}
        kinds.update({track.topic: "video" for track in header.tracks})
        for topic, kind in kinds.items():
            self._channels[topic] = mcap.register_channel(topic, MessageEncoding.Protobuf, ids[kind])


class _Pipe(io.RawIOBase):
    """Any binary output with the `tell` that the MCAP library asks for; leaves the output open."""

    def __init__(self, output: BinaryIO) -> None:
        self._output = output
        self._written = 0

    def writable(self) -> bool:
        return True

    def write(self, data: ReadableBuffer, /) -> int:
        count = self._output.write(data)  # may be a part: io.BufferedWriter writes the rest
        self._written += count
        return count

    def tell(self) -> int:
        return self._written

    def flush(self) -> None:
        self._output.flush()

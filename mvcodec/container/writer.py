"""Packets -> one MCAP file; see FORMAT.md."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

from mcap.well_known import MessageEncoding, SchemaEncoding

from mvcodec.closing import Closing
from mvcodec.container import schemas
from mvcodec.container.chunk_writing import CHUNK_MS, ChunkedFile, MessageListener
from mvcodec.container.declared import METADATA_NAME, TOPICS_KEY
from mvcodec.enhancement import EnhancementHeader
from mvcodec.errors import StreamClosed
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, TrackKind


class McapWriter(Closing):
    """Writes packets into a file, from the first frame set on.

    Args:
        target: path, or an open binary file, which may be a pipe and stays open.
        chunk_ms: the most stream time that waits before it is written, 0..60000; with 0 each
            frame set is written at once.
        listener: hears of every channel and message that goes into the file.

    Raises (from `push` and `close`):
        SettingError (at once): chunk_ms is outside its range.
        OutputError: the system refuses to open or write.
    """

    def __init__(
        self,
        target: BinaryIO | str | os.PathLike[str],
        chunk_ms: int = CHUNK_MS.default,
        listener: MessageListener | None = None,
    ) -> None:
        file = Path(target) if isinstance(target, str | os.PathLike) else target
        self._file = ChunkedFile(file, chunk_ms, listener)
        self._rig: tuple[schemas.RigMessage, ...] = ()
        self._video_topics: tuple[str, ...] = ()
        self._layer_topics: set[str] = set()
        self._codec = ""
        self._size = 0, 0
        self._closed = False
        self.frame_count = 0

    @property
    def written_count(self) -> int:
        """How many of the frame sets pushed are surely in the file; all, once it is closed."""
        return self._file.sets_written

    def push(self, packets: Sequence[Packet]) -> None:
        """Write one frame set's packets, as `Encoder.push` returns them (the header's first).

        Raises:
            StreamClosed: after `close`.
        """
        if self._closed:
            raise StreamClosed("the file was closed; it takes no more packets")
        if not self._file.is_open:
            self._start(packets)
        first, file = packets[0], self._file
        keyframe = first.track == HEADER_TRACK
        file.begin_set(first.time_ns, keyframe)
        if keyframe and self.frame_count and file.joinable:
            file.add_metadata(METADATA_NAME, {TOPICS_KEY: self._topics()})
        for packet in packets:
            if packet.track.kind is TrackKind.HEADER:
                file.add(packet.track.topic, packet.index, packet.time_ns, packet.data)
                for message in self._rig:
                    file.add(message.topic, packet.index, packet.time_ns, message.at(packet.time_ns))
            elif packet.track.kind is TrackKind.LAYER:
                self._add_layer_channels(packet)
                file.add(packet.track.topic, packet.index, packet.time_ns, packet.data)
            else:
                data = self._message(packet)
                file.add(packet.track.topic, packet.index, packet.time_ns, data)
        self.frame_count += 1
        file.end_set()

    def note(self, values: Mapping[str, str]) -> None:
        """Write facts about the stream as metadata. Nothing is written where nothing was pushed."""
        if self._file.is_open:
            self._file.add_metadata(METADATA_NAME, values)

    def close(self) -> None:
        """Complete the file with its summary. No file appears where nothing was pushed."""
        if not self._closed:
            self._closed = True
            self._file.close()

    def _start(self, packets: Sequence[Packet]) -> None:
        first = packets[0]
        header = StreamHeader.from_json(first.data)
        self._base = header
        self._codec, self._rig = header.codec, schemas.rig_messages(header.array)
        self._size = header.array.width, header.array.height
        self._file.open()
        self._add_channels(header)
        for packet in packets:
            if packet.track.kind is TrackKind.LAYER:
                self._add_layer_channels(packet)
        self._file.add_metadata(METADATA_NAME, {"header": first.data.decode(), TOPICS_KEY: self._topics()})

    def _message(self, packet: Packet) -> bytes:
        if packet.track.kind is TrackKind.DEPTH:
            if packet.track.topic not in self._file.channels:
                name, schema = schemas.DEPTH_SCHEMA
                channel = (MessageEncoding.Protobuf, name, SchemaEncoding.Protobuf, schema)
                self._file.add_channel(packet.track.topic, *channel)
            return schemas.depth_image(packet, *self._size)
        return schemas.video_message(packet, self._codec)

    def _add_layer_channels(self, packet: Packet) -> None:
        """The channels of an enhancement layer, those that no header named before."""
        if packet.track.topic not in self._file.channels:
            json_schema = (schemas.LAYER_SCHEMA_NAME, SchemaEncoding.JSONSchema, schemas.LAYER_SCHEMA)
            self._file.add_channel(packet.track.topic, MessageEncoding.JSON, *json_schema)
        layer = EnhancementHeader.from_json(packet.data, self._base, packet.track.topic)
        topics = {each.track.topic: schemas.video_kind(each.track) for each in layer.views}
        for channel in schemas.channels((), topics):
            if channel[0] not in self._file.channels:
                self._file.add_channel(*channel)
        self._layer_topics |= {packet.track.topic, *topics}

    def _add_channels(self, header: StreamHeader) -> None:
        self._video_topics = tuple(track.topic for track in header.tracks)
        json_schema = (schemas.HEADER_SCHEMA_NAME, SchemaEncoding.JSONSchema, schemas.HEADER_SCHEMA)
        self._file.add_channel(HEADER_TRACK.topic, MessageEncoding.JSON, *json_schema)
        kinds = {track.topic: schemas.video_kind(track) for track in header.tracks}
        for channel in schemas.channels(self._rig, kinds):
            self._file.add_channel(*channel)

    def _topics(self) -> str:
        """Which topic each channel is, for readers that lack the first chunk, where channels are declared."""
        needed = {HEADER_TRACK.topic, *self._video_topics, *self._layer_topics}
        topics = {number: topic for topic, number in self._file.channels.items() if topic in needed}
        return json.dumps(topics, separators=(",", ":"))

"""Goes through an MCAP file record by record and compares its indexes with what is there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, BinaryIO

from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
)

from mvcodec.conformance.data_section import DataSection
from mvcodec.conformance.summary_check import check_summary
from mvcodec.conformance.told_records import ToldRecords
from mvcodec.container.file_index import FileIndex, read_index
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.records import (
    HEAD,
    MAGIC,
    Content,
    RecordError,
    UnknownPacking,
    chunk_places,
    find_chunk,
    parse_chunk,
    parse_message,
    unpack,
)

_IN_DATA = {
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.MESSAGE,
    Opcode.ATTACHMENT,
    Opcode.CHUNK,
    Opcode.MESSAGE_INDEX,
    Opcode.METADATA,
}


@dataclass(frozen=True, slots=True, eq=False)
class CheckedMessage:
    """A message with all that its channel says of it."""

    topic: str
    schema: str
    encoding: str
    record: Message


@dataclass(frozen=True, slots=True)
class _DamagedChunk:
    """A chunk that cannot be read, and the channels that the message indexes behind it name."""

    why: str
    times_ns: tuple[int, int] | None
    channels: list[int]


class FileCheck:
    """Yields a file's messages in order; afterwards `findings` says what is wrong with their container.

    Args:
        file: a seekable file.
        limits: what is more than that is not read.

    Attributes:
        findings: in the order of the file.
        metadata: name -> values of the last metadata record of that name, with all their keys.
    """

    def __init__(self, file: BinaryIO, limits: Limits = DEFAULT_LIMITS) -> None:
        self._walk, self._limits = ToldRecords(file, limits), limits
        self.findings = self._walk.findings
        self._tell, self._parsed = self._walk.tell, self._walk.parsed
        self.metadata: dict[str, dict[str, str]] = {}
        self._seen = DataSection()
        self._message_indexes: dict[int, MessageIndex] | None = None
        self._damaged: _DamagedChunk | None = None
        self._unknown: set[int] = set()
        self._index: FileIndex | None = None

    @property
    def indexed(self) -> bool:
        """Whether there is a summary, which names all topics; known with the first message."""
        return self._index is not None

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> the name of its schema, as far as the file or its summary has said by now."""
        found = {}
        for known in (self._index, self._seen):
            if known is None:
                continue
            for channel in known.channels.values():
                schema = known.schemas.get(channel.schema_id)
                found[channel.topic] = "" if schema is None else schema.name
        return found

    def messages(self) -> Iterator[CheckedMessage]:
        """Go through the file."""
        with suppress(RecordError):  # a damaged summary is told where it stands
            self._index = read_index(self._walk.file, self._limits)
        self._walk.file.seek(0)
        if self._walk.file.read(len(MAGIC)) != MAGIC:
            self._tell("magic", "the file does not begin as MCAP does")
            if not find_chunk(self._walk.file, self._limits):
                return
        first = True
        while (record := self._walk.next()) is not None:
            opcode, content, place = record
            if first and opcode != Opcode.HEADER and self._walk.whole:
                self._tell("header", "the first record is no header")
            if opcode == Opcode.HEADER and not first:
                self._tell("header", "a second header")
            first = False
            if opcode == Opcode.DATA_END:
                self._end_message_indexes()
                check_summary(self._walk, self._seen, place, content)
                return
            if opcode == Opcode.CHUNK:
                self._end_message_indexes()
                yield from self._chunk(content, place)
            elif opcode in _IN_DATA:
                yield from self._outside(opcode, content, place)
            elif opcode != Opcode.HEADER:
                self._tell("record", f"a record of kind {opcode} among the data")
        self._end_message_indexes()

    def _topic(self, number: int) -> str | None:
        """The topic of a channel, if it is known."""
        channel = self._known(number).channels.get(number)
        return None if channel is None else channel.topic

    def _known(self, number: int) -> DataSection | FileIndex:
        """What declares a channel: the data so far or, where that was lost, the summary."""
        return self._seen if self._index is None or number in self._seen.channels else self._index

    def _tell_damaged(self, damaged: _DamagedChunk) -> None:
        """Tell of a damaged chunk, whose topics the message indexes behind it name."""
        numbers = damaged.channels or list(self._seen.channels)
        topics = sorted({topic for topic in map(self._topic, numbers) if topic is not None})
        lost = f"a chunk of {topics[0]}" if topics else "a chunk"
        if len(topics) > 1:
            lost += f" and {len(topics) - 1} more topics"
        text, time_ns = f"damage ({damaged.why}): {lost}", None
        if damaged.times_ns is not None:
            time_ns, end_ns = damaged.times_ns
            text += f", {time_ns / 1e9:.3f}..{end_ns / 1e9:.3f} s"
        self._tell("chunk", text, topics[0] if topics else None, time_ns)

    def _chunk(self, content: bytes, place: int) -> Iterator[CheckedMessage]:
        self._message_indexes = {}
        times_ns = None
        try:
            head, packed = parse_chunk(content, self._limits)
            times_ns = (head.start_ns, head.end_ns)
            index = ChunkIndex(
                chunk_length=HEAD.size + len(content),
                chunk_start_offset=place,
                compression=head.compression,
                compressed_size=len(packed),
                message_end_time=head.end_ns,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=head.start_ns,
                uncompressed_size=head.size,
            )
            self._seen.chunks.append(index)
            messages = self._unpacked(unpack(head, packed, self._limits))
        except (RecordError, UnknownPacking) as damage:
            self._damaged = _DamagedChunk(str(damage), times_ns, [])
            self._walk.whole = False
            return
        times = [message.record.log_time for message in messages]
        first = messages[0].topic if messages else None
        if not head.crc:
            self._tell("chunk", "a chunk without a checksum", first, head.start_ns)
        if times and (min(times), max(times)) != times_ns:
            self._tell("chunk", "a chunk whose times are not those of its messages", first, min(times))
        yield from messages

    def _unpacked(self, data: bytes) -> list[CheckedMessage]:
        messages = []
        for opcode, content, place in chunk_places(data):
            if opcode == Opcode.MESSAGE:
                message, number = self._message(content)
                if message is not None:
                    messages.append(message)
                    assert self._message_indexes is not None
                    index = self._message_indexes.setdefault(number, MessageIndex(number, []))
                    index.records.append((message.record.log_time, place))
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._declare(opcode, content)
            else:
                self._tell("record", f"a record of kind {opcode} inside a chunk")
        return messages

    def _message(self, content: Content) -> tuple[CheckedMessage | None, int]:
        record = parse_message(content)
        seen, number = self._seen, record.channel_id
        self._walk.time_ns = record.log_time
        seen.count(number, record.log_time)
        known = self._known(number)
        channel = known.channels.get(number)
        if channel is None or (known is not seen and self._walk.whole):
            self._tell_unknown(number)
        if channel is None:
            return None, number
        schema = known.schemas.get(channel.schema_id)
        name = "" if schema is None else schema.name
        return CheckedMessage(channel.topic, name, channel.message_encoding, record), number

    def _tell_unknown(self, number: int) -> None:
        """Tell of a channel that was not declared before its messages, once."""
        if number not in self._unknown:
            self._unknown.add(number)
            self._tell("channel", f"a message of unknown channel {number}")

    def _declare(self, opcode: int, content: Content) -> None:
        kind = Schema if opcode == Opcode.SCHEMA else Channel
        record = self._parsed(kind, bytes(content))
        if record is None:
            return
        known: dict[int, Any] = self._seen.schemas if opcode == Opcode.SCHEMA else self._seen.channels
        if known.setdefault(record.id, record) != record:
            self._tell("channel", f"two different {kind.__name__.lower()}s of number {record.id}")
        if opcode == Opcode.CHANNEL:
            if record.schema_id and record.schema_id not in self._seen.schemas:
                self._tell("channel", f"unknown schema {record.schema_id}", record.topic)
            if any(other.topic == record.topic and other.id != record.id for other in known.values()):
                self._tell("channel", "two channels", record.topic)

    def _outside(self, opcode: int, content: bytes, place: int) -> Iterator[CheckedMessage]:
        """A record of the data section outside of chunks."""
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._declare(opcode, content)
        elif opcode == Opcode.MESSAGE:
            self._tell("record", "a message outside of chunks")
            try:
                message, _ = self._message(content)
            except RecordError as damage:
                self._tell("record", str(damage))
            else:
                yield from () if message is None else (message,)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._check_message_index(content, place)
        elif opcode == Opcode.METADATA:
            record = self._parsed(Metadata, content)
            if record is not None:
                self.metadata.setdefault(record.name, {}).update(record.metadata)
                self._seen.metadata.append(
                    MetadataIndex(length=HEAD.size + len(content), name=record.name, offset=place)
                )
        else:
            self._seen.attachments += 1

    def _check_message_index(self, content: bytes, place: int) -> None:
        found = self._parsed(MessageIndex, content)
        if found is None:
            return
        if self._message_indexes is None:
            self._tell("message-index", "a message index without a chunk before it")
            return
        if self._damaged is not None:
            self._damaged.channels.append(found.channel_id)
        elif self._message_indexes.pop(found.channel_id, None) != found:
            text = f"the message index of channel {found.channel_id} is wrong"
            self._tell("message-index", text, self._topic(found.channel_id))
        if self._seen.chunks:
            chunk = self._seen.chunks[-1]
            chunk.message_index_offsets[found.channel_id] = place
            chunk.message_index_length += HEAD.size + len(content)

    def _end_message_indexes(self) -> None:
        if self._damaged is not None:
            self._tell_damaged(self._damaged)
        else:
            for number in self._message_indexes or ():
                text = f"no message index of channel {number} behind its chunk"
                self._tell("message-index", text, self._topic(number))
        self._message_indexes = self._damaged = None

"""An MCAP file as a sequence of chunks of messages: by its index, or from front to back."""

from __future__ import annotations

import io
from bisect import bisect_left
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Message, MessageIndex, Schema

from mvcodec.container.declared import Declared
from mvcodec.container.exact_file import ExactFile
from mvcodec.container.file_index import FileIndex, read_index
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.message_schema import MessageSchema
from mvcodec.container.record_walk import RecordWalk
from mvcodec.container.records import (
    DAMAGE,
    MAGIC,
    ChunkHead,
    CutOff,
    FramingError,
    RecordError,
    UnknownPacking,
    chunk_records,
    find_chunk,
    parse_channel,
    parse_chunk,
    parse_message,
    parse_schema,
    read_record,
    unpack,
)
from mvcodec.errors import StreamError

EXPECTED = "an MCAP file written by mvcodec"
PACKINGS_READ = "zstd, lz4 or none: other packings are not supported"

TopicMessage = tuple[str, Message]
OnDamage = Callable[[StreamError], None]


class ChunkReader:
    """Reads chunk by chunk, each as its messages in file order.

    Args:
        file: binary input, which may be a pipe.
        name: what to call it in messages.
        limits: what is more than that is refused.
        on_damage: told of damage, behind which reading goes on; None raises it.
        expected: what the file should be, for messages.

    Attributes:
        cut_off: the input broke off (known when `chunks` has ended).
        partial: the chunk delivered last is one that breaks off.

    Raises (also while iterating):
        StreamError: not an MCAP file, or damage where there is no `on_damage`.
    """

    def __init__(
        self,
        file: BinaryIO,
        name: str,
        limits: Limits = DEFAULT_LIMITS,
        on_damage: OnDamage | None = None,
        expected: str = EXPECTED,
    ) -> None:
        self._file, self._expected = ExactFile(file), expected
        self._name, self._limits, self._on_damage = name, limits, on_damage
        self._declared = Declared()
        self._last_time_ns: int | None = None
        self._damaged = False
        self._index_damage = ""
        self.cut_off = self.partial = False
        self._index = self._read_index() if file.seekable() else None
        self._file.summing = self._index is None  # chunks have checksums of their own
        if self._index is not None:
            for channel in self._index.channels.values():
                self._declared.add(channel)
            for schema in self._index.schemas.values():
                self._declared.add(schema)

    @property
    def indexed(self) -> bool:
        """Whether the file is complete, with an index; otherwise it is read once, front to back."""
        return self._index is not None

    @property
    def bytes_read(self) -> int:
        """Bytes taken from the input so far."""
        return self._file.count

    @property
    def size(self) -> int:
        """Bytes of the input: a file's size; of a pipe, what was read so far."""
        return self._file.size if self._file.seekable() else self._file.count

    @property
    def topics(self) -> set[str]:
        """The topics seen so far: all of an indexed file."""
        return self._declared.topics

    def facts(self) -> dict[str, str]:
        """What our metadata records say: all of an indexed file's, else those that came by."""
        for offset in self._index.metadata if self._index is not None else ():
            self._file.seek(offset)
            with suppress(RecordError, CutOff):  # no frame set depends on them
                record = read_record(self._file, self._limits)
                if record is not None and record[0] == Opcode.METADATA:
                    self._declared.note(record[1])
        return self._declared.facts

    def schema_of(self, topic: str) -> MessageSchema:
        """How the messages of a topic seen so far are written; empty where nothing says so."""
        return self._declared.schema_of(topic)

    def chunks(self, first: int = 0, end_ns: int | None = None) -> Iterator[list[TopicMessage]]:
        """The chunks in file order; if the file is indexed, from chunk `first` and before a time."""
        try:
            if self._index is None:
                yield from self._streamed()
                return
            for index in self._index.chunks[first:]:
                if end_ns is None or index.message_start_time < end_ns:
                    yield from self._indexed(index)
        except UnknownPacking as error:
            raise StreamError(
                self._name, error, "zstd, lz4 or none: other packings are not supported"
            ) from None

    def chunks_with(self, topics: Collection[str]) -> list[ChunkIndex]:
        """The chunks of an indexed file that hold messages on some topics, in file order."""
        assert self._index is not None
        numbers = {number for topic in topics for number in self._declared.numbers_of(topic)}
        return [chunk for chunk in self._index.chunks if not numbers.isdisjoint(chunk.message_index_offsets)]

    def read_chunk(self, index: ChunkIndex) -> list[TopicMessage]:
        """The messages of one chunk of an indexed file; none where it is damaged and that was told."""
        try:
            return [message for messages in self._indexed(index) for message in messages]
        except UnknownPacking as error:
            raise StreamError(
                self._name, error, "zstd, lz4 or none: other packings are not supported"
            ) from None

    @property
    def start_ns(self) -> int:
        """Log time of the first message of an indexed file."""
        assert self._index is not None
        return min((chunk.message_start_time for chunk in self._index.chunks), default=0)

    def chunk_at(self, time_ns: int) -> int:
        """The first chunk of an indexed file that does not end before a time."""
        assert self._index is not None
        return bisect_left(self._index.chunks, time_ns, key=lambda chunk: chunk.message_end_time)

    def times(self, topic: str) -> list[int]:
        """Log times of a topic's messages in an indexed file, ascending, ns."""
        return sorted(self.times_as_written(topic))

    def times_as_written(self, topic: str) -> list[int]:
        """The same in the order of the file."""
        times: list[int] = []
        for chunk in self.chunks_with([topic]):
            records: list[tuple[int, int]] = []
            for number in self._declared.numbers_of(topic):
                if (offset := chunk.message_index_offsets.get(number)) is not None:
                    records += self._message_index(offset)
            times += [time_ns for time_ns, _ in sorted(records, key=lambda record: record[1])]
        return times

    def _message_index(self, offset: int) -> list[tuple[int, int]]:
        """(log time, offset in the chunk) of messages."""
        self._file.seek(offset)
        try:
            record = read_record(self._file, self._limits)
            if record is None or record[0] != Opcode.MESSAGE_INDEX:
                raise RecordError("no message index where the index says")
            index = MessageIndex.read(ReadDataStream(io.BytesIO(record[1])))
        except (RecordError, CutOff, *DAMAGE) as error:
            raise StreamError(self._name, f"a damaged index ({error})", self._expected) from None
        return list(index.records)

    def _read_index(self) -> FileIndex | None:
        index = None
        try:
            index = read_index(self._file, self._limits)
        except RecordError as error:  # the data may be whole: they are read from front to back
            self._index_damage = str(error)
        self._file.seek(0)
        return index

    def _indexed(self, index: ChunkIndex) -> Iterator[list[TopicMessage]]:
        """The messages of one chunk; nothing where it is damaged and that was told."""
        self._file.seek(index.chunk_start_offset)
        try:
            record = read_record(self._file, self._limits)
            if record is None or record[0] != Opcode.CHUNK:
                raise RecordError("no chunk where the index says")
            head, data = parse_chunk(record[1], self._limits)
            _compare(head, index)
            messages = self._messages(unpack(head, data, self._limits))
        except (RecordError, CutOff) as error:
            times = (index.message_start_time, index.message_end_time)
            self._report(str(error), times, list(index.message_index_offsets))
        else:
            yield messages

    def _streamed(self) -> Iterator[list[TopicMessage]]:
        self._start()
        walk = RecordWalk(self._file, self._limits, self._report)
        while (record := walk.next()) is not None:
            opcode, content = record
            if opcode == Opcode.FOOTER:
                self._end()
                return
            if opcode == Opcode.DATA_END:
                self._check_data(content, walk.crc)
            elif messages := self._record(opcode, content):
                yield messages
        if walk.cut is not None:
            if walk.cut.opcode == Opcode.CHUNK and (messages := self._salvage(walk.cut.content)):
                self.partial = True
                yield messages
            self.cut_off = True

    def _start(self) -> None:
        magic = self._file.read(len(MAGIC))
        if magic == MAGIC or (magic and len(magic) < len(MAGIC) and MAGIC.startswith(magic)):
            return
        if not magic:
            raise StreamError(self._name, "an empty file", self._expected)
        # A pipe that was joined late begins anywhere.
        if self._on_damage is None or not find_chunk(self._file, self._limits):
            raise StreamError(self._name, "a file that is not MCAP", self._expected)
        self._report("no start of a file: it was joined late, or its start is damaged")

    def _record(self, opcode: int, content: bytes) -> list[TopicMessage]:
        """The messages of a chunk, or of one outside of chunks; notes channels on the way."""
        try:
            if opcode == Opcode.CHUNK:
                return self._chunk(content)
            if opcode == Opcode.CHANNEL:
                self._declared.add(parse_channel(content))
            elif opcode == Opcode.SCHEMA:
                self._declared.add(parse_schema(content))
            elif opcode == Opcode.METADATA:
                self._declared.note(content)
            elif opcode == Opcode.MESSAGE:
                message = parse_message(content)
                self._last_time_ns = message.log_time
                topic = self._declared.topic(message)
                return [(topic, message)] if topic else []
        except RecordError as error:
            self._report(str(error))
        return []

    def _chunk(self, content: bytes) -> list[TopicMessage]:
        times = None
        try:
            head, data = parse_chunk(content, self._limits)
            times = (head.start_ns, head.end_ns)
            return self._messages(unpack(head, data, self._limits))
        except FramingError as error:
            self._report(str(error))
            self._file.give_back(content)
            find_chunk(self._file, self._limits)
        except RecordError as error:
            self._report(str(error), times, self._declared.numbers)
        return []

    def _messages(self, data: bytes, *, whole: bool = True) -> list[TopicMessage]:
        messages = []
        for item in chunk_records(data, whole=whole):
            if isinstance(item, Channel | Schema):
                self._declared.add(item)
            elif topic := self._declared.topic(item):
                messages.append((topic, item))
        if messages:
            self._last_time_ns = messages[-1][1].log_time
        return messages

    def _salvage(self, content: bytes) -> list[TopicMessage]:
        """What is there of a chunk that breaks off. Its checksum is lost; decoders find damage."""
        try:
            head, data = parse_chunk(content, self._limits, whole=False)
            return self._messages(unpack(head, data, self._limits, whole=False), whole=False)
        except RecordError:
            return []

    def _check_data(self, content: bytes, checksum: int) -> None:
        """Compare the checksum of all that was read, which finds what no chunk's own does."""
        expected = int.from_bytes(content[:4], "little")
        if expected and expected != checksum and not self._damaged:
            self._report("data whose checksum is wrong, somewhere outside of chunks")

    def _end(self) -> None:
        magic = self._file.read(len(MAGIC))
        if MAGIC.startswith(magic) and magic != MAGIC:
            self.cut_off = True
        elif magic != MAGIC:
            self._report("a damaged end")
        elif self._index_damage:
            self._report(f"a damaged index: {self._index_damage}")

    def _report(
        self, what: str, times_ns: tuple[int, int] | None = None, channels: list[int] | None = None
    ) -> None:
        self._damaged = True
        where = self._name
        if times_ns is not None:
            topics = sorted(self._declared.topics_of(channels or ()))
            others = f" and {len(topics) - 1} more topics" if len(topics) > 1 else ""
            named = f"{topics[0]}{others} " if topics else ""
            where += f": {named}at {times_ns[0] / 1e9:.3f}..{times_ns[1] / 1e9:.3f} s"
        elif self._last_time_ns is not None:
            where += f": after {self._last_time_ns / 1e9:.3f} s"
        error = StreamError(where, f"damage ({what})", self._expected)
        if self._on_damage is None:
            raise error
        self._on_damage(error)


def _compare(head: ChunkHead, index: ChunkIndex) -> None:
    said = (index.message_start_time, index.message_end_time, index.uncompressed_size, index.compression)
    if said != (head.start_ns, head.end_ns, head.size, head.compression):
        raise RecordError("a chunk that differs from its index")

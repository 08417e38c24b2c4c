"""An MCAP file as a sequence of chunks of messages: by its index, or from front to back."""

from __future__ import annotations

import io
from bisect import bisect_left
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Message, MessageIndex, Schema

from mvcodec.container.declared import Declared
from mvcodec.container.exact_file import ExactFile
from mvcodec.container.file_index import FileIndex, read_index
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.record_walk import RecordWalk
from mvcodec.container.records import (
    DAMAGE,
    MAGIC,
    ChunkHead,
    CutOff,
    FramingError,
    RecordError,
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

TopicMessage = tuple[str, Message]
OnDamage = Callable[[StreamError], None]


class ChunkReader:
    """Reads chunk by chunk, each as its messages in file order.

    Args:
        file: binary input, which may be a pipe.
        name: what to call it in messages.
        limits: what is more than that is refused.
        on_damage: told of damage, behind which reading goes on; None raises it.

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
    ) -> None:
        self._file = ExactFile(file)
        self._name, self._limits, self._on_damage = name, limits, on_damage
        self._declared = Declared()
        self._last_time_ns: int | None = None
        self._damaged = False
        self._index_damage = ""
        self.cut_off = self.partial = False
        self._index = self._read_index() if file.seekable() else None
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

    def schema_of(self, topic: str) -> tuple[str, str]:
        """Name of the schema and message encoding of a topic seen so far; empty where there is none."""
        return self._declared.schema_of(topic)

    def chunks(self, first: int = 0, end_ns: int | None = None) -> Iterator[list[TopicMessage]]:
        """The chunks in file order; if the file is indexed, from chunk `first` and before a time."""
        if self._index is None:
            return self._streamed()
        return self._indexed(
            [c for c in self._index.chunks[first:] if end_ns is None or c.message_start_time < end_ns]
        )

    def chunk_at(self, time_ns: int) -> int:
        """The first chunk of an indexed file that does not end before a time."""
        assert self._index is not None
        return bisect_left(self._index.chunks, time_ns, key=lambda chunk: chunk.message_end_time)

    def times(self, topic: str) -> list[int]:
        """Log times of a topic's messages in an indexed file, ascending, ns."""
        assert self._index is not None
        numbers = self._declared.numbers_of(topic)
        times: list[int] = []
        for chunk in self._index.chunks:
            for number in numbers:
                if (offset := chunk.message_index_offsets.get(number)) is not None:
                    times += self._indexed_times(offset)
        return sorted(times)

    def _indexed_times(self, offset: int) -> list[int]:
        self._file.seek(offset)
        try:
            record = read_record(self._file, self._limits)
            if record is None or record[0] != Opcode.MESSAGE_INDEX:
                raise RecordError("no message index where the index says")
            index = MessageIndex.read(ReadDataStream(io.BytesIO(record[1])))
        except (RecordError, CutOff, *DAMAGE) as error:
            raise StreamError(self._name, f"a damaged index ({error})", EXPECTED) from None
        return [time_ns for time_ns, _ in index.records]

    def _read_index(self) -> FileIndex | None:
        index = None
        try:
            index = read_index(self._file, self._limits)
        except RecordError as error:  # the data may be whole: they are read from front to back
            self._index_damage = str(error)
        self._file.seek(0)
        return index

    def _indexed(self, chunks: list[ChunkIndex]) -> Iterator[list[TopicMessage]]:
        for index in chunks:
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
                continue
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
            raise StreamError(self._name, "an empty file", EXPECTED)
        # A pipe that was joined late begins anywhere.
        if self._on_damage is None or not find_chunk(self._file, self._limits):
            raise StreamError(self._name, "a file that is not MCAP", EXPECTED)
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
        error = StreamError(where, f"damage ({what})", EXPECTED)
        if self._on_damage is None:
            raise error
        self._on_damage(error)


def _compare(head: ChunkHead, index: ChunkIndex) -> None:
    said = (index.message_start_time, index.message_end_time, index.uncompressed_size, index.compression)
    if said != (head.start_ns, head.end_ns, head.size, head.compression):
        raise RecordError("a chunk that differs from its index")

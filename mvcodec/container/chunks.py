"""An MCAP file as a sequence of chunks of messages: by its index, or from front to back."""

from __future__ import annotations

import io
import struct
import warnings
from bisect import bisect_left
from collections.abc import Iterator
from typing import IO, BinaryIO, cast

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, InvalidMagic, McapError
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, McapRecord, Message, MessageIndex
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.summary import Summary
from mcap.writer import MCAP0_MAGIC

from mvcodec.errors import MvCodecWarning, StreamError

MAX_RECORD_BYTES = 1 << 30
"""The largest record, packed or unpacked, that is read; a larger one is taken for damage."""

EXPECTED = "an MCAP file written by mvcodec"

# What the MCAP library, struct and zstandard raise on damaged bytes (a failed CRC is a ValueError).
_DAMAGE = (McapError, ValueError, struct.error, zstandard.ZstdError, KeyError)

TopicMessage = tuple[str, Message]


class ChunkReader:
    """Reads chunk by chunk, each as its messages in file order.

    Args:
        file: binary input, which may be a pipe.
        name: what to call it in messages.

    Raises (also while iterating):
        StreamError: not an MCAP file, or a damaged one.
    """

    def __init__(self, file: BinaryIO, name: str) -> None:
        self._file = ExactFile(file)
        self._name = name
        self._channels: dict[int, Channel] = {}
        self._last_time_ns: int | None = None
        self._summary = self._read_summary() if file.seekable() else None
        if self._summary is not None:
            self._channels.update(self._summary.channels)
            self._index = sorted(self._summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)

    @property
    def indexed(self) -> bool:
        """Whether the file is complete, with an index; otherwise it is read once, front to back."""
        return self._summary is not None

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
        return {channel.topic for channel in self._channels.values()}

    def chunks(self, first: int = 0) -> Iterator[list[TopicMessage]]:
        """The chunks in file order; from chunk `first`, if the file is indexed.

        Where an input that is not indexed breaks off, one MvCodecWarning says at what time.
        """
        return self._indexed(first) if self.indexed else self._streamed()

    def chunk_at(self, time_ns: int) -> int:
        """The first chunk of an indexed file that does not end before a time."""
        return bisect_left(self._index, time_ns, key=lambda chunk: chunk.message_end_time)

    def times(self, topic: str) -> list[int]:
        """Log times of a topic's messages in an indexed file, ascending, ns."""
        numbers = [number for number, channel in self._channels.items() if channel.topic == topic]
        times: list[int] = []
        try:
            for chunk in self._index:
                for number in numbers:
                    if (offset := chunk.message_index_offsets.get(number)) is not None:
                        self._file.seek(offset + _RECORD_HEAD)
                        entries = MessageIndex.read(ReadDataStream(self._file.as_io()))
                        times += [time_ns for time_ns, _ in entries.records]
        except _DAMAGE as error:
            raise StreamError(self._name, f"a damaged index ({error})", EXPECTED) from None
        return sorted(times)

    def _read_summary(self) -> Summary | None:
        """The summary of a complete file; None where there is none to be read."""
        file = self._file
        summary = None
        if file.seek(0, io.SEEK_END) > 2 * len(MCAP0_MAGIC):
            file.seek(-len(MCAP0_MAGIC), io.SEEK_END)
            if file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC:
                file.seek(0)
                try:
                    summary = make_reader(file.as_io()).get_summary()
                except _DAMAGE:  # reading from front to back finds out what is wrong
                    summary = None
        file.seek(0)
        return summary if summary is not None and summary.chunk_indexes else None

    def _indexed(self, first: int) -> Iterator[list[TopicMessage]]:
        for index in self._index[first:]:
            self._file.seek(index.chunk_start_offset)
            reader = StreamReader(
                self._file.as_io(), skip_magic=True, emit_chunks=True, record_size_limit=MAX_RECORD_BYTES
            )
            try:
                record = next(reader.records)
            except _DAMAGE as error:
                raise self._damaged(error) from None
            yield self._messages(record)

    def _streamed(self) -> Iterator[list[TopicMessage]]:
        start = self._file.count
        reader = StreamReader(self._file.as_io(), emit_chunks=True, record_size_limit=MAX_RECORD_BYTES)
        try:
            for record in reader.records:
                if messages := self._messages(record):
                    yield messages
        except EndOfFile:
            if self._file.count == start:
                raise StreamError(self._name, "an empty file", EXPECTED) from None
            if self._last_time_ns is None:
                raise StreamError(self._name, "a file cut off before its first frame set", EXPECTED) from None
            text = f"{self._name}: cut off after {self._last_time_ns / 1e9:.3f} s; all before that is whole"
            warnings.warn(text, MvCodecWarning, stacklevel=2)
        except InvalidMagic:
            what = "a file that is not MCAP" if self._last_time_ns is None else "a damaged end"
            raise StreamError(self._name, what, EXPECTED) from None
        except _DAMAGE as error:
            raise self._damaged(error) from None

    def _messages(self, record: McapRecord) -> list[TopicMessage]:
        """The messages of a chunk (or one outside of chunks); notes channels on the way."""
        records = self._unpack(record) if isinstance(record, Chunk) else [record]
        messages = []
        for item in records:
            if isinstance(item, Channel):
                self._channels[item.id] = item
            elif isinstance(item, Message):
                if item.channel_id not in self._channels:
                    raise StreamError(self._name, f"a message of unknown channel {item.channel_id}", EXPECTED)
                messages.append((self._channels[item.channel_id].topic, item))
        if messages:
            self._last_time_ns = messages[-1][1].log_time
        return messages

    def _unpack(self, chunk: Chunk) -> list[McapRecord]:
        if chunk.compression not in ("", "zstd"):
            raise StreamError(self._name, f"chunks packed with {chunk.compression!r}", "zstd")
        try:
            size = chunk.uncompressed_size
            if chunk.compression == "zstd":  # which believes its own head, not the chunk's
                size = max(size, zstandard.frame_content_size(chunk.data))
            if size > MAX_RECORD_BYTES:
                raise StreamError(self._name, f"a chunk of {size} bytes", f"at most {MAX_RECORD_BYTES}")
            return breakup_chunk(chunk, validate_crc=True)
        except _DAMAGE as error:
            raise self._damaged(error) from None

    def _damaged(self, error: Exception) -> StreamError:
        at = "at its start" if self._last_time_ns is None else f"after {self._last_time_ns / 1e9:.3f} s"
        return StreamError(self._name, f"damage {at} ({str(error) or type(error).__name__})", EXPECTED)


_RECORD_HEAD = 9
"""Bytes of opcode and length before a record's content."""


class ExactFile:
    """A binary input whose `read` returns all that was asked for or raises EndOfFile.

    The MCAP library takes a short read for a whole one, and so trips over a cut file later,
    somewhere else. Counts the bytes that were read.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.count = 0

    def as_io(self) -> IO[bytes]:
        """This, as the MCAP library's annotations want it (it calls no more than is here)."""
        return cast("IO[bytes]", self)

    def read(self, size: int) -> bytes:
        """Exactly `size` bytes."""
        if size > MAX_RECORD_BYTES:
            raise McapError(f"a length of {size} bytes")
        data = self._file.read(size)
        self.count += len(data)
        while len(data) < size:  # an unbuffered pipe gives what it has
            more = self._file.read(size - len(data))
            if not more:
                raise EndOfFile
            self.count += len(more)
            data += more
        return data

    def seekable(self) -> bool:
        """Whether `seek` works."""
        return self._file.seekable()

    @property
    def size(self) -> int:
        """Bytes of a seekable file."""
        place = self._file.tell()
        size = self._file.seek(0, io.SEEK_END)
        self._file.seek(place)
        return size

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """As any file's."""
        return self._file.seek(offset, whence)

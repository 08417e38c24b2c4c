"""MCAP records: the framing of a file, and the messages inside a chunk (https://mcap.dev/spec)."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import lz4.frame
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Schema

from mvcodec.container.exact_file import ExactFile
from mvcodec.container.limits import Limits
from mvcodec.errors import MvCodecError

MAGIC = bytes((137, 77, 67, 65, 80, 48, 13, 10))

HEAD = struct.Struct("<BQ")
"""Opcode and length before a record's content."""

_CHUNK_HEAD = struct.Struct("<QQQII")
"""Start and end time, unpacked size, CRC, length of the name of the compression."""

_MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time."""

_CHANNEL_HEAD = struct.Struct("<HH")
"""Channel, schema."""

_SCHEMA_HEAD = struct.Struct("<H")

_LENGTH = struct.Struct("<I")
"""Before text, bytes and tables."""

Content = bytes | memoryview
"""Of a record, by itself or inside of its chunk."""

_ZSTD = b"\x04\x00\x00\x00zstd"
_ZSTD_AT = HEAD.size + _CHUNK_HEAD.size - 4
_ZSTD_HEAD_BYTES = _CHUNK_HEAD.size + 4 + 8
"""A zstd chunk's content before its data."""

_SCAN_BYTES = 1 << 16

_FIRST_RESERVED, _FIRST_PRIVATE = 0x10, 0x80
"""Opcodes between these are reserved by the format: found, they are damage."""

DAMAGE = (McapError, ValueError, struct.error, zstandard.ZstdError, KeyError)
"""What parsing raises on damaged bytes."""


PACKINGS = (b"", b"zstd", b"lz4")
"""How chunks may be packed."""


class UnknownPacking(MvCodecError):
    """A chunk packed in a way that mvcodec does not know. (Caught in this package.)"""


class RecordError(MvCodecError):
    """A record that cannot be what it says. (Caught in this package, which knows time and topic.)"""


class FramingError(RecordError):
    """A record whose length is wrong, so that what follows it is not where it says."""


class CutOff(MvCodecError):
    """The input ends inside a record.

    Attributes:
        opcode: of that record; None where that was not read yet.
        content: what is there of it.
    """

    def __init__(self, opcode: int | None = None, content: bytes = b"") -> None:
        super().__init__("the input ends inside a record")
        self.opcode, self.content = opcode, content


def read_record(file: ExactFile, limits: Limits) -> tuple[int, bytes] | None:
    """Opcode and content of the next record; an attachment's content is skipped (empty).

    Returns:
        None at the end of the input.

    Raises:
        RecordError: no record of MCAP begins here, or one beyond the limits.
        CutOff: the input ends inside it.
    """
    head = file.read(HEAD.size)
    if not head:
        return None
    if len(head) < HEAD.size:
        raise CutOff
    opcode, size = HEAD.unpack(head)
    if not opcode or _FIRST_RESERVED <= opcode < _FIRST_PRIVATE:
        file.give_back(head[1:])
        raise RecordError(f"no record of kind {opcode}")
    if opcode == Opcode.ATTACHMENT or opcode >= _FIRST_PRIVATE:
        if not file.skip(size):
            raise CutOff(opcode)
        return opcode, b""
    if size > limits.max_record_bytes:
        file.give_back(head[1:])
        raise RecordError(f"a record of {size} bytes, more than max_record_bytes = {limits.max_record_bytes}")
    content = file.read(size)
    if len(content) < size:
        raise CutOff(opcode, content)
    return opcode, content


def find_chunk(file: ExactFile, limits: Limits) -> bool:
    """Look for the start of the next zstd chunk and leave the input there; False where there is none."""
    window = b""
    while True:
        piece = file.read(_SCAN_BYTES)
        window += piece
        at = window.find(_ZSTD)
        while at >= 0:
            start = at - _ZSTD_AT
            if len(window) < at + len(_ZSTD) + 8 and piece:
                break  # its length lies in the next piece
            if start >= 0 and _is_chunk(window, start, limits):
                file.give_back(window[start:])
                return True
            at = window.find(_ZSTD, at + 1)
        if not piece:
            return False
        window = window[-(_ZSTD_AT + len(_ZSTD) + 8) :] if at < 0 else window[max(at - _ZSTD_AT, 0) :]


def _is_chunk(window: bytes, start: int, limits: Limits) -> bool:
    opcode, size = HEAD.unpack_from(window, start)
    place = start + HEAD.size + _ZSTD_HEAD_BYTES
    if opcode != Opcode.CHUNK or size > limits.max_record_bytes or place > len(window):
        return False
    return bool(struct.unpack_from("<Q", window, place - 8)[0] == size - _ZSTD_HEAD_BYTES)


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """What a chunk says about itself before its data.

    Attributes:
        start_ns, end_ns: times of its first and last message.
        size: unpacked, bytes.
        crc: CRC-32 of the unpacked data; 0 where there is none.
        compression: "", "zstd" or "lz4".
    """

    start_ns: int
    end_ns: int
    size: int
    crc: int
    compression: str


def parse_chunk(content: bytes, limits: Limits, *, whole: bool = True) -> tuple[ChunkHead, memoryview]:
    """Head and packed data (inside of `content`) of a chunk; with `whole` false, of one that breaks off.

    Raises:
        FramingError: its length is wrong.
        RecordError: a chunk beyond the limits.
        UnknownPacking: it is packed in a way that mvcodec doesn't know.
    """
    if len(content) < _CHUNK_HEAD.size:
        raise RecordError("a chunk that ends too early")
    start_ns, end_ns, size, crc, length = _CHUNK_HEAD.unpack_from(content)
    name = content[_CHUNK_HEAD.size : _CHUNK_HEAD.size + length]
    if not whole and len(name) < length:
        raise RecordError("a chunk that ends too early")
    if name not in PACKINGS:
        raise UnknownPacking(f"chunks packed with {name[:20].decode(errors='replace')!r}")
    if size > limits.max_chunk_bytes:
        raise RecordError(f"a chunk of {size} bytes, more than max_chunk_bytes = {limits.max_chunk_bytes}")
    at = _CHUNK_HEAD.size + len(name)
    data = memoryview(content)[at + 8 :]
    if whole and content[at : at + 8] != struct.pack("<Q", len(data)):
        raise FramingError("a chunk whose lengths disagree")
    return ChunkHead(start_ns, end_ns, size, crc, name.decode()), data


def unpack(head: ChunkHead, packed: memoryview, limits: Limits, *, whole: bool = True) -> bytes:
    """The records of a chunk; with `whole` false, those of a chunk that breaks off.

    Raises:
        RecordError: the data are damaged, or larger than they say.
    """
    if head.compression == "zstd":
        data = _decompress(packed, head.size, limits, whole=whole)
    elif head.compression == "lz4":
        data = _decompress_lz4(packed, head.size)
    else:
        data = bytes(packed)
    if whole and len(data) != head.size:
        raise RecordError(f"a chunk of {len(data)} bytes that announces {head.size}")
    if whole and head.crc and zlib.crc32(data) != head.crc:
        raise RecordError("a chunk whose checksum is wrong")
    return data


def _decompress(data: memoryview, size: int, limits: Limits, *, whole: bool) -> bytes:
    try:
        announced = zstandard.frame_content_size(data) if whole else -1
        if announced > limits.max_chunk_bytes:
            raise RecordError(
                f"a chunk of {announced} bytes, more than max_chunk_bytes = {limits.max_chunk_bytes}"
            )
        # The window is bounded too: it may be larger than what it unpacks to.
        unpacker = zstandard.ZstdDecompressor(max_window_size=1 << 27)
        if announced == size:
            return unpacker.decompress(data)  # at once, without a window's memory
        with unpacker.stream_reader(io.BytesIO(data)) as stream:
            return stream.read(size + 1)
    except zstandard.ZstdError as error:
        raise RecordError(f"a chunk that cannot be unpacked: {error}") from None


def _decompress_lz4(data: memoryview, size: int) -> bytes:
    """At most one byte more than announced, whatever the data would unpack to."""
    unpacker = lz4.frame.LZ4FrameDecompressor()
    try:
        return bytes(unpacker.decompress(data, max_length=size + 1))
    except RuntimeError as error:
        raise RecordError(f"a chunk that cannot be unpacked: {error}") from None


def chunk_places(data: bytes, *, whole: bool = True) -> Iterator[tuple[int, memoryview, int]]:
    """Opcode, content (inside of `data`) and offset of each record of an unpacked chunk.

    Raises:
        RecordError: the end is inside a record; with `whole` false, that ends it.
    """
    at, within = 0, memoryview(data)
    while at + HEAD.size <= len(data):
        opcode, size = HEAD.unpack_from(data, at)
        end = at + HEAD.size + size
        if end > len(data):
            break
        yield opcode, within[at + HEAD.size : end], at
        at = end
    if whole and at < len(data):
        raise RecordError("a chunk that ends inside a record")


def chunk_records(data: bytes, *, whole: bool = True) -> Iterator[Schema | Channel | Message]:
    """The schemas, channels and messages of an unpacked chunk.

    Raises:
        RecordError: a record is damaged; with `whole` false, the end is only where it breaks off.
    """
    for opcode, content, _ in chunk_places(data, whole=whole):
        if opcode == Opcode.CHANNEL:
            yield parse_channel(content)
        elif opcode == Opcode.SCHEMA:
            yield parse_schema(content)
        elif opcode == Opcode.MESSAGE:
            yield parse_message(content)


def parse_channel(content: Content) -> Channel:
    """A channel record."""
    try:
        number, schema = _CHANNEL_HEAD.unpack_from(content)
        topic, at = _text(content, _CHANNEL_HEAD.size)
        encoding, at = _text(content, at)
        (length,) = _LENGTH.unpack_from(content, at)
        end, metadata, at = at + _LENGTH.size + length, dict[str, str](), at + _LENGTH.size
        while at < end:
            key, at = _text(content, at)
            metadata[key], at = _text(content, at)
    except DAMAGE as error:
        raise RecordError(f"a damaged channel ({error})") from None
    return Channel(number, topic, encoding, metadata, schema)


def parse_schema(content: Content) -> Schema:
    """A schema record."""
    try:
        (number,) = _SCHEMA_HEAD.unpack_from(content)
        name, at = _text(content, _SCHEMA_HEAD.size)
        encoding, at = _text(content, at)
        data, _ = _bytes(content, at)
    except DAMAGE as error:
        raise RecordError(f"a damaged schema ({error})") from None
    return Schema(number, data, encoding, name)


def parse_message(content: Content) -> Message:
    """A message record."""
    if len(content) < _MESSAGE_HEAD.size:
        raise RecordError(f"a message of {len(content)} bytes")
    channel, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(content)
    return Message(channel, log_time, bytes(content[_MESSAGE_HEAD.size :]), publish_time, sequence)


def _bytes(content: Content, at: int) -> tuple[bytes, int]:
    """Bytes behind their length, and the offset behind them."""
    (length,) = _LENGTH.unpack_from(content, at)
    start, end = at + _LENGTH.size, at + _LENGTH.size + length
    if end > len(content):
        raise ValueError("it ends too early")
    return bytes(content[start:end]), end


def _text(content: Content, at: int) -> tuple[str, int]:
    data, end = _bytes(content, at)
    return str(data, "utf-8"), end

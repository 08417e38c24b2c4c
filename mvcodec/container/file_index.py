"""The index at the end of a complete MCAP file."""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass, field

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema

from mvcodec.container.exact_file import ExactFile
from mvcodec.container.limits import Limits
from mvcodec.container.records import DAMAGE, HEAD, MAGIC, RecordError, parse_channel, parse_schema

_FOOTER = struct.Struct("<QQI")
"""Start of the summary, start of its offsets, CRC of the summary up to this field."""

_OFFSET = struct.Struct("<Q")

_TAIL_BYTES = HEAD.size + _FOOTER.size + len(MAGIC)
_CRC_BYTES = 4


@dataclass(frozen=True, slots=True)
class FileIndex:
    """What the summary says.

    Attributes:
        channels: by number.
        schemas: by number.
        chunks: in the order of the file.
        metadata: where the metadata records are, in the order of the file.
    """

    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    metadata: list[int] = field(default_factory=list)


def read_index(file: ExactFile, limits: Limits) -> FileIndex | None:
    """The index of a file that ends as a complete one does; None where it doesn't, or has no index.

    Raises:
        RecordError: the index is damaged.
    """
    size = file.size
    if size < len(MAGIC) + _TAIL_BYTES:
        return None
    file.seek(size - _TAIL_BYTES)
    tail = file.read(_TAIL_BYTES)
    if tail[-len(MAGIC) :] != MAGIC:
        return None
    start, crc = _footer(tail)
    if start == 0:
        return None
    length = size - _TAIL_BYTES - start
    if not 0 <= length <= limits.max_index_bytes:
        raise RecordError(
            f"an index of {length} bytes, expected at most max_index_bytes = {limits.max_index_bytes}"
        )
    file.seek(start)
    summary = file.read(length)
    if crc and zlib.crc32(tail[: HEAD.size + _FOOTER.size - _CRC_BYTES], zlib.crc32(summary)) != crc:
        raise RecordError("an index whose checksum is wrong")
    return _parse(summary, start)


def _footer(tail: bytes) -> tuple[int, int]:
    opcode, length = HEAD.unpack_from(tail)
    if opcode != Opcode.FOOTER or length != _FOOTER.size:
        raise RecordError("a damaged footer")
    start, _, crc = _FOOTER.unpack_from(tail, HEAD.size)
    return start, crc


def _parse(summary: bytes, end: int) -> FileIndex | None:
    """The index in a summary that begins at offset `end`."""
    index = FileIndex()
    at = 0
    while at + HEAD.size <= len(summary):
        opcode, length = HEAD.unpack_from(summary, at)
        at += HEAD.size
        content = summary[at : at + length]
        if len(content) < length:
            raise RecordError("an index that ends too early")
        at += length
        if opcode == Opcode.CHANNEL:
            channel = parse_channel(content)
            index.channels[channel.id] = channel
        elif opcode == Opcode.SCHEMA:
            schema = parse_schema(content)
            index.schemas[schema.id] = schema
        elif opcode == Opcode.CHUNK_INDEX:
            index.chunks.append(_chunk_index(content, end))
        elif opcode == Opcode.METADATA_INDEX and len(content) >= _OFFSET.size:
            index.metadata.append(_OFFSET.unpack_from(content)[0])
    index.chunks.sort(key=lambda chunk: chunk.chunk_start_offset)
    return index if index.chunks else None


def _chunk_index(content: bytes, end: int) -> ChunkIndex:
    try:
        chunk: ChunkIndex = ChunkIndex.read(ReadDataStream(io.BytesIO(content)))
    except DAMAGE as error:
        raise RecordError(f"a damaged index ({error})") from None
    if chunk.chunk_start_offset + chunk.chunk_length > end:
        raise RecordError("an index of chunks that lie behind it")
    return chunk

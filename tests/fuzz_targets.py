"""What fuzzing feeds: each takes any bytes and must come back, with an MvCodecError inside at most."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from mvcodec.capture.recording import Recording
from mvcodec.capture.recording_settings import RecordingSettings
from mvcodec.conformance.file_check import FileCheck
from mvcodec.conformance.unit_rules import UnitRules
from mvcodec.container import McapReader
from mvcodec.container.exact_file import ExactFile
from mvcodec.container.limits import Limits
from mvcodec.container.records import MAGIC, parse_chunk, read_record, unpack
from mvcodec.errors import MvCodecError
from mvcodec.stream import StreamHeader, TrackKind
from mvcodec.video.codecs import CODECS

CORPUS = Path(__file__).parent / "fuzz_corpus"
LIMITS = Limits(max_record_bytes=1 << 24, max_chunk_bytes=1 << 24)
_CHUNK = 6
SEED_BYTES = 16_000


class _Pipe(io.BytesIO):
    def seekable(self) -> bool:
        return False


def _ignore(_: object) -> None:
    """Damage that reading goes on behind."""


def read(data: bytes) -> None:
    """A file, by its index and from front to back."""
    for source in (io.BytesIO(data), _Pipe(data)):
        for on_damage in (None, _ignore):
            with suppress(MvCodecError), McapReader(source, "fuzz", LIMITS, on_damage) as reader:
                for _ in reader.packets():
                    pass
            source.seek(0)


def read_chunk(data: bytes) -> None:
    """Records inside a chunk, where no checksum keeps damage out."""
    head = struct.pack("<QQQII", 0, 0, len(data), 0, 0) + struct.pack("<Q", len(data))
    record = struct.pack("<BQ", _CHUNK, len(head) + len(data)) + head + data
    content = MAGIC + record + struct.pack("<BQI", 0x0F, 4, 0) + struct.pack("<BQQQI", 2, 20, 0, 0, 0) + MAGIC
    read(content)
    check(content)
    topics = RecordingSettings((("/camera/r00_c00/video",),))
    with suppress(MvCodecError):
        list(Recording(io.BytesIO(content), "fuzz", topics, LIMITS).frame_sets())


def check(data: bytes) -> None:
    """A file's container, record by record."""
    for _ in FileCheck(io.BytesIO(data), LIMITS).messages():
        pass


def parse_header(data: bytes) -> None:
    """A header."""
    with suppress(MvCodecError):
        LIMITS.check_header(StreamHeader.from_json(data), "fuzz")


def parse_nal(data: bytes) -> None:
    """Access units, the first of them a keyframe."""
    for codec in CODECS.values():
        checker = UnitRules(codec, TrackKind.TEXTURE, (64, 48))
        for keyframe in (True, False, None):
            list(checker.push(data, keyframe))


TARGETS: dict[str, Callable[[bytes], None]] = {
    "reader": read,
    "chunk": read_chunk,
    "check": check,
    "header": parse_header,
    "nal": parse_nal,
}


def seeds(target: str) -> Iterator[bytes]:
    """Undamaged input, from the conformance files."""
    for path in sorted((CORPUS.parent / "conformance").glob("*.mcap")):
        content = path.read_bytes()
        if target in ("reader", "check"):
            yield content[:SEED_BYTES]
            continue
        with McapReader(io.BytesIO(content)) as reader:
            packets = [packet for _, packet in reader.packets()]
        if target == "header":
            yield packets[0].data
        elif target == "nal":
            yield from (packet.data for packet in packets[1:4])
        else:
            yield _unpacked(content)


def _unpacked(content: bytes) -> bytes:
    """The records of a file's first chunk."""
    file = ExactFile(io.BytesIO(content))
    file.read(len(MAGIC))
    while (record := read_record(file, LIMITS)) is not None:
        if record[0] == _CHUNK:
            return unpack(*parse_chunk(record[1], LIMITS), LIMITS)
    raise AssertionError("a file without a chunk")

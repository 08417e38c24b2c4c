"""Files that were cut or damaged: found, told with topic and time, and the rest decodes."""

from __future__ import annotations

import io
import re
import resource
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any, BinaryIO, cast

import numpy as np
import pytest
import zstandard
from coding import encode, encoded_file, make_array
from damage import ARRAY, COUNT, GOP, Outcome, chunk_ends, outcome, small_file
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Chunk

from mvcodec.container import McapReader, McapWriter
from mvcodec.container.limits import Limits
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import SettingError, StreamError
from mvcodec.stream import Packet, StreamHeader

TINY_COUNT, TINY_GOP = 6, 2


@pytest.fixture(scope="module")
def file() -> bytes:
    return small_file()


@pytest.fixture(scope="module")
def tiny() -> bytes:
    """Frame sets so few that damaging them thousands of times takes a minute."""
    return small_file(TINY_COUNT, TINY_GOP)


def _check_cut(content: bytes, cut: int, gop: int = GOP) -> bool:
    """Look at what became of a cut file; returns whether anything was decoded."""
    ends = chunk_ends(content)
    for pipe in (False, True):
        found = outcome(content[:cut], pipe=pipe)
        whole = gop * sum(end <= cut for end in ends)
        assert found.frames == list(range(len(found.frames)))
        assert len(found.frames) >= whole, cut
        if found.error is None:
            (told,) = found.told
            assert f"cut off after {found.frames[-1] / 10:.3f} s" in told
        else:
            assert whole == 0
            assert re.search("cut off before its first frame set|empty file", str(found.error))
    return found.error is None


def test_a_file_cut_around_chunk_boundaries_decodes_up_to_there(file: bytes) -> None:
    for end in chunk_ends(file):
        for cut in (end - 1, end, end + 1, end + 9):
            _check_cut(file, cut)


def test_a_file_cut_within_the_head_of_a_chunk_decodes_up_to_there(tiny: bytes) -> None:
    summary = make_reader(io.BytesIO(tiny)).get_summary()
    assert summary is not None
    start = summary.chunk_indexes[1].chunk_start_offset
    for cut in range(start, start + 60):
        assert _check_cut(tiny, cut, TINY_GOP)


def test_a_file_cut_at_500_random_bytes_decodes_up_to_there(
    tiny: bytes, record_property: Callable[[str, object], None]
) -> None:
    cuts = np.random.default_rng(2).integers(0, len(tiny), 500)
    decoded = sum(_check_cut(tiny, int(cut), TINY_GOP) for cut in cuts)
    record_property("decoded", decoded)
    first = chunk_ends(tiny)[0]
    assert decoded >= np.count_nonzero(cuts >= first)


def test_frame_sets_in_a_chunk_that_breaks_off_are_not_lost() -> None:
    """Uncompressible video lies in the packed chunk as it is, block by block."""
    large = encoded_file(make_array(480, 300, fps=10.0), 5, qp=4)
    (end,) = chunk_ends(large)
    found = outcome(large[: end - 2000])
    assert found.error is None
    assert found.frames == list(range(len(found.frames)))
    assert len(found.frames) >= 3


def test_an_intact_file_tells_nothing(file: bytes) -> None:
    for pipe in (False, True):
        for on_error in ("stop", "skip"):
            assert outcome(file, on_error, pipe=pipe) == Outcome(list(range(COUNT)), [], None)


@pytest.mark.parametrize("pipe", [False, True])
@pytest.mark.parametrize("number", [0, 1, 3])
def test_a_damaged_chunk_is_skipped_to_the_next_keyframe_or_stops(
    file: bytes, number: int, pipe: bool
) -> None:
    broken = bytearray(file)
    ends = chunk_ends(file)
    broken[ends[number] - 200] ^= 1
    first = GOP * number
    lost = set(range(first, first + GOP))
    skipped = outcome(bytes(broken), "skip", pipe=pipe)
    assert skipped.error is None
    assert skipped.frames == [index for index in range(COUNT) if index not in lost]
    place = f"at {first / 10:.3f}..{(first + GOP - 1) / 10:.3f} s: found damage"
    assert any(place in told for told in skipped.told)
    if number and not pipe:
        assert "/camera/r00_c00/calibration and 7 more topics" in skipped.told[0]
    stopped = outcome(bytes(broken), "stop", pipe=pipe)
    assert stopped.frames == list(range(first))
    assert isinstance(stopped.error, StreamError)
    assert place in str(stopped.error)


def _check_flip(content: bytes, place: int, bit: int, count: int = COUNT) -> str:
    """What became of one flipped bit: 'told', 'harmless' or 'unreadable'."""
    broken = bytearray(content)
    broken[place] ^= 1 << bit
    found = outcome(bytes(broken), "skip", pipe=bool(bit % 2))
    assert found.frames == sorted(set(found.frames)), "in order, each once"
    assert set(found.frames) <= set(range(count))
    if found.error is not None:
        assert "\n" not in str(found.error)
        return "unreadable"
    if found.told:
        return "told"
    assert found.frames == list(range(count)), f"byte {place} bit {bit}: lost in silence"
    return "harmless"


def test_2000_flipped_bits_are_told_and_the_rest_decodes(
    tiny: bytes, record_property: Callable[[str, object], None]
) -> None:
    random = np.random.default_rng(4)
    places, bits = random.integers(0, len(tiny), 2000), random.integers(0, 8, 2000)
    outcomes = Counter(
        _check_flip(tiny, int(place), int(bit), TINY_COUNT) for place, bit in zip(places, bits, strict=True)
    )
    record_property("outcomes", dict(outcomes))
    assert outcomes["told"] > 1400, outcomes
    assert outcomes["unreadable"] < 40, "only where what says what the file is was hit"


def test_a_bit_in_any_field_outside_of_chunks_is_told_or_harmless(file: bytes) -> None:
    """Heads of chunks, message indexes, the start of the summary and the footer."""
    summary = make_reader(io.BytesIO(file)).get_summary()
    assert summary is not None
    index = summary.chunk_indexes[2]
    chunk = index.chunk_start_offset
    after = chunk + index.chunk_length
    places = [
        *range(chunk, chunk + 53, 3),
        *range(after, after + 60, 7),
        *range(len(file) - 37, len(file), 3),
    ]
    for number, place in enumerate(places):
        for bit in (number % 8, (number + 3) % 8):
            _check_flip(file, place, bit)


def test_a_damaged_index_costs_no_frame(file: bytes) -> None:
    broken = bytearray(file)
    broken[-60] ^= 1
    skipped = outcome(bytes(broken), "skip")
    assert skipped.frames == list(range(COUNT))
    assert "a damaged index: an index whose checksum is wrong" in skipped.told[0]
    stopped = outcome(bytes(broken), "stop")
    assert stopped.frames == list(range(COUNT))
    assert "a damaged index" in str(stopped.error)


def test_a_bit_flipped_before_the_container_saw_it_is_found_by_the_decoder() -> None:
    coded = encode(ARRAY, 12, gop=4, qp=20)
    packet = coded[5][0]
    damaged = replace(packet, data=packet.data[: len(packet.data) // 2])
    target = io.BytesIO()
    with McapWriter(target) as writer:
        for packets in coded:
            writer.push([damaged if p is packet else p for p in packets])
    skipped = outcome(target.getvalue(), "skip")
    assert skipped.frames == [0, 1, 2, 3, 4, 8, 9, 10, 11]
    assert "/camera/r00_c00/video at 0.500 s: found a damaged picture" in skipped.told[0]
    stopped = outcome(target.getvalue(), "stop")
    assert stopped.frames == [0, 1, 2, 3, 4]
    assert "/camera/r00_c00/video at 0.500 s" in str(stopped.error)


class _Recorder(io.RawIOBase):
    """A pipe that remembers what was written."""

    def __init__(self) -> None:
        self.content = bytearray()

    def write(self, data: Any, /) -> int:
        self.content += data
        return len(data)

    def writable(self) -> bool:
        return True


def test_a_pipe_that_is_joined_late_starts_at_the_next_keyframe() -> None:
    recorder = _Recorder()
    with McapWriter(cast("BinaryIO", recorder), chunk_ms=0) as writer:
        for packets in encode(ARRAY, COUNT, gop=GOP):
            writer.push(packets)
    content = bytes(recorder.content)
    for share in (0.15, 0.3, 0.4):
        found = outcome(content[int(share * len(content)) :], "skip", pipe=True)
        assert found.error is None
        assert found.frames[0] in (GOP, 2 * GOP, 3 * GOP)
        assert found.frames == list(range(found.frames[0], COUNT))


def _with_header(data: bytes) -> bytes:
    """A file whose header is other than its pictures are."""
    coded = encode(ARRAY, 1)
    target = io.BytesIO()
    with McapWriter(target) as writer:
        writer.push(coded[0])
        later = [replace(p, index=p.index + 10, time_ns=10**9) for p in coded[0]]
        writer.push([replace(later[0], data=data), *later[1:]])
    return target.getvalue()


def _header(packet: Packet, **changes: object) -> bytes:
    header = StreamHeader.from_json(packet.data)
    return replace(header, array=replace(header.array, **changes)).to_json()  # type: ignore[arg-type]


def test_headers_that_ask_for_too_much_are_refused_by_the_limits_name() -> None:
    packet = encode(ARRAY, 1)[0][0]
    everything = tuple(range(1024))
    for data, name in (
        (_header(packet, width=16384, height=16384), "pixels of a frame set"),
        (_header(packet, rows=1024, cols=2, real_rows=everything), "real cameras"),
        (b"[" * 100_000, "not JSON"),
        (b" " * (2 << 20) + packet.data, "max_header_bytes"),
    ):
        found = outcome(_with_header(data))
        assert found.frames == [0]
        assert found.error is not None
        assert name in str(found.error)
    with pytest.raises(StreamError, match=r"real cameras: found 2, expected at most max_cameras = 1"):
        Decoder.open(io.BytesIO(small_file(1)), limits=Limits(max_cameras=1))
    with pytest.raises(SettingError, match="max_views: found 0"):
        Limits(max_views=0)


def test_chunks_that_ask_for_too_much_are_refused_by_the_limits_name(file: bytes) -> None:
    chunk = chunk_ends(file)[1]
    summary = make_reader(io.BytesIO(file)).get_summary()
    assert summary is not None
    start = summary.chunk_indexes[1].chunk_start_offset
    claim = bytearray(file)
    claim[start + 9 + 16 : start + 9 + 24] = struct.pack("<Q", 1 << 44)
    found = outcome(bytes(claim), "skip")
    assert "17592186044416 bytes, more than max_chunk_bytes" in found.told[0]
    assert found.frames == [*range(GOP), *range(2 * GOP, COUNT)]
    length = bytearray(file)
    length[start + 1 : start + 9] = struct.pack("<Q", 1 << 50)
    for pipe in (False, True):
        found = outcome(bytes(length), "skip", pipe=pipe)
        assert any("more than max_record_bytes" in told for told in found.told)
        assert found.frames == [*range(GOP), *range(2 * GOP, COUNT)]
    assert chunk > start
    with pytest.raises(StreamError, match="more than max_chunk_bytes = 1000"):
        McapReader(io.BytesIO(file), limits=Limits(max_chunk_bytes=1000))


def test_a_bomb_of_zeros_is_refused_before_it_unpacks(file: bytes) -> None:
    bomb = zstandard.compress(bytes(1 << 30), 19)
    for claimed in (1 << 30, 1000):
        builder = RecordBuilder()
        Chunk("zstd", bomb, 0, 0, 0, claimed).write(builder)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        record = builder.end()  # type: ignore[no-untyped-call]
        found = outcome(file[:8] + record)
        assert found.error is not None
        assert "max_chunk_bytes" in str(found.error)
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300 << 10

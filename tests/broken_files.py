"""Files that break one rule each, for checkers."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace

from coding import encode, make_array
from damage import ARRAY, chunk_ends, small_file
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from mcap.reader import make_reader
from mcap.writer import Writer

from mvcodec.container import McapWriter
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, TrackKind
from mvcodec.video.annexb import nal_type, nal_units

Sets = list[list[Packet]]


def coded_sets(count: int = 12, gop: int = 4, fps: float = 10.0, codec: str = "h264") -> Sets:
    """Frame sets of two small cameras."""
    return encode(replace(ARRAY, fps=fps), count, gop=gop, qp=30, codec=codec)


def written(sets: Sequence[Sequence[Packet]]) -> bytes:
    """A file of them."""
    target = io.BytesIO()
    with McapWriter(target) as writer:
        for packets in sets:
            writer.push(packets)
    return target.getvalue()


def _flip(content: bytes, place: int, mask: int = 1) -> bytes:
    broken = bytearray(content)
    broken[place] ^= mask
    return bytes(broken)


def _wrong_statistics() -> bytes:
    """One message more in the statistics, with the summary's checksum made right."""
    content = bytearray(small_file())
    summary_start, _, _ = struct.unpack_from("<QQI", content, len(content) - 28)
    at = summary_start
    while content[at] != 0x0B:
        at += 9 + struct.unpack_from("<Q", content, at + 1)[0]
    count = struct.unpack_from("<Q", content, at + 9)[0]
    struct.pack_into("<Q", content, at + 9, count + 1)
    struct.pack_into("<I", content, len(content) - 12, zlib.crc32(content[summary_start:-12]))
    return bytes(content)


def _message_index_flip() -> bytes:
    content = small_file()
    return _flip(content, chunk_ends(content)[1] + 9 + 2 + 4 + 1)


def rewritten(content: bytes, change: Callable[[str, bytes, int], tuple[bytes, int] | None]) -> bytes:
    """A file once more, each message changed (data, log time) or left out."""
    target = io.BytesIO()
    writer = Writer(target, chunk_size=4000, use_summary_offsets=False)
    writer.start()
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    reader = make_reader(io.BytesIO(content))
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        assert schema is not None
        changed = change(channel.topic, message.data, message.log_time)
        if channel.topic not in channels:
            if schema.name not in schemas:
                schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.topic] = writer.register_channel(
                channel.topic, channel.message_encoding, schemas[schema.name]
            )
        if changed is not None:
            data, log_time = changed
            writer.add_message(channels[channel.topic], log_time, data, log_time, message.sequence)
    for header in reader.iter_metadata():
        writer.add_metadata(header.name, header.metadata)
    writer.finish()  # type: ignore[no-untyped-call]
    return target.getvalue()


def _in_video(change: Callable[[CompressedVideo], None], time_ns: int) -> bytes:
    """The file with one video message changed."""

    def changed(topic: str, data: bytes, log_time: int) -> tuple[bytes, int]:
        if topic == "/camera/r00_c01/video" and log_time == time_ns:
            video = CompressedVideo.FromString(data)
            change(video)
            data = video.SerializeToString()
        return data, log_time

    return rewritten(written(coded_sets()), changed)


def _without_sets(data: bytes) -> bytes:
    units = (unit for unit in nal_units(data) if nal_type(unit) not in (7, 8))
    return b"".join(b"\x00\x00\x00\x01" + unit for unit in units)


def _unit(change: Callable[[bytes], bytes], index: int) -> bytes:
    """The file with the first track's access unit of a frame set changed."""
    sets = coded_sets()
    place = next(n for n, packet in enumerate(sets[index]) if packet.track.kind is TrackKind.TEXTURE)
    sets[index][place] = replace(sets[index][place], data=change(sets[index][place].data))
    return written(sets)


def _without_set(index: int, codec: str = "h264") -> bytes:
    sets = coded_sets(codec=codec)
    del sets[index]
    return written(sets)


def _without_packet() -> bytes:
    sets = coded_sets()
    del sets[5][1]
    return written(sets)


def _swapped() -> bytes:
    sets = coded_sets()
    sets[5], sets[6] = sets[6], sets[5]
    return written(sets)


def _same_time() -> bytes:
    sets = coded_sets()
    sets[6] = [replace(packet, time_ns=sets[5][0].time_ns) for packet in sets[6]]
    return written(sets)


def _slow_keyframes() -> bytes:
    """Keyframes every fourth frame set, at two frame sets a second."""
    sets = coded_sets()
    return written([[replace(packet, time_ns=packet.time_ns * 5) for packet in packets] for packets in sets])


def _other_header() -> bytes:
    sets = coded_sets()
    header = StreamHeader.from_json(sets[4][0].data)
    sets[4][0] = replace(sets[4][0], data=replace(header, disparity_range_px=(0.0, 99.0)).to_json())
    return written(sets)


def _wrong_first_frame() -> bytes:
    sets = coded_sets()
    header = StreamHeader.from_json(sets[0][0].data)
    data = replace(header, first_frame=3).to_json()
    return written(
        [[replace(p, data=data) if p.track == HEADER_TRACK else p for p in packets] for packets in sets]
    )


def _two_pictures() -> bytes:
    sets = coded_sets()
    sets[6][0] = replace(sets[6][0], data=sets[6][0].data + sets[7][0].data)
    return written(sets)


def _other_size() -> bytes:
    sets = coded_sets()
    other = encode(make_array(64, 32, rows=1, cols=2), 12, gop=4)
    sets[4][1] = replace(sets[4][1], data=other[4][1].data)
    return written(sets)


def _drop_frame_id(video: CompressedVideo) -> None:
    video.frame_id = "somewhere"


def _other_format(video: CompressedVideo) -> None:
    video.format = "vp9"


def _stamp(video: CompressedVideo) -> None:
    video.timestamp.FromNanoseconds(1)


Broken = dict[str, tuple[Callable[[], bytes], str]]
"""Name -> the file, and the code of a finding that it must give."""

BROKEN_CONTAINERS: Broken = {
    "cut": (lambda: small_file()[: chunk_ends(small_file())[2] - 40], "cut-off"),
    "cut_in_summary": (lambda: small_file()[:-300], "cut-off"),
    "chunk": (lambda: _flip(small_file(), chunk_ends(small_file())[1] - 60), "chunk"),
    "message_index": (_message_index_flip, "message-index"),
    "summary": (lambda: _flip(small_file(), len(small_file()) - 90), "summary-crc"),
    "footer": (lambda: _flip(small_file(), len(small_file()) - 26), "footer"),
    "statistics": (_wrong_statistics, "summary"),
    "start": (lambda: b"\x88" + small_file()[1:], "magic"),
    "end": (lambda: small_file()[:-1] + b"\x0b", "magic"),
    "behind_the_end": (lambda: small_file() + b"more", "magic"),
}

BROKEN_STREAMS: Broken = {
    "missing_set": (lambda: _without_set(5), "missing-reference"),
    "missing_keyframe": (lambda: _without_set(4), "missing-reference"),
    "missing_set_hevc": (lambda: _without_set(5, "hevc"), "missing-reference"),
    "missing_keyframe_hevc": (lambda: _without_set(4, "hevc"), "missing-reference"),
    "missing_set_av1": (lambda: _without_set(5, "av1"), "missing-reference"),
    "missing_keyframe_av1": (lambda: _without_set(4, "av1"), "missing-reference"),
    "missing_packet": (_without_packet, "incomplete"),
    "out_of_order": (_swapped, "order"),
    "same_time": (_same_time, "order"),
    "slow_keyframes": (_slow_keyframes, "keyframe-interval"),
    "no_parameter_sets": (lambda: _unit(_without_sets, 0), "parameter-sets"),
    "no_start_code": (lambda: _unit(lambda data: data[4:], 5), "annex-b"),
    "no_keyframe": (lambda: _unit(lambda _: coded_sets()[5][0].data, 4), "keyframe"),
    "empty_unit": (lambda: _unit(lambda _: b"", 5), "one-picture"),
    "two_pictures": (_two_pictures, "one-picture"),
    "other_size": (_other_size, "size"),
    "other_header": (_other_header, "header"),
    "first_frame": (_wrong_first_frame, "header"),
    "frame_id": (lambda: _in_video(_drop_frame_id, 500_000_000), "frame-id"),
    "format": (lambda: _in_video(_other_format, 500_000_000), "format"),
    "stamp": (lambda: _in_video(_stamp, 500_000_000), "time"),
    "no_transforms": (
        lambda: rewritten(written(coded_sets()), lambda t, d, n: None if t == "/tf" else (d, n)),
        "topic",
    ),
    "calibration": (
        lambda: rewritten(
            written(coded_sets()), lambda t, d, n: (d[:-2] if t.endswith("calibration") else d, n)
        ),
        "schema",
    ),
    "times_go_back": (lambda: rewritten(written(coded_sets()), lambda _, d, n: (d, 2 * 10**9 - n)), "order"),
}

BROKEN = BROKEN_CONTAINERS | BROKEN_STREAMS

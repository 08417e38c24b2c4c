"""Recordings of two cameras that are not as they should be; pictures show their number."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import av
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema
from timed_videos import SIZE, numbered

START_NS = 1_700_000_000_000_000_000
STEP_NS = 33_333_333
TOPICS = ("/cam0", "/cam1")

Timed = tuple[str, Any, int, int]
"""Topic, message, log time and stamp, ns."""


def at(number: float) -> int:
    """When a picture of 30 a second is taken, ns."""
    return START_NS + round(number * STEP_NS)


def raw(number: int, camera: int) -> RawImage:
    """A picture as its pixels."""
    width, height = SIZE
    data = numbered(number, camera).tobytes()
    return RawImage(width=width, height=height, encoding="rgb8", step=3 * width, data=data)


def raws(numbers: Iterable[int], cameras: Sequence[int] = (0, 1)) -> list[Timed]:
    """Pictures of the cameras by turns, at their times."""
    return [(TOPICS[c], raw(n, c), at(n), at(n)) for n in numbers for c in cameras]


def units(count: int, camera: int, options: Mapping[str, str]) -> list[tuple[CompressedVideo, int]]:
    """(access unit, number of its picture) in coding order."""
    context = av.CodecContext.create("libx264", "w")
    context.width, context.height, context.pix_fmt = *SIZE, "yuv420p"
    context.time_base, context.framerate = Fraction(1, 30), Fraction(30)
    defaults = {"crf": "16", "preset": "ultrafast", "g": "8", "bf": "0", "sc_threshold": "0"}
    context.options = defaults | {"x264-params": "repeat-headers=1"} | dict(options)
    frames: list[av.VideoFrame | None] = []
    for number in range(count):
        frame = av.VideoFrame.from_ndarray(numbered(number, camera), format="rgb24")
        frame.pts, frame.time_base = number, context.time_base
        frames.append(frame)
    packets = [packet for frame in [*frames, None] for packet in context.encode(frame)]
    return [(CompressedVideo(data=bytes(packet), format="h264"), packet.pts or 0) for packet in packets]


def videos(
    count: int, lost: Iterable[tuple[int, int]] = (), options: Mapping[str, str] | None = None
) -> list[Timed]:
    """Both cameras' access units in coding order; logged in that order, stamped by presentation."""
    coded = [units(count, camera, options or {}) for camera in (0, 1)]
    found = []
    for place in range(count):
        for camera in (0, 1):
            message, number = coded[camera][place]
            if (camera, place) not in set(lost):
                found.append((TOPICS[camera], message, at(place), at(number)))
    return found


def written(
    messages: Iterable[Timed], compression: CompressionType = CompressionType.ZSTD, chunk_bytes: int = 1 << 20
) -> bytes:
    """An MCAP file of the messages in the order in which they are given."""
    target = io.BytesIO()
    writer = Writer(target, compression=compression, chunk_size=chunk_bytes)
    writer.start()
    channels: dict[str, int] = {}
    for topic, message, log_ns, stamp_ns in messages:
        if hasattr(message, "timestamp"):
            message.timestamp.FromNanoseconds(stamp_ns)
        if hasattr(message, "frame_id"):
            message.frame_id = message.frame_id or f"frame of {topic}"
        if topic not in channels:
            schema = register_schema(writer, type(message))
            channels[topic] = writer.register_channel(topic, "protobuf", schema)
        writer.add_message(channels[topic], log_ns, message.SerializeToString(), log_ns)
    writer.finish()  # type: ignore[no-untyped-call]
    return target.getvalue()

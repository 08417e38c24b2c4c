"""Pictures in anyone's MCAP recording: Foxglove's messages of video and images, topic by topic."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError
from mcap.records import Message

from mvcodec.container.chunks import ChunkReader, OnDamage, TopicMessage
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.recorded_rig import RecordedRig
from mvcodec.errors import StreamError

SCHEMAS: dict[str, Any] = {
    "foxglove.CompressedVideo": CompressedVideo,
    "foxglove.CompressedImage": CompressedImage,
    "foxglove.RawImage": RawImage,
}


@dataclass(frozen=True, slots=True, eq=False)
class RecordedPicture:
    """One message with a picture in it.

    Attributes:
        topic: of the message.
        time_ns: when the picture was taken: the message's own stamp, or its log time where it has none.
        schema: name, one of SCHEMAS.
        data: the coded picture, or the pixels.
        format: of the data, as the message says (for raw images its encoding).
        frame_id: as the message says.
        layout: (width, height, bytes a row) of raw images, else None.
    """

    topic: str
    time_ns: int
    schema: str
    data: bytes
    format: str
    frame_id: str
    layout: tuple[int, int, int] | None

    @property
    def label(self) -> str:
        """Topic and time, for messages."""
        return f"{self.topic} at {self.time_ns / 1e9:.3f} s"


class RecordingReader:
    """Reads the pictures of some topics in the order of the file.

    Args:
        file: binary input, which may be a pipe.
        name: what to call it in messages.
        topics: those that are wanted.
        limits: what is more than that is refused.
        on_damage: told of damage, behind which reading goes on; None raises it.

    Attributes:
        rig: what was read about cameras, up to the end of the chunk at hand; None: it is not wanted.

    Raises (also while iterating):
        StreamError: not MCAP, damaged, or a topic holds something other than pictures.
    """

    def __init__(
        self,
        file: BinaryIO,
        name: str,
        topics: Sequence[str],
        limits: Limits = DEFAULT_LIMITS,
        on_damage: OnDamage | None = None,
    ) -> None:
        self.name = name
        self._chunks = ChunkReader(file, name, limits, on_damage)
        self._topics = frozenset(topics)
        self.rig: RecordedRig | None = RecordedRig()
        if self._chunks.indexed:
            self._check_topics(self._chunks.topics)

    @property
    def cut_off(self) -> bool:
        """Whether the input broke off, which is known when `pictures` has ended."""
        return self._chunks.cut_off

    @property
    def fps(self) -> float | None:
        """Mean rate of the first topic in a complete file; None where it cannot be known yet."""
        if not self._chunks.indexed:
            return None
        times = self._chunks.times(min(self._topics))
        span_ns = times[-1] - times[0] if times else 0
        return (len(times) - 1) * 1e9 / span_ns if span_ns else None

    def pictures(self) -> Iterator[RecordedPicture]:
        """Every picture on the topics, in the order of the file."""
        for chunk in self._chunks.chunks():
            self._collect_rig(chunk)
            for topic, message in chunk:
                if topic in self._topics:
                    yield self._picture(topic, message)
        self._check_topics(self._chunks.topics)

    def _collect_rig(self, chunk: list[TopicMessage]) -> None:
        if self.rig is not None:
            for topic, message in chunk:
                if topic not in self._topics:
                    self.rig.push(self._chunks.schema_of(topic)[0], message.data)

    def _check_topics(self, there: set[str]) -> None:
        missing = sorted(self._topics - there)
        if missing:
            choices = [topic for topic in sorted(there) if self._chunks.schema_of(topic)[0] in SCHEMAS]
            expected = f"a topic with pictures: {', '.join(choices[:10]) or 'there is none'}"
            raise StreamError(self.name, f"no topic {missing[0]}", expected)

    def _picture(self, topic: str, message: Message) -> RecordedPicture:
        schema, encoding = self._chunks.schema_of(topic)
        label = f"{self.name}: {topic} at {message.log_time / 1e9:.3f} s"
        if schema not in SCHEMAS or encoding != "protobuf":
            raise StreamError(label, f"{schema or 'no schema'} as {encoding}", " or ".join(SCHEMAS))
        try:
            parsed = SCHEMAS[schema].FromString(message.data)
        except DecodeError as error:
            raise StreamError(label, f"a damaged message ({error})", schema) from None
        stamp = parsed.timestamp.seconds * 1_000_000_000 + parsed.timestamp.nanos
        raw = schema == "foxglove.RawImage"
        return RecordedPicture(
            topic=topic,
            time_ns=stamp if stamp > 0 else message.log_time,
            schema=schema,
            data=parsed.data,
            format=parsed.encoding if raw else parsed.format,
            frame_id=parsed.frame_id,
            layout=(parsed.width, parsed.height, parsed.step) if raw else None,
        )

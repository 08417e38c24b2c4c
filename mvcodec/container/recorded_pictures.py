"""Pictures in anyone's MCAP recording, topic by topic, in the order of their time where it has an index."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO, Literal

from mcap.records import Message

from mvcodec.container.chunk_reading import ChunkReader, OnDamage, TopicMessage
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.container.message_schema import DamagedMessage
from mvcodec.container.picture_schemas import (
    PictureKind,
    expected_instead,
    is_picture,
    looks_like_picture,
    picture_parser,
)
from mvcodec.container.recorded_rig import RecordedRig, is_about_rig
from mvcodec.container.time_order import in_time_order, was_set_back
from mvcodec.errors import StreamError

EXPECTED = "an MCAP recording"

Clock = Literal["stamp", "log"]
"""When a picture was taken: by its message's own stamp, or by when the message was written down."""

_RIG_CHUNKS = 16
"""Chunks that are looked into for each topic about cameras, before the pictures are read."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedPicture:
    """One message with a picture in it.

    Attributes:
        topic: of the message.
        time_ns: when the picture was taken, by the clock that was asked for.
        log_ns: when the message was written down.
        stamp_ns: its own stamp; 0 where it has none.
        kind, data, format, frame_id, layout, big_endian: as in PictureMessage.
    """

    topic: str
    time_ns: int
    log_ns: int
    stamp_ns: int
    kind: PictureKind
    data: bytes
    format: str
    frame_id: str
    layout: tuple[int, int, int] | None
    big_endian: bool

    @property
    def label(self) -> str:
        """Topic and time, for messages."""
        return f"{self.topic} at {self.time_ns / 1e9:.3f} s"


class RecordingReader:
    """Reads the pictures of some topics.

    Args:
        files: binary inputs, which may be pipes: the parts of one recording, in a row.
        name: what to call them in messages.
        topics: those that are wanted.
        clock: which time counts.
        limits: what is more than that is refused.
        on_damage: told of damage, behind which reading goes on; None raises it.

    Attributes:
        rig: what was read about cameras; of files without index, up to the end of the chunk at hand.
            None: it is not wanted any more.
        notes: what is unusual about the files, one line each.
        written_at_once: all messages (without an index: all so far) have one log time, which says nothing
            of a frame rate.

    Raises (also while iterating):
        StreamError: not MCAP, damaged, or a topic holds something other than pictures.
    """

    def __init__(
        self,
        files: Sequence[BinaryIO],
        name: str,
        topics: Sequence[str],
        clock: Clock = "stamp",
        limits: Limits = DEFAULT_LIMITS,
        on_damage: OnDamage | None = None,
    ) -> None:
        self.name, self._clock, self._on_damage = name, clock, on_damage
        self._parts = [ChunkReader(file, name, limits, on_damage, EXPECTED) for file in files]
        self._topics = frozenset(topics)
        self.rig: RecordedRig | None = RecordedRig()
        self.indexed = all(part.indexed for part in self._parts)
        self.notes: list[str] = []
        self._by_time = self.written_at_once = self._log_moved = False
        self._first_log: int | None = None
        self._times: dict[str, list[int]] = {}
        if self.indexed:
            self._check_topics({topic for part in self._parts for topic in part.topics})
            self._plan_order()
            self._look_for_rig()

    @property
    def cut_off(self) -> bool:
        """Whether the input broke off, which is known when `pictures` has ended."""
        return any(part.cut_off for part in self._parts)

    @property
    def log_times(self) -> dict[str, list[int]]:
        """Log times of each topic, ascending; empty where there is no index."""
        return self._times

    def pictures(self) -> Iterator[RecordedPicture]:
        """Every picture on the topics: by log time where the files have an index, else in their order."""
        for part in self._parts:
            messages = in_time_order(part, self._topics) if self._by_time else self._as_written(part)
            for topic, message in messages:
                if not self.indexed:
                    self._follow_log(message.log_time)
                picture = self._picture(part, topic, message)
                if picture is not None:
                    yield picture
        self._check_topics({topic for part in self._parts for topic in part.topics})

    def _follow_log(self, log_ns: int) -> None:
        self.written_at_once = self._first_log in (None, log_ns) and not self._log_moved
        self._log_moved = not self.written_at_once
        self._first_log = log_ns

    def _plan_order(self) -> None:
        count = 0
        for topic in self._topics:
            written = [time for part in self._parts for time in part.times_as_written(topic)]
            if was_set_back(written):
                self.notes.append(
                    f"the clock that {topic} was written down by was set back: its messages are taken in the"
                    " order of the file"
                )
            self._times[topic] = sorted(set(written))
            count = max(count, len(written))
        self.written_at_once = count > 1 and all(len(times) < 2 for times in self._times.values())
        self._by_time = not self.notes
        if self._by_time:
            self._parts.sort(key=lambda part: part.start_ns)

    def _look_for_rig(self) -> None:
        """Read what the files say about cameras, wherever it is."""
        assert self.rig is not None
        for part in self._parts:
            about = [topic for topic in part.topics if is_about_rig(part.schema_of(topic))]
            for topic in about:
                for chunk in part.chunks_with([topic])[:_RIG_CHUNKS]:
                    for found, message in part.read_chunk(chunk):
                        if found == topic:
                            self.rig.push(topic, part.schema_of(topic), message.data)

    def _as_written(self, part: ChunkReader) -> Iterator[TopicMessage]:
        for chunk in part.chunks():
            if self.rig is not None and not self.indexed:
                for topic, message in chunk:
                    if topic not in self._topics:
                        self.rig.push(topic, part.schema_of(topic), message.data)
            yield from (item for item in chunk if item[0] in self._topics)

    def _check_topics(self, there: set[str]) -> None:
        missing = sorted(self._topics - there)
        if missing:
            schemas = {topic: part.schema_of(topic) for part in self._parts for topic in part.topics}
            choices = [topic for topic in sorted(there) if is_picture(schemas[topic])]
            others = [t for t in sorted(there) if not choices and looks_like_picture(schemas[t])]
            listed = choices or [f"{topic} ({schemas[topic]}, which is not supported)" for topic in others]
            where = " before it is cut off" if self.cut_off else ""
            none = "a longer part of it" if self.cut_off else "there is none"
            expected = f"a topic with pictures: {', '.join(listed[:10]) or none}"
            raise StreamError(self.name, f"no topic {missing[0]}{where}", expected)

    def _picture(self, part: ChunkReader, topic: str, message: Message) -> RecordedPicture | None:
        schema = part.schema_of(topic)
        label = f"{self.name}: {topic} at {message.log_time / 1e9:.3f} s"
        if not is_picture(schema):
            raise StreamError(label, f"{schema}, which is not supported", expected_instead(schema))
        try:
            found = picture_parser(schema)(message.data)
        except DamagedMessage as error:
            damage = StreamError(label, f"a message that cannot be read ({error})", schema.name)
            if self._on_damage is None:
                raise damage from None
            self._on_damage(damage)
            return None
        by_stamp = self._clock == "stamp" and found.stamp_ns > 0
        return RecordedPicture(
            topic=topic,
            time_ns=found.stamp_ns if by_stamp else message.log_time,
            log_ns=message.log_time,
            stamp_ns=found.stamp_ns,
            kind=found.kind,
            data=found.data,
            format=found.format,
            frame_id=found.frame_id,
            layout=found.layout,
            big_endian=found.big_endian,
        )

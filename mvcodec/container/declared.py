"""What an MCAP file declares of its messages: channels and schemas, and metadata that repeats channels."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable

from mcap.data_stream import ReadDataStream
from mcap.records import Channel, Message, Metadata, Schema

from mvcodec.container.message_schema import MessageSchema
from mvcodec.container.records import DAMAGE, RecordError

METADATA_NAME = "mvcodec"

TOPICS_KEY = "topics"
"""In a metadata record: which topic each channel is, for readers that lack the first chunk."""

DROPPED_KEY = "dropped"
"""In a metadata record: how many frame sets a live encoder left out."""


class Declared:
    """Collects declarations as they come by.

    Attributes:
        facts: keys and values of our metadata records.
    """

    def __init__(self) -> None:
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._fallback: dict[int, str] = {}
        self.facts: dict[str, str] = {}

    @property
    def numbers(self) -> list[int]:
        """The channels."""
        return list(self._channels)

    @property
    def topics(self) -> set[str]:
        """The topics of all channels."""
        return self.topics_of(self._channels)

    def topics_of(self, numbers: Iterable[int]) -> set[str]:
        """The topics of some channels, as far as they are known."""
        return {self._channels[number].topic for number in numbers if number in self._channels}

    def numbers_of(self, topic: str) -> list[int]:
        """The channels of a topic."""
        return [number for number, channel in self._channels.items() if channel.topic == topic]

    def schema_of(self, topic: str) -> MessageSchema:
        """How a topic's messages are written; empty where nothing says so."""
        channel = next((channel for channel in self._channels.values() if channel.topic == topic), None)
        encoding = "" if channel is None else channel.message_encoding
        schema = None if channel is None else self._schemas.get(channel.schema_id)
        if schema is None:
            return MessageSchema("", encoding)
        return MessageSchema(schema.name, encoding, schema.encoding, schema.data)

    def add(self, record: Channel | Schema) -> None:
        """A channel or a schema."""
        if isinstance(record, Channel):
            self._channels[record.id] = record
        else:
            self._schemas[record.id] = record

    def topic(self, message: Message) -> str | None:
        """A message's topic; None where channels were lost and this one is not among those said twice.

        Raises:
            RecordError: nothing says anything of its channel.
        """
        channel = self._channels.get(message.channel_id)
        topic = self._fallback.get(message.channel_id) if channel is None else channel.topic
        if topic is None and not self._fallback:
            raise RecordError(f"a message of unknown channel {message.channel_id}")
        return topic

    def note(self, content: bytes) -> None:
        """A metadata record; another program's says nothing to us.

        Raises:
            RecordError: it is damaged.
        """
        try:
            record = Metadata.read(ReadDataStream(io.BytesIO(content)))
            if record.name != METADATA_NAME:
                return
            self.facts.update(record.metadata)
            if TOPICS_KEY in record.metadata:
                topics = json.loads(record.metadata[TOPICS_KEY])
                self._fallback = {int(number): str(topic) for number, topic in topics.items()}
        except (*DAMAGE, TypeError, AttributeError, RecursionError) as error:
            raise RecordError(f"damaged metadata ({error})") from None

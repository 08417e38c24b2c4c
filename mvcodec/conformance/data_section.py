"""What the data section of an MCAP file holds, and whether the summary behind it says the same."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    MetadataIndex,
    Schema,
    Statistics,
)

SUMMARY_RECORDS: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.STATISTICS: Statistics,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
}
"""Opcode -> the MCAP library's record, of what a summary may repeat."""


@dataclass(slots=True)
class DataSection:
    """What came by in the data section.

    Attributes:
        schemas, channels: by number.
        chunks, metadata: as the summary must index them, in order.
        counts: messages of each channel.
        times: first and last log time, ns.
        attachments: how many.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    counts: Counter[int] = field(default_factory=Counter)
    times: tuple[int, int] | None = None
    attachments: int = 0

    def count(self, channel: int, time_ns: int) -> None:
        """A message came by."""
        self.counts[channel] += 1
        first, last = self.times or (time_ns, time_ns)
        self.times = min(first, time_ns), max(last, time_ns)

    def differences(self, summary: Mapping[int, list[Any]]) -> Iterator[str]:
        """In what a summary differs from what came by.

        Args:
            summary: opcode -> its records in the summary, in order; None for a damaged one.
        """
        expected: dict[int, tuple[str, list[Any]]] = {
            Opcode.SCHEMA: ("schemas", sorted(self.schemas.values(), key=lambda record: record.id)),
            Opcode.CHANNEL: ("channels", sorted(self.channels.values(), key=lambda record: record.id)),
            Opcode.CHUNK_INDEX: ("chunk indexes", self.chunks),
            Opcode.METADATA_INDEX: ("metadata indexes", self.metadata),
            Opcode.STATISTICS: ("statistics", [self._statistics()]),
        }
        for opcode, (name, records) in expected.items():
            there = summary.get(opcode, [])
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                there = sorted((record for record in there if record), key=lambda record: record.id)
            if there != records:
                yield f"the {name} of the summary are not those of the file"
        if len(summary.get(Opcode.ATTACHMENT_INDEX, [])) != self.attachments:
            yield "the attachment indexes of the summary are not those of the file"

    def _statistics(self) -> Statistics:
        start, end = self.times or (0, 0)
        return Statistics(
            attachment_count=self.attachments,
            channel_count=len(self.channels),
            channel_message_counts=dict(self.counts),
            chunk_count=len(self.chunks),
            message_count=self.counts.total(),
            message_end_time=end,
            message_start_time=start,
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )

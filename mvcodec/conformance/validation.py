"""A file against the rules of FORMAT.md: container, messages, frame sets, access units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import BinaryIO, Protocol

from mvcodec.conformance.file_check import CheckedMessage, FileCheck
from mvcodec.conformance.finding import Finding, error, warning
from mvcodec.conformance.layer_check import LayerCheck
from mvcodec.conformance.message_check import MessageCheck, unknown_fields
from mvcodec.conformance.topic_check import POINTS, VIDEO
from mvcodec.conformance.topic_validation import TopicValidation
from mvcodec.conformance.unit_rules import UnitRules
from mvcodec.container.assembly import Assembler, PacketSet
from mvcodec.container.declared import METADATA_NAME
from mvcodec.container.limits import DEFAULT_LIMITS, Limits
from mvcodec.enhancement import LAYER_TRACK
from mvcodec.errors import InputError, StreamError
from mvcodec.stream import HEADER_TRACK, Packet, StreamHeader, Track
from mvcodec.video.codecs import CODECS
from mvcodec.video.map_size import track_sizes
from mvcodec.video.vp9_reference import unit_codec

MAX_FINDINGS = 1000
"""A file that is wrong everywhere is not described further than that."""

_SECOND_NS = 1_000_000_000
_TOPICS_NAMED = 5


class FileKind(StrEnum):
    """What a file is, which says what rules it must keep."""

    ARRAY = "array"
    """A file of FORMAT.md."""
    VIEWS = "views"
    """Video topics without our header, as decoding into the form mcap and others write."""
    POINTS = "points"
    """Point clouds, as `export-points` and others write."""


@dataclass(frozen=True, slots=True)
class Validation:
    """What was found.

    Attributes:
        kind: None: the file is nothing that there are rules for.
        findings: by time, those of the file as a whole first; empty for a clean file.
    """

    kind: FileKind | None
    findings: list[Finding]


def validate(path: Path, limits: Limits = DEFAULT_LIMITS) -> list[Finding]:
    """Everything in a file that is not as FORMAT.md has it; empty for a clean one.

    Raises:
        InputError: the system refuses to open it.
    """
    return examine(path, limits).findings


def examine(path: Path, limits: Limits = DEFAULT_LIMITS) -> Validation:
    """What a file is, and everything in it that is against the rules for such a file.

    Raises:
        InputError: the system refuses to open it.
    """
    try:
        with path.open("rb") as file:
            kind = _kind(file, limits)
            file.seek(0)
            check = FileCheck(file, limits)
            content = _CONTENTS[kind](str(path), limits)
            for message in check.messages():
                content.push(message)
                if len(check.findings) + len(content.findings) > MAX_FINDINGS:
                    break
            else:
                content.end(check)
    except OSError as failure:
        raise InputError(path, failure.strerror, "a file that can be read") from None
    findings = [*check.findings, *content.findings]
    return Validation(kind, sorted(findings, key=lambda f: -1 if f.time_ns is None else f.time_ns))


def _kind(file: BinaryIO, limits: Limits) -> FileKind | None:
    """What a file is, by the topics that it names; ours may be damaged up to a header far behind."""
    check = FileCheck(file, limits)
    for message in check.messages():
        if message.topic == HEADER_TRACK.topic:
            return FileKind.ARRAY
        if check.indexed or len(check.findings) > MAX_FINDINGS:
            break
    if HEADER_TRACK.topic in check.topics or METADATA_NAME in check.metadata:
        return FileKind.ARRAY
    schemas = set(check.topics.values())
    if VIDEO in schemas:
        return FileKind.VIEWS
    return FileKind.POINTS if POINTS in schemas else None


class _ContentCheck(Protocol):
    """Checks what is in the messages of a file."""

    findings: list[Finding]

    def push(self, message: CheckedMessage) -> None: ...

    def end(self, check: FileCheck) -> None: ...


class _StreamCheck:
    """Checks the messages of a file in order, against the first header."""

    def __init__(self, name: str, limits: Limits) -> None:
        self.findings: list[Finding] = []
        self._name, self._limits = name, limits
        self._header: StreamHeader | None = None
        self._header_data = b""
        self._messages: MessageCheck | None = None
        self._layer: LayerCheck | None = None
        self._rules: dict[Track, UnitRules] = {}
        self._tracks: dict[str, Track] = {}
        self._assembler = Assembler(name, self._tell_order)
        self._key_ns: int | None = None
        self._key_index: int | None = None
        self._now: tuple[int, int] | None = None  # sequence and time of the frame set at hand
        self._early = False

    def push(self, message: CheckedMessage) -> None:
        """Check one message."""
        record = message.record
        if message.topic == HEADER_TRACK.topic:
            self._push_header(message)
        elif self._header is None:
            if not self._early:
                self._early = True
                self._add(
                    error("header", "a message before the first header", message.topic, record.log_time)
                )
            return
        assert self._messages is not None or message.topic == HEADER_TRACK.topic
        if self._layer is not None and message.topic == LAYER_TRACK.topic:
            self._check_set(message)
            self._layer.push_header(message)
        elif self._messages is not None and message.topic in self._messages.topics:
            self._check_set(message)
            data = self._messages.push(message)
            track = self._tracks.get(message.topic)
            if track is not None and data is not None:
                self._push_unit(track, message, data)
            elif self._layer is not None and self._layer.takes(message.topic) and data is not None:
                self._layer.push_unit(message, data, record.sequence == self._key_index)

    def end(self, check: FileCheck) -> None:
        """Check what can be known at the end only."""
        if self._header is None:
            self._add(error("header", f"no header on {HEADER_TRACK.topic}"))
            return
        self._tell_sets(self._assembler.flush())
        self._end_set()
        assert self._messages is not None
        if self._layer is not None:
            self._layer.end()
        self.findings += self._messages.end()
        said = check.metadata.get(METADATA_NAME, {}).get("header")
        if said is None:
            self._add(warning("metadata", "no metadata record mvcodec with the header"))
        elif said.encode() != self._header_data:
            self._add(warning("metadata", "the header in the metadata differs from the first message's"))

    def _add(self, finding: Finding) -> None:
        self.findings.append(finding)

    def _push_header(self, message: CheckedMessage) -> None:
        record = message.record
        topic, time_ns = message.topic, record.log_time
        try:
            self._limits.check("max_header_bytes", len(record.data), "header bytes")
            header = StreamHeader.from_json(record.data, "header")
            self._limits.check_header(header, "header")
        except StreamError as failure:
            self._add(error("header", str(failure), topic, time_ns))
            return
        for name in unknown_fields(record.data, header):
            self._add(error("header", f"field {name}, which the format does not have", topic, time_ns))
        if self._header is None:
            self._start(header, record.data)
            if record.sequence != header.first_frame:
                text = f"first_frame {header.first_frame}, but the first frame set is {record.sequence}"
                self._add(error("header", text, topic, time_ns))
        elif header != self._header:
            self._add(error("header", "it differs from the first one", topic, time_ns))
        if self._messages is not None:
            self._messages.begin_keyframe(record)
        if self._layer is not None:
            self._layer.begin_keyframe(record)
        self._key_ns, self._key_index = time_ns, record.sequence

    def _start(self, header: StreamHeader, data: bytes) -> None:
        self._header, self._header_data = header, data
        self._messages = MessageCheck(header, self._add)
        sizes = track_sizes(header.array.width, header.array.height, header.disparity_scale)
        codec = CODECS.get(header.codec)
        if codec is None:
            self._add(error("codec", f"unknown codec {header.codec!r}", HEADER_TRACK.topic))
        else:
            self._rules = {
                track: UnitRules(unit_codec(track, codec), track.kind, sizes[track.kind])
                for track in header.tracks
            }
            self._layer = LayerCheck(header, codec, self._messages, self._add)
        self._tracks = {track.topic: track for track in header.tracks}
        self._assembler.start(header.tracks)

    def _check_set(self, message: CheckedMessage) -> None:
        """Times of a message, alone and in its frame set."""
        record = message.record
        where = (message.topic, record.log_time)
        if record.publish_time != record.log_time:
            self._add(
                error("time", f"publish_time {record.publish_time}, log_time {record.log_time}", *where)
            )
        if self._now is not None:
            index, time_ns = self._now
            if record.sequence == index and record.log_time != time_ns:
                text = f"another time than its frame set's {time_ns / 1e9:.3f} s"
                self._add(error("time", text, *where))
            if record.sequence != index and record.log_time < time_ns:
                self._add(error("order", f"a time before {time_ns / 1e9:.3f} s, which came first", *where))
        if self._now is None or record.sequence != self._now[0]:
            self._end_set()
            self._now = record.sequence, record.log_time

    def _end_set(self) -> None:
        if self._now is not None and self._messages is not None:
            self._messages.end_set(self._now[1])
            if self._layer is not None:
                self._layer.end_set(self._now[1])

    def _push_unit(self, track: Track, message: CheckedMessage, data: bytes) -> None:
        record = message.record
        keyframe = record.sequence == self._key_index
        packet = Packet(track, record.sequence, record.log_time, keyframe, data)
        if not keyframe and self._key_ns is not None and record.log_time - self._key_ns >= _SECOND_NS:
            since_s = (record.log_time - self._key_ns) / 1e9
            text = f"{since_s:.3f} s after the last keyframe, expected one each second"
            self._add(error("keyframe-interval", text, track.topic, record.log_time))
        if track in self._rules:
            for code, text in self._rules[track].push(data, keyframe, record.sequence):
                self._add(error(code, text, track.topic, record.log_time))
        self._tell_sets(self._assembler.push(packet))

    def _tell_sets(self, sets: list[PacketSet]) -> None:
        for found in sets:
            for track in found.missing:
                text = f"no message in frame set {found.first.index}"
                self._add(error("incomplete", text, track.topic, found.first.time_ns))

    def _tell_order(self, failure: StreamError) -> None:
        text = f"{failure.found}, expected {failure.expected}"
        self._add(error("order", text, failure.topic, failure.time_ns))


class _UnknownCheck:
    """A file that there are no rules for: says so, unless its container is damaged and may hold anything."""

    def __init__(self, name: str, limits: Limits) -> None:
        del name, limits
        self.findings: list[Finding] = []

    def push(self, message: CheckedMessage) -> None:
        """Nothing is known of any message."""

    def end(self, check: FileCheck) -> None:
        """See the class."""
        if check.topics or not check.findings:
            topics = ", ".join(sorted(check.topics)[:_TOPICS_NAMED]) or "none"
            expected = f"{HEADER_TRACK.topic}, {VIDEO} or {POINTS}"
            self.findings.append(error("kind", f"topics: {topics}; expected one with {expected}"))


_CONTENTS: dict[FileKind | None, Callable[[str, Limits], _ContentCheck]] = {
    FileKind.ARRAY: _StreamCheck,
    FileKind.VIEWS: lambda _name, _limits: TopicValidation(),
    FileKind.POINTS: lambda _name, _limits: TopicValidation(),
    None: _UnknownCheck,
}

"""The enhancement layer of a file against the rules of FORMAT.md."""

from __future__ import annotations

from collections.abc import Callable

from mcap.records import Message
from mcap.well_known import MessageEncoding

from mvcodec.conformance.file_check import CheckedMessage
from mvcodec.conformance.finding import Finding, error, warning
from mvcodec.conformance.message_check import MessageCheck
from mvcodec.conformance.unit_rules import UnitRules
from mvcodec.container.schemas import LAYER_SCHEMA_NAME
from mvcodec.enhancement import LAYER_TRACK, EnhancementHeader
from mvcodec.errors import StreamError
from mvcodec.stream import StreamHeader, Track, TrackKind
from mvcodec.video.codec import Codec
from mvcodec.video.map_size import track_sizes
from mvcodec.video.vp9_reference import unit_codec

_WHERE_DUE = "right behind the header of each keyframe"


class LayerCheck:
    """Checks the layer's messages in order. Views may be left out of a file, each as a whole.

    Args:
        header: the base's.
        codec: of the base's tracks.
        messages: told which views there are; checks schemas, frame ids and stamps of their messages.
        add: takes what is wrong.
    """

    def __init__(
        self, header: StreamHeader, codec: Codec, messages: MessageCheck, add: Callable[[Finding], None]
    ) -> None:
        self._base, self._codec, self._messages, self._add = header, codec, messages, add
        sizes = track_sizes(header.array.width, header.array.height, header.disparity_scale)
        self._size = sizes[TrackKind.ENHANCED]
        self._layer: EnhancementHeader | None = None
        self._rules: dict[str, UnitRules] = {}
        self._key: Message | None = None
        self._due = False
        self._views: set[str] | None = None  # topics with a view in the first frame set
        self._views_now: set[str] = set()

    def begin_keyframe(self, record: Message) -> None:
        """Expect the layer's header next, if there is a layer."""
        self._end_keyframe()
        self._key, self._due = record, True

    def push_header(self, message: CheckedMessage) -> None:
        """Check a message of the layer's own topic."""
        record, where = message.record, (message.topic, message.record.log_time)
        if (message.schema, message.encoding) != (LAYER_SCHEMA_NAME, MessageEncoding.JSON):
            found = f"{message.schema!r} as {message.encoding!r}, expected {LAYER_SCHEMA_NAME} as json"
            self._add(error("schema", found, *where))
        if not self._due or self._key is None or record.sequence != self._key.sequence:
            self._add(error("layer", f"a header of the layer, expected {_WHERE_DUE}", *where))
        self._due = False
        try:
            layer = EnhancementHeader.from_json(record.data, self._base, "layer")
        except StreamError as failure:
            self._add(error("layer", str(failure), *where))
            return
        if self._layer is None:
            self._layer = layer
            for each in layer.views:
                codec = unit_codec(each.track, self._codec)
                self._rules[each.track.topic] = UnitRules(codec, TrackKind.ENHANCED, self._size)
                self._messages.expect(each.track)
        elif layer != self._layer:
            self._add(error("layer", "it differs from the first one", *where))

    def takes(self, topic: str) -> bool:
        """Whether a topic is one of the layer's views."""
        return topic in self._rules

    def push_unit(self, message: CheckedMessage, data: bytes, keyframe: bool) -> None:
        """Check a view's unit."""
        self._views_now.add(message.topic)
        rules = self._rules[message.topic]
        for code, text in rules.push(data, keyframe, message.record.sequence):
            self._add(error(code, text, message.topic, message.record.log_time))

    def end_set(self, time_ns: int) -> None:
        """The frame set at hand is over: it must have the views of the first one."""
        if self._layer is None:
            return
        if self._views is None:
            self._views = set(self._views_now)
            self._check_references(time_ns)
        for topic in sorted(self._views - self._views_now):
            self._add(error("incomplete", "no unit in this frame set", topic, time_ns))
        for topic in sorted(self._views_now - self._views):
            self._add(error("incomplete", "a view begins here, expected in each frame set", topic, time_ns))
        self._views |= self._views_now
        self._views_now = set()

    def end(self) -> None:
        """The file is over."""
        self._end_keyframe()

    def _end_keyframe(self) -> None:
        if self._due and self._layer is not None and self._key is not None:
            text = f"missing, expected {_WHERE_DUE}"
            self._add(error("layer", text, LAYER_TRACK.topic, self._key.log_time))
        self._due = False

    def _check_references(self, time_ns: int) -> None:
        """Views whose references were left out of the file are of no use."""
        assert self._layer is not None
        assert self._views is not None
        there = set(self._base.array.real)
        for each in self._layer.views:
            if each.track.topic not in self._views:
                continue
            missing = [other for other in each.references if other not in there]
            if missing:
                lost = Track(TrackKind.ENHANCED, missing[0]).topic
                text = f"a view that nobody can decode: it builds on {lost}, which the file does not have"
                self._add(warning("layer", text, each.track.topic, time_ns))
            else:
                there.add(each.view)

"""A file of video topics or points without our header against the rules that everyone's viewers have."""

from __future__ import annotations

from mvcodec.conformance.file_check import CheckedMessage, FileCheck
from mvcodec.conformance.finding import Finding, error
from mvcodec.conformance.topic_check import TopicCheck
from mvcodec.conformance.unit_rules import UnitRules
from mvcodec.video.codecs import CODECS

_SECOND_NS = 1_000_000_000
_ANY_SIZE = (0, 0)


class TopicValidation:
    """Checks messages in order, and the access units of each video topic."""

    def __init__(self) -> None:
        self.findings: list[Finding] = []
        self._messages = TopicCheck(self.findings.append)
        self._rules: dict[tuple[str, str], UnitRules] = {}
        self._key_ns: dict[str, int] = {}

    def push(self, message: CheckedMessage) -> None:
        """Check one message."""
        found = self._messages.push(message)
        if found is None:
            return
        codec, data = found
        topic, time_ns = message.topic, message.record.log_time
        rules = self._rules.get((topic, codec))
        if rules is None:
            rules = self._rules[topic, codec] = UnitRules(CODECS[codec], None, _ANY_SIZE)
        for code, text in rules.push(data, None):
            self.findings.append(error(code, text, topic, time_ns))
        if rules.keyframe:
            self._key_ns[topic] = time_ns
        elif time_ns - self._key_ns.get(topic, time_ns) >= _SECOND_NS:
            since_s = (time_ns - self._key_ns[topic]) / 1e9
            text = f"{since_s:.3f} s after the last keyframe, expected one each second"
            self.findings.append(error("keyframe-interval", text, topic, time_ns))

    def end(self, check: FileCheck) -> None:
        """Check what can be known at the end only."""
        del check
        self.findings += self._messages.end()

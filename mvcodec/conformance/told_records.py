"""The records of an MCAP file for `validate`, with findings about what is none."""

from __future__ import annotations

import io
from typing import Any, BinaryIO

from mcap.data_stream import ReadDataStream

from mvcodec.conformance.finding import Finding, error
from mvcodec.container.exact_file import ExactFile
from mvcodec.container.limits import Limits
from mvcodec.container.record_walk import RecordWalk
from mvcodec.container.records import DAMAGE


class ToldRecords:
    """Goes through the records of a seekable file, and tells what is none.

    Attributes:
        file: where it is.
        findings: what was told.
        time_ns: log time of the last message, which says where a finding is.
        whole: nothing had to be passed over so far.
    """

    def __init__(self, file: BinaryIO, limits: Limits) -> None:
        self.file = ExactFile(file)
        self._walk = RecordWalk(self.file, limits, self._tell_damage)
        self.findings: list[Finding] = []
        self.time_ns: int | None = None
        self.whole = True

    def tell(self, code: str, message: str, topic: str | None = None, time_ns: int | None = None) -> None:
        """Tell what is wrong, at the last message's time where no other is known."""
        time_ns = self.time_ns if time_ns is None else time_ns
        self.findings.append(error(code, message, topic, time_ns))

    def next(self) -> tuple[int, bytes, int] | None:
        """The next record and where it begins; None where there is none (which is told)."""
        record = self._walk.next()
        if record is None:
            if self._walk.cut is not None:
                self.tell("cut-off", "the file breaks off here")
            return None
        return *record, self._walk.place

    def _tell_damage(self, what: str) -> None:
        self.tell("record", what)
        self.whole = False

    def parsed(self, kind: Any, content: bytes) -> Any:
        """A record of the MCAP library's kind; None (told) where it is damaged."""
        try:
            stream = ReadDataStream(io.BytesIO(content))
            record = kind.read(stream)
        except DAMAGE as damage:
            self.tell("record", f"a damaged {kind.__name__} ({str(damage) or type(damage).__name__})")
            return None
        if stream.count != len(content):
            self.tell("record", f"a {kind.__name__} with bytes behind its end")
        return record

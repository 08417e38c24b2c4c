"""Reads an MCAP file record by record, and tells what is none."""

from __future__ import annotations

import io
from typing import Any, BinaryIO

from mcap.data_stream import ReadDataStream

from mvcodec.conformance.finding import Finding, error
from mvcodec.container.exact_file import ExactFile
from mvcodec.container.limits import Limits
from mvcodec.container.records import DAMAGE, CutOff, RecordError, find_chunk, read_record


class RecordWalk:
    """Goes through the records of a seekable file.

    Attributes:
        file: where it is.
        findings: what was told.
        time_ns: log time of the last message, which says where a finding is.
        whole: nothing had to be passed over so far.
    """

    def __init__(self, file: BinaryIO, limits: Limits) -> None:
        self.file, self._limits = ExactFile(file), limits
        self.findings: list[Finding] = []
        self.time_ns: int | None = None
        self.whole = True

    def tell(self, code: str, message: str, topic: str | None = None, time_ns: int | None = None) -> None:
        """Tell what is wrong, at the last message's time where no other is known."""
        time_ns = self.time_ns if time_ns is None else time_ns
        self.findings.append(error(code, message, topic, time_ns))

    def next(self) -> tuple[int, bytes, int] | None:
        """The next record and its place; None where there is none (which is told)."""
        while True:
            place = self.file.place
            try:
                record = read_record(self.file, self._limits)
            except CutOff as cut:
                self.file.give_back(cut.content)
                if not (cut.content and find_chunk(self.file, self._limits)):
                    self.tell("cut-off", "the file breaks off here")
                    return None
                self.tell("record", "a record that is longer than what follows")
            except RecordError as damage:
                self.tell("record", str(damage))
                if not find_chunk(self.file, self._limits):
                    return None
            else:
                if record is None:
                    self.tell("cut-off", "the file breaks off here")
                    return None
                return record[0], record[1], place
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

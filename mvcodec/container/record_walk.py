"""The loop over the records of an MCAP file, for readers and `validate`: what is no record is passed over."""

from __future__ import annotations

from collections.abc import Callable

from mvcodec.container.exact_file import ExactFile
from mvcodec.container.limits import Limits
from mvcodec.container.records import CutOff, RecordError, find_chunk, read_record


class RecordWalk:
    """Goes through the records of an input, from wherever it stands.

    Args:
        file: binary input, which may be a pipe.
        limits: a record that is larger is damage.
        tell: told of what is no record, behind which it goes on with the next chunk. What it raises ends it.

    Attributes:
        cut: how the input breaks off, when `next` has returned None for that.
        crc: checksum of all that came before the last record.
        place: where the last record begins, in a seekable file.
    """

    def __init__(self, file: ExactFile, limits: Limits, tell: Callable[[str], None]) -> None:
        self._file, self._limits, self._tell = file, limits, tell
        self.cut: CutOff | None = None
        self.crc = self.place = 0
        self._seekable = file.seekable()

    def next(self) -> tuple[int, bytes] | None:
        """Opcode and content of the next record, as `read_record`; None where there is none."""
        while True:
            self.crc = self._file.crc
            self.place = self._file.place if self._seekable else 0
            try:
                record = read_record(self._file, self._limits)
            except CutOff as cut:
                self._file.give_back(cut.content)
                if not (cut.content and self._find()):
                    self.cut = cut
                    return None
                self._tell("a record that is longer than what follows")
            except RecordError as damage:
                self._tell(str(damage))
                if not self._find():
                    return None
            else:
                if record is None:
                    self.cut = CutOff()
                return record

    def _find(self) -> bool:
        return find_chunk(self._file, self._limits)

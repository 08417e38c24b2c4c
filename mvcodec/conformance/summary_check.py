"""The end of an MCAP file: whether its summary and its checksums say what is there."""

from __future__ import annotations

import zlib
from typing import Any

from mcap.opcode import Opcode
from mcap.records import DataEnd, Footer

from mvcodec.conformance.data_section import SUMMARY_RECORDS, DataSection
from mvcodec.conformance.told_records import ToldRecords
from mvcodec.container.records import HEAD, MAGIC

_CRC_BYTES = 4


def check_summary(walk: ToldRecords, seen: DataSection, data_end: int, content: bytes) -> None:
    """Go on through the summary to the end of the file, and tell what is not as it must be.

    Args:
        seen: what came by in the data section.
        data_end: where the record that ends it begins.
        content: of that record.
    """
    crc = walk.parsed(DataEnd, content)
    start = walk.file.place
    if walk.whole and crc is not None and crc.data_section_crc:
        walk.file.seek(0)
        walk.file.skip(data_end)
        if walk.file.crc != crc.data_section_crc:
            walk.tell("data-crc", "data whose checksum is wrong")
        walk.file.seek(start)
    found: dict[int, list[Any]] = {}
    while (record := walk.next()) is not None:
        opcode, body, place = record
        if opcode == Opcode.FOOTER:
            _check_footer(walk, body, start, place)
            break
        kind = SUMMARY_RECORDS.get(opcode)
        if kind is not None:
            found.setdefault(opcode, []).append(walk.parsed(kind, body))
        elif opcode != Opcode.SUMMARY_OFFSET:
            walk.tell("record", f"a record of kind {opcode} in the summary")
    else:
        return
    if walk.whole:
        for difference in seen.differences(found):
            walk.tell("summary", difference)


def _check_footer(walk: ToldRecords, content: bytes, start: int, place: int) -> None:
    footer = walk.parsed(Footer, content)
    if footer is None:
        return
    if footer.summary_start != start:
        walk.tell("footer", f"a summary at {footer.summary_start}, found at {start}")
    end = walk.file.place
    if footer.summary_crc:
        walk.file.seek(start)
        covered = walk.file.read(place + HEAD.size + len(content) - _CRC_BYTES - start)
        if zlib.crc32(covered) != footer.summary_crc:
            walk.tell("summary-crc", "a summary whose checksum is wrong")
        walk.file.seek(end)
    if walk.file.read(len(MAGIC)) != MAGIC:
        walk.tell("magic", "the file does not end as MCAP does")
    elif walk.file.read(1):
        walk.tell("magic", "something behind the end")

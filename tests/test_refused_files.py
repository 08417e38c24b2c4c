"""Files that are not ours, or that cannot be read or written: one line that says so."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from coding import Pipe
from mcap.writer import Writer

from mvcodec.container import McapReader
from mvcodec.errors import InputError, StreamError


def _foreign() -> bytes:
    target = io.BytesIO()
    writer = Writer(target)
    writer.start()
    channel = writer.register_channel("/other", "json", writer.register_schema("Other", "jsonschema", b"{}"))
    writer.add_message(channel, 0, b"{}", 0)
    writer.finish()  # type: ignore[no-untyped-call]
    return target.getvalue()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "name.mcap: found an empty file, expected an MCAP file"),
        (b"this is a text file, and a long one at that", "name.mcap: found a file that is not MCAP"),
        (_foreign(), r"name.mcap: found MCAP without /mvcodec/header \(topics: /other\)"),
    ],
)
def test_bad_files_are_named(content: bytes, message: str) -> None:
    for source in (io.BytesIO(content), Pipe(content)):
        with pytest.raises(StreamError, match=message):
            McapReader(source, "name.mcap")  # type: ignore[arg-type]


def test_a_folder_is_told_from_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found a folder, expected an MCAP file, which `mvcodec encode`"):
        McapReader.open(tmp_path)

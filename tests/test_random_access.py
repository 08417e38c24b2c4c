"""A range of frames costs the chunks that hold it, from a disk and from a web server."""

from __future__ import annotations

import io
import json
import re
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from coding import encoded_file, make_array
from command_line import fails, succeeds
from damage import chunk_ends

from mvcodec.container import McapReader
from mvcodec.decoding.decoder import Decoder
from mvcodec.errors import InputError

COUNT, GOP = 120, 10


@pytest.fixture(scope="module")
def content() -> bytes:
    return encoded_file(make_array(240, 160, rows=1, cols=2, fps=10.0), COUNT, gop=GOP, qp=12)


def _gop_bytes(content: bytes, number: int) -> int:
    """Bytes of the chunks of a GOP (two for each: ten frames at 10 frames/s)."""
    ends = [0, *chunk_ends(content)]
    return ends[2 * number + 2] - ends[2 * number]


def _summary_bytes(content: bytes) -> int:
    """Indexes: message indexes behind each chunk, and everything behind the last one."""
    starts = sum(9 + 2 + 4 + 16 * GOP for _ in range(COUNT))
    return len(content) - chunk_ends(content)[-1] + starts


@pytest.mark.parametrize("frame", [0, 37, 59, 119])
def test_one_frame_reads_two_gops_at_most(content: bytes, frame: int) -> None:
    with Decoder.open(io.BytesIO(content), slice(frame, frame + 1)) as decoder:
        (found,) = decoder
        assert found.index == frame
        gops = _gop_bytes(content, 0) + _gop_bytes(content, frame // GOP)
        assert decoder.bytes_read <= gops + _summary_bytes(content)
        assert decoder.bytes_read < decoder.bytes / 3


class _Handler(BaseHTTPRequestHandler):
    """Serves one file, by ranges where they are asked for; counts what leaves."""

    content = b""
    ranges = True
    served = 0

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def do_GET(self) -> None:
        self._answer(body=True)

    def _answer(self, body: bool) -> None:
        if self.path.endswith("secret.mcap"):
            self.send_error(403)
            return
        if not self.path.endswith("x.mcap"):
            self.send_error(404)
            return
        wanted = re.match(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        part = self.content
        if wanted and self.ranges:
            first, last = int(wanted[1]), min(int(wanted[2]), len(self.content) - 1)
            part = self.content[first : last + 1]
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {first}-{last}/{len(self.content)}")
        else:
            self.send_response(200)
        if self.ranges:
            self.send_header("Accept-Ranges", "bytes")
        self.send_header("Content-Length", str(len(part)))
        self.end_headers()
        if body:
            type(self).served += len(part)
            self.wfile.write(part)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@pytest.fixture
def url(content: bytes) -> Iterator[str]:
    _Handler.content, _Handler.ranges, _Handler.served = content, True, 0
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/x.mcap"
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_file_on_a_web_server_decodes_by_ranges(content: bytes, url: str) -> None:
    with Decoder.open(url, slice(57, 58)) as decoder:
        (found,) = decoder
    assert found.index == 57
    assert _Handler.served < len(content) / 2, "the rest stays where it is"
    with McapReader.open(url) as reader:
        assert reader.frame_count == COUNT


def test_the_command_decodes_a_url_and_reports_what_it_read(content: bytes, url: str, tmp_path: Path) -> None:
    arguments = ("decode", url, tmp_path / "out", "--frames", "57:58", "--synthesizer", "linear", "--json")
    report = json.loads(succeeds(*arguments))
    assert (report["frames"], report["bytes"]) == (1, len(content))
    assert 0 < report["bytes_read"] < len(content) / 3
    assert "no such file" in fails(1, "decode", url.replace("x.mcap", "y.mcap"), tmp_path / "none")


def test_a_server_without_ranges_is_named(url: str) -> None:
    _Handler.ranges = False
    with pytest.raises(InputError, match="does not serve ranges"):
        Decoder.open(url)


def test_info_and_render_take_urls(content: bytes, url: str, tmp_path: Path) -> None:
    info = json.loads(succeeds("info", url, "--json"))
    assert (info["bits"]["total"], info["created"]) == (8 * len(content), None)
    succeeds("render", url, tmp_path / "a.png", "--synthesizer", "linear", "--frames", ":1")
    assert (tmp_path / "a.png").exists()


def test_a_server_that_does_not_answer_is_no_missing_file(tmp_path: Path) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))  # nobody listens there
        address = f"127.0.0.1:{unused.getsockname()[1]}"
        for command in (
            ("decode", f"http://{address}/x.mcap", tmp_path),
            ("info", f"http://{address}/x.mcap"),
        ):
            line = fails(1, *command)
            assert f"http://{address}/x.mcap: found no connection to {address} (Connection refused)" in line


def test_what_a_server_answers_is_told(url: str) -> None:
    with pytest.raises(InputError, match="found no such file"):
        Decoder.open(url.replace("x.mcap", "y.mcap"))
    with pytest.raises(InputError, match="found the answer 403 Forbidden"):
        Decoder.open(url.replace("x.mcap", "secret.mcap"))


@pytest.mark.parametrize(
    "command",
    [
        "validate {}",
        "recover {} o.mcap",
        "play {}",
        "encode {} o.mcap",
        "decode x.mcap {}",
        "encode array {}",
    ],
)
def test_where_no_address_is_taken_it_is_named_as_it_was_given(command: str) -> None:
    address = "http://127.0.0.1:1/x.mcap"
    line = fails(2, *command.format(address).split())
    assert f"found {address}, expected a file or folder on this machine" in line

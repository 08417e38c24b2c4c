"""A small coded file with its original, a running player, and a client that speaks its protocol."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from command_line import COMMAND
from mcap.reader import make_reader
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect

from mvcodec.capture import open_input
from mvcodec.cli.arguments import DEFAULT_SYNTHESIZER
from mvcodec.container import McapWriter
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.frames import Picture
from mvcodec.output.scene_folder import write_sample
from mvcodec.scenes.scene import SceneSettings

FRAMES, GOP = 12, 4
SIZE = (240, 160)
SYNTHESIZER = DEFAULT_SYNTHESIZER
"""What viewers see unless they ask for another; tests that need none of its quality take a quicker one."""


def write_original(folder: Path, grid: tuple[int, int] = (3, 3), frames: int = FRAMES) -> Path:
    """The sample room as an array folder."""
    write_sample(folder, settings=SceneSettings(grid=grid, frames=frames, size=SIZE), with_truth=False)
    return folder


def encode(original: Path, file: Path, spoiled: Collection[int] = ()) -> Path:
    """Code an array folder's corners, a keyframe every GOP frames; half of a `spoiled` frame is missing."""
    source = open_input([original])
    with Encoder(source.array, EncoderConfig(qp=22, gop=GOP)) as encoder, McapWriter(file) as writer:
        for frames in source.frame_sets():
            packets = encoder.push(frames)
            if frames.index in spoiled:
                packets[-1] = replace(packets[-1], data=packets[-1].data[: len(packets[-1].data) // 2])
            writer.push(packets)
    return file


def damage(file: Path, target: Path, gop: int) -> Path:
    """A copy with flipped bytes in the chunk of one group of pictures."""
    data = bytearray(file.read_bytes())
    with file.open("rb") as opened:
        summary = make_reader(opened).get_summary()
    assert summary is not None
    chunks = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
    middle = chunks[gop].chunk_start_offset + chunks[gop].chunk_length // 2
    for offset in range(middle, middle + 16):
        data[offset] ^= 0xFF
    target.write_bytes(data)
    return target


@dataclass(frozen=True)
class Running:
    """A player in a process of its own."""

    url: str
    process: subprocess.Popen[str]

    @property
    def port(self) -> int:
        return int(self.url.rstrip("/").rsplit(":", 1)[1])

    def rss_kb(self) -> int:
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0])

    def stop(self) -> int:
        self.process.terminate()
        return self.process.wait(10)


@contextmanager
def playing(*arguments: str | Path, port: int = 0, renderer: str = "server") -> Iterator[Running]:
    """Run ``mvcodec play`` until the end of the block."""
    options = ("--no-browser", "--port", str(port), "--renderer", renderer)
    command = [*COMMAND, "play", *map(str, arguments), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=sys.stderr, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("http://"), line
        yield Running(line.split()[0], process)
    finally:
        if process.poll() is None:
            process.terminate()
        process.wait(10)
        assert process.stdout is not None
        process.stdout.close()


def decode_picture(coded: NDArray[np.uint8]) -> Picture:
    """JPEG or PNG -> RGB."""
    picture = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)


@dataclass(frozen=True)
class Received:
    """A picture as a client gets it."""

    facts: dict[str, Any]
    picture: Picture


class Viewer:
    """A client: sends messages, takes pictures apart, and says that it has drawn them."""

    def __init__(self, running: Running, **options: Any) -> None:
        address = running.url.replace("http://", "ws://") + "view"
        self._open = ExitStack()
        connection = connect(address, max_size=None, compression=None, **options)
        self.socket: ClientConnection = self._open.enter_context(connection)
        self.hello: dict[str, Any] = json.loads(self.socket.recv(10))
        self.state: dict[str, Any] = {}
        self.undrawn = 0

    def say(self, kind: str, **fields: object) -> None:
        self.socket.send(json.dumps({"type": kind, **fields}))

    def next_picture(self, timeout: float = 20) -> Received:
        """The next picture, acknowledged."""
        while True:
            received = self._take(timeout)
            if received is not None:
                return received

    def wait_until_stopped(self) -> None:
        """Draw what comes until the server says that it no longer plays."""
        while self.state.get("playing") is not False:
            self._take(20)

    def _take(self, timeout: float) -> Received | None:
        """Take one message: a picture, acknowledged; None: what was said of the state, kept."""
        message = self.socket.recv(timeout)
        if isinstance(message, str):
            document = json.loads(message)
            if document["type"] != "state":
                raise AssertionError(document["message"])
            self.state = document
            return None
        (length,) = struct.unpack(">I", message[:4])
        facts = json.loads(message[4 : 4 + length])
        self.say("shown", picture=facts["picture"])
        coded = np.frombuffer(message, np.uint8, offset=4 + length)
        return Received(facts, decode_picture(coded))

    def picture_of(self, **wanted: object) -> Received:
        """The first picture whose facts are these."""
        while True:
            received = self.next_picture()
            if all(received.facts[name] == value for name, value in wanted.items()):
                return received

    def close(self) -> None:
        self._open.close()

    def take_all(self, timeout: float = 10) -> None:
        """Take what comes without drawing it, until the server closes or falls silent: an error each."""
        while True:
            self.undrawn += isinstance(self.socket.recv(timeout), bytes)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

"""How the browser player keeps up: pictures a second while playing and dragging, answers while paused.

    python benchmarks/playback.py FILE.mcap [--seconds 10] [--rounds 3] [--json]

First the stages by themselves, in this process: each frame set decoded, its first view (which prepares the
cameras), another view, and its JPEG. Then `mvcodec play` in a process of its own, with a viewer that plays
in a loop and drags all the time, and one that drags while paused; they draw nothing. Printed: medians of the
stages in ms, wall and CPU, and of each round: pictures a second, their sides' share of full size, CPU ms of
the server for each, and how much of the machine others took meanwhile: without that no rate means much.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from mvcodec.array import Viewpoint
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.frame_table import read_frame_table
from mvcodec.frames import DecodedSet
from mvcodec.player.picture_maker import to_jpeg
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.synthesis.synthesizers import make_synthesizer

MOVES_A_SECOND = 60
WARM_UP_S = 4.0
"""Code is compiled or loaded, and caches fill."""
PAUSE_S = 0.25
"""Between two moves while paused: the answer to one has come, and the whole picture after it."""
TICK_S = 1 / os.sysconf("SC_CLK_TCK")


@dataclass
class Stage:
    """Milliseconds of one stage, a value for each frame set."""

    wall_ms: list[float] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)

    @contextmanager
    def timed(self) -> Iterator[None]:
        wall, cpu = time.perf_counter(), time.process_time()
        yield
        self.wall_ms.append(1000 * (time.perf_counter() - wall))
        self.cpu_ms.append(1000 * (time.process_time() - cpu))


def measure_stages(path: Path) -> dict[str, dict[str, float]]:
    """Median ms of the stages of one picture, over the frame sets of the second time through the file."""
    synthesizer = make_synthesizer("layered")
    count = read_frame_table(path).count
    stages: dict[str, Stage] = {}
    for _ in range(2):
        stages = {name: Stage() for name in ("decode", "first view", "other view", "jpeg")}
        with Decoder.open(path) as decoder:
            sets = iter(decoder)
            for _ in range(count):
                with stages["decode"].timed():
                    found = next(sets)
                _measure_views(found, stages, synthesizer)
    return {
        name: {"wall_ms": float(np.median(stage.wall_ms)), "cpu_ms": float(np.median(stage.cpu_ms))}
        for name, stage in stages.items()
    }


def _measure_views(decoded: DecodedSet, stages: dict[str, Stage], synthesizer: Synthesizer) -> None:
    middle = Viewpoint((decoded.array.rows - 1) / 2, (decoded.array.cols - 1) / 2)
    with stages["first view"].timed():
        synthesizer.render(decoded, middle)
    with stages["other view"].timed():
        view = synthesizer.render(decoded, Viewpoint(0.8 * middle.row, 0.9 * middle.col))
    with stages["jpeg"].timed():
        to_jpeg(view.pixels)


@contextmanager
def playing(path: Path) -> Iterator[tuple[str, int]]:
    """Run ``mvcodec play``; its WebSocket's URL and its process id."""
    command = [sys.executable, "-m", "mvcodec", "play", str(path), "--no-browser", "--renderer", "server"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[0].replace("http://", "ws://") + "view", process.pid
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()


@dataclass(frozen=True)
class Round:
    """What a viewer got within one round of playing and dragging.

    Attributes:
        pictures_per_s: drawn.
        scale: mean of the pictures' sides, as a share of the full size's.
        quick: share of pictures that the quick synthesizer drew.
        cpu_ms: of the server, for each picture.
        dropped_per_s: frames that were due and not shown.
        others: share of the machine's time that other processes took.
    """

    pictures_per_s: float
    scale: float
    quick: float
    cpu_ms: float
    dropped_per_s: float
    others: float


class Dragger:
    """A viewer that goes round the array's middle."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._hello = json.loads(socket.recv(30))
        self._turns = 0
        self.say("ready")

    def say(self, kind: str, **fields: object) -> None:
        self._socket.send(json.dumps({"type": kind, **fields}))

    def move(self) -> tuple[float, float]:
        """Take a step; returns the row and column."""
        self._turns += 1
        row, col = (self._hello["rows"] - 1) / 2, (self._hello["cols"] - 1) / 2
        angle = self._turns / MOVES_A_SECOND
        row, col = row * (1 + 0.8 * math.sin(1.9 * angle)), col * (1 + 0.8 * math.cos(2.3 * angle))
        self.say("move", row=row, col=col)
        return row, col

    def next_picture(self) -> dict[str, Any]:
        """Facts of the next picture, which counts as drawn."""
        while True:
            message = self._socket.recv(30)
            if isinstance(message, bytes):
                (length,) = struct.unpack(">I", message[:4])
                facts: dict[str, Any] = json.loads(message[4 : 4 + length])
                self.say("shown", picture=facts["picture"])
                return facts

    def keep_moving(self, stop: threading.Event) -> None:
        while not stop.wait(1 / MOVES_A_SECOND):
            try:
                self.move()
            except ConnectionClosed:
                return

    def take(self, seconds: float) -> list[dict[str, Any]]:
        """Facts of all pictures of the next seconds."""
        end, facts = time.monotonic() + seconds, []
        while time.monotonic() < end:
            facts.append(self.next_picture())
        return facts


def measure_playing(path: Path, seconds: float, rounds: int) -> list[Round]:
    """Play in a loop and drag all the time."""
    found = []
    with playing(path) as (url, pid), connect(url, max_size=None, compression=None) as socket:
        dragger, stop = Dragger(socket), threading.Event()
        dragger.say("loop", loop=True)
        dragger.say("play", playing=True)
        mover = threading.Thread(target=dragger.keep_moving, args=(stop,))
        mover.start()
        try:
            dropped = dragger.take(WARM_UP_S)[-1]["dropped"]
            for _ in range(rounds):
                cpu_s, (busy_s, all_s), start = _cpu_s(pid), _machine_s(), time.monotonic()
                facts = dragger.take(seconds)
                took_s, own_s = time.monotonic() - start, _cpu_s(pid) - cpu_s
                busy_s, all_s = (
                    after - before for after, before in zip(_machine_s(), (busy_s, all_s), strict=True)
                )
                found.append(
                    Round(
                        len(facts) / took_s,
                        sum(fact["scale"] for fact in facts) / len(facts),
                        sum(fact["quick"] for fact in facts) / len(facts),
                        1000 * own_s / len(facts),
                        (facts[-1]["dropped"] - dropped) / took_s,
                        max(0.0, busy_s - own_s) / all_s,
                    )
                )
                dropped = facts[-1]["dropped"]
        finally:
            stop.set()
            mover.join()
    return found


def measure_paused(path: Path, moves: int) -> list[float]:
    """Ms from each move to its picture, while paused."""
    took = []
    with playing(path) as (url, _), connect(url, max_size=None, compression=None) as socket:
        dragger = Dragger(socket)
        dragger.next_picture()
        for _ in range(moves):
            start = time.monotonic()
            row, col = dragger.move()
            while True:
                facts = dragger.next_picture()
                if (facts["row"], facts["col"]) == (row, col):
                    break
            took.append(1000 * (time.monotonic() - start))
            time.sleep(PAUSE_S)
    return took[2:]


def _cpu_s(pid: int) -> float:
    """CPU seconds of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return TICK_S * (int(fields[11]) + int(fields[12]))


def _machine_s() -> tuple[float, float]:
    """(busy, all) CPU seconds of the whole machine so far."""
    fields = [TICK_S * int(value) for value in Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
    return sum(fields) - fields[3] - fields[4], sum(fields)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("file", type=Path)
    parser.add_argument("--seconds", type=float, default=10.0, help="of each round (default 10)")
    parser.add_argument("--rounds", type=int, default=3, help="(default 3)")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    stages = measure_stages(arguments.file)
    rounds = measure_playing(arguments.file, arguments.seconds, arguments.rounds)
    paused_ms = measure_paused(arguments.file, 20)
    if arguments.json:
        document = {"stages": stages, "playing": [asdict(item) for item in rounds], "paused_ms": paused_ms}
        print(json.dumps(document, indent=1))
        return 0
    for name, stage in stages.items():
        print(f"{name:11} {stage['wall_ms']:6.1f} ms wall {stage['cpu_ms']:6.1f} ms CPU")
    for item in rounds:
        print(
            f"playing and dragging: {item.pictures_per_s:5.1f} pictures/s, sides {item.scale:4.0%}, "
            f"quick {item.quick:4.0%}, "
            f"{item.cpu_ms:5.1f} ms CPU each, {item.dropped_per_s:4.1f} frames/s dropped; "
            f"others took {item.others:.0%} of the machine"
        )
    median, high = np.percentile(paused_ms, [50, 95])
    print(f"dragging while paused: median {median:5.1f} ms, 95 % {high:5.1f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())

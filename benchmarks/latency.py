"""From glass to glass: what lies between a frame set and its rendered view, beside what the stages compute.

    python benchmarks/latency.py [--frames 200] [--size 640x360]

One process encodes, another decodes and renders; a pipe connects them, as `mvcodec encode - -` and `mvcodec
decode - -` are connected. Printed: median and 99th percentile of the whole way, of the sum of what encoding,
decoding and rendering take by themselves in the same run, and of their ratio. Each frame set is given when
the one before has come through, so that nothing waits for a machine that is too slow.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator

import numpy as np
from skimage import data

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.container import McapReader, McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.live import LiveEncoding
from mvcodec.frames import FrameSet
from mvcodec.stream import Packet
from mvcodec.synthesis.synthesizers import make_synthesizer

FPS = 25.0
WARM_UP = 10
"""Frame sets at the start that are left out: code is compiled and loaded there."""


class _TimedEncoder(Encoder):
    """Notes how long each frame set takes."""

    def __init__(self, array: CameraArray, config: EncoderConfig) -> None:
        super().__init__(array, config)
        self.took_ns: dict[int, int] = {}

    def push(self, frames: FrameSet) -> list[Packet]:
        start = time.perf_counter_ns()
        packets = super().push(frames)
        self.took_ns[frames.index] = time.perf_counter_ns() - start
        return packets


def receive() -> None:
    """Decode standard input and render; print index, time of completion and time computed, ns."""
    synthesizer = make_synthesizer("layered")
    with open(0, "rb", buffering=0) as pipe, McapReader(pipe) as reader, Decoder() as decoder:
        computed = 0
        for _, packet in reader.packets():
            start = time.perf_counter_ns()
            for found in decoder.push(packet):
                synthesizer.render(found, Viewpoint(0, 1))
                computed += time.perf_counter_ns() - start
                print(json.dumps([found.index, time.monotonic_ns(), computed]), flush=True)
                computed, start = 0, time.perf_counter_ns()
            computed += time.perf_counter_ns() - start


def _frame_sets(
    array: CameraArray, count: int, given_ns: dict[int, int], arrived: threading.Semaphore
) -> Iterator[FrameSet]:
    """Frame sets, each when the one before has arrived."""
    photograph = np.tile(np.asarray(data.coffee(), np.uint8), (2, 3, 1))  # type: ignore[no-untyped-call]
    for index in range(count):
        left = (3 * index) % 500
        pictures = {
            (0, col): photograph[: array.height, left + 6 * col : left + 6 * col + array.width]
            for col in array.real_cols
        }
        given_ns[index] = time.monotonic_ns()
        yield FrameSet(index, round(index * 1e9 / array.fps), pictures)
        arrived.acquire()


def _collect(lines: Iterable[bytes], found: list[tuple[int, int, int]], arrived: threading.Semaphore) -> None:
    for line in lines:
        index, done_ns, took_ns = json.loads(line)
        found.append((index, done_ns, took_ns))
        arrived.release()


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--receive", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.receive:
        receive()
        return 0
    width, height = map(int, arguments.size.split("x"))
    array = CameraArray(1, 3, width, height, FPS, (0,), (0, 2), Calibration.nominal(width, height))
    receiver = subprocess.Popen(
        [sys.executable, __file__, "--receive"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=False
    )
    assert receiver.stdin is not None
    assert receiver.stdout is not None
    given_ns: dict[int, int] = {}
    arrived, found = threading.Semaphore(0), list[tuple[int, int, int]]()
    collector = threading.Thread(target=_collect, args=(receiver.stdout, found, arrived))
    collector.start()
    config = EncoderConfig(preset="veryfast", disparity_range_px=(0.0, 32.0))
    pipe = os.fdopen(os.dup(receiver.stdin.fileno()), "wb", buffering=0)
    receiver.stdin.close()
    with pipe, _TimedEncoder(array, config) as encoder, McapWriter(pipe, chunk_ms=0) as writer:
        LiveEncoding(encoder, writer).run(_frame_sets(array, arguments.frames, given_ns, arrived))
    collector.join()
    whole, computed = [], []
    for index, done_ns, took_ns in found:
        if index >= WARM_UP:
            whole.append((done_ns - given_ns[index]) / 1e6)
            computed.append((took_ns + encoder.took_ns[index]) / 1e6)
    receiver.wait()
    ratio = np.array(whole) / np.array(computed)
    for name, values, unit in (
        ("whole way", whole, "ms"),
        ("computed", computed, "ms"),
        ("ratio", ratio, ""),
    ):
        median, high = np.percentile(values, [50, 99])
        print(f"{name:10} median {median:8.3f} {unit:2}  99 % {high:8.3f} {unit}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

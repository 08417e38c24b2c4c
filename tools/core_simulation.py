"""What more cores would give: a run with all its jobs, traced on one thread and played again on any number.

    python tools/core_simulation.py [--cores 1,2,8,32] [--size 640x480]

Work is cut into as many bands as it would be on so many cores, and done one job after the other, so that the
times are those of a core by itself. Then the jobs are handed out as `mvcodec.workers` does. What is left out:
that cores share caches and memory, and that another frame set can begin before the last one ends.
"""

from __future__ import annotations

import argparse
import contextlib
import heapq
import itertools
import math
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from speed_measures import QP, material

from mvcodec import workers
from mvcodec.array import Viewpoint
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.synthesis.synthesizers import make_synthesizer

REPEATS = 3
ENDLESS = 10_000
"""More cores than there are jobs."""


@dataclass(eq=False)
class Traced:
    """What a job did, in order: ("work", seconds), ("submit", job), ("wait", job)."""

    events: list[tuple[str, Any]] = field(default_factory=list)


class _NoPool:
    """Jobs are done by whoever waits for them, one after the other."""

    def submit(self, begin: Callable[[], None], *, later: bool = False) -> None:
        """Leave it."""

    def take_later(self) -> None:
        """Nothing is ever waited for."""


@contextlib.contextmanager
def _tracing(root: Traced) -> Iterator[None]:
    """Note what happens inside of the block, on this thread, under `root`."""
    kept, pool, begin = workers.Job, workers._pool, workers.Job.begin
    traces: dict[workers.Job[Any], Traced] = defaultdict(Traced)
    doing, since = [root], [time.thread_time()]

    def work() -> None:
        now = time.thread_time()
        doing[-1].events.append(("work", now - since[0]))
        since[0] = now

    class Noted(workers.Job[Any]):
        def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
            super().__init__(function, arguments)
            work()
            doing[-1].events.append(("submit", traces[self]))

        def begin(self) -> None:
            if self.done:
                return
            work()
            doing[-1].events.append(("wait", traces[self]))
            doing.append(traces[self])
            begin(self)
            work()
            doing.pop()

    workers.Job, workers._pool = Noted, lambda _count: _NoPool()  # type: ignore[misc,assignment,return-value]
    try:
        yield
        work()
    finally:
        workers.Job, workers._pool = kept, pool  # type: ignore[misc]


def play(root: Traced, cores: int) -> float:
    """Seconds that traced work takes on so many cores."""
    waiting: list[Traced] = []
    begun, done = {root}, set[Traced]()
    waiters: defaultdict[Traced, list[int]] = defaultdict(list)
    stacks: dict[int, list[list[Any]]] = {0: [[root, 0]]}
    idle = list(range(min(cores, ENDLESS) - 1, 0, -1))
    order = itertools.count()
    agenda = [(0.0, next(order), 0)]
    while True:
        now, _, core = heapq.heappop(agenda)
        stack = stacks.setdefault(core, [])
        while True:
            if not stack:
                free = next((job for job in waiting if job not in begun), None)
                if free is None:
                    idle.append(core)
                    break
                begun.add(free)
                stack.append([free, 0])
            job, place = stack[-1]
            if place == len(job.events):
                done.add(job)
                stack.pop()
                if job is root:
                    return now
                for other in waiters.pop(job, ()):
                    heapq.heappush(agenda, (now, next(order), other))
                continue
            what, detail = job.events[place]
            if what == "wait" and detail in begun and detail not in done:
                waiters[detail].append(core)
                break
            stack[-1][1] += 1
            if what == "work":
                heapq.heappush(agenda, (now + detail, next(order), core))
                break
            if what == "submit":
                waiting.append(detail)
                if idle:
                    heapq.heappush(agenda, (now, next(order), idle.pop()))
            elif detail not in begun:
                begun.add(detail)
                stack.append([detail, 0])


def alone(root: Traced) -> float:
    """Seconds of the work that no other core can take: what the first thread does between its jobs."""
    return math.fsum(detail for what, detail in root.events if what == "work")


def works(size: tuple[int, int]) -> dict[str, Callable[[], object]]:
    """What is simulated, each to be done again and again."""
    made = material(*size, frames=2)

    def encoding(speed: str) -> Callable[[], object]:
        config = EncoderConfig(qp=QP, speed=speed, disparity_range_px=made.range_px)
        encoder, number = Encoder(made.array, config), itertools.count()

        def push() -> None:
            count = next(number)
            found = made.frame_sets[count % 2]
            encoder.push(type(found)(count, round(count * 1e9 / made.array.fps), found.pictures))

        return push

    with Encoder(made.array, EncoderConfig(qp=QP, speed="realtime", disparity_range_px=made.range_px)) as one:
        packets = one.push(made.frame_sets[0])

    def decoding() -> None:
        with Decoder() as decoder:
            (found,) = (decoded for packet in packets for decoded in decoder.push(packet))
            workers.run_all(found.pictures.__getitem__, made.array.real)
            workers.run_all(found.disparities.__getitem__, made.array.real)

    with Decoder() as decoder:
        (decoded,) = (found for packet in packets for found in decoder.push(packet))
    synthesizer = make_synthesizer("layered")
    return {
        "coding a frame set, `realtime`": encoding("realtime"),
        "coding a frame set, `best`": encoding("best"),
        "decoding a frame set, all looked at": decoding,
        "a view, `layered`": lambda: synthesizer.render(decoded, Viewpoint(0.4, 0.3)),
    }


def traced(work: Callable[[], object], cores: int) -> Traced:
    """The quickest of some runs, cut for so many cores."""
    roots = []
    with workers.threads(cores):
        for _ in range(REPEATS):
            root = Traced()
            with _tracing(root):
                work()
            roots.append(root)
    return min(roots, key=lambda root: play(root, 1))


def main() -> int:
    """Trace, play, print a table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--cores", default="1,2,8,32", metavar="A,B")
    parser.add_argument("--size", default="640x480", metavar="WxH")
    arguments = parser.parse_args()
    counts = [int(count) for count in arguments.cores.split(",")]
    width, height = (int(side) for side in arguments.size.split("x"))
    cv2.setNumThreads(1)
    heads = " | ".join(f"{count}, ms" for count in counts)
    print(f"| work | {heads} | longest chain, ms | of it between jobs, ms |")
    print("|---" * (len(counts) + 3) + "|")
    for name, work in works((width, height)).items():
        with workers.threads(1):
            work()
        roots = {count: traced(work, count) for count in counts}
        times = " | ".join(f"{1e3 * play(root, count):.1f}" for count, root in roots.items())
        last = roots[counts[-1]]
        print(f"| {name} | {times} | {1e3 * play(last, ENDLESS):.1f} | {1e3 * alone(last):.1f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

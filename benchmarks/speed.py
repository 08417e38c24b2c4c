"""How fast: the encoder, matching, views and decoding over stock code on the same pictures in the same run.

    python benchmarks/speed.py [--json] [--rows encoding,matching,memory,views,decoding,...] [--threads N]

Both sides of a row take turns; the least time of each counts, so that other work on the machine matters
little. Two threads; the stock match has one. The material is the sample scene, rendered in memory.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from collections.abc import Iterator

import av
import cv2
import numba
import numpy as np
from speed_encoding import MEMORY_RANGE, MEMORY_SIZE, encoding_rows, matching_rows, peak_mib
from speed_measures import Row
from speed_threads import thread_rows
from speed_viewing import decoding_rows, delay_row, viewing_rows

import mvcodec
from mvcodec.workers import set_threads, thread_count

MEMORY_GOALS = 1536, 1024
KINDS = ("encoding", "matching", "memory", "views", "decoding", "threads", "delay")


def machine() -> dict[str, str | int]:
    """What it ran on, and with."""
    name = ""
    if os.path.exists("/proc/cpuinfo"):  # noqa: PTH110
        with open("/proc/cpuinfo", encoding="utf-8") as file:  # noqa: PTH123
            name = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), "")
    return {
        "processor": name or platform.processor(),
        "cores": os.cpu_count() or 0,
        "threads": thread_count(),
        "python": platform.python_version(),
        "mvcodec": mvcodec.__version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
        "opencv": cv2.__version__,
        "pyav": av.__version__,
    }


def rows_of(kinds: list[str]) -> Iterator[Row]:
    """The rows asked for, each as soon as it is measured."""
    if "encoding" in kinds:
        yield from encoding_rows()
    if "views" in kinds:
        yield from viewing_rows()
    if "decoding" in kinds:
        yield from decoding_rows()
    if "threads" in kinds:
        yield from thread_rows()
    if "delay" in kinds:
        yield delay_row()
    if "matching" in kinds:  # the last: it narrows OpenCV to one thread
        yield from matching_rows()


def main() -> int:
    """Measure, print; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rows", default=",".join(KINDS), metavar="A,B", help=f"of {', '.join(KINDS)}")
    parser.add_argument("--threads", type=int, metavar="N", help="default: one for each core")
    arguments = parser.parse_args()
    kinds = arguments.rows.split(",")
    if not set(kinds) <= set(KINDS):
        parser.error(f"--rows: found {arguments.rows}, expected some of {', '.join(KINDS)}")
    set_threads(arguments.threads)
    stream = sys.stderr if arguments.json else sys.stdout
    print(f"{'work':72}   ours ms  stock ms     (CPU     CPU)  ratio  must   aim", file=stream)
    rows = []
    for row in rows_of(kinds):
        rows.append(row)
        goals = " ".join(f"{'' if goal is None else goal:>5}" for goal in (row.must, row.aim))
        times = f"{row.ours_ms:9.2f} {row.theirs_ms:9.2f} {row.ours_cpu_ms:8.2f} {row.theirs_cpu_ms:8.2f}"
        print(f"{row.work:72} {times} {row.ratio:6.2f} {goals}  {row.note}", file=stream, flush=True)
    document = {"machine": machine(), "rows": [row.to_json() for row in rows]}
    if "memory" in kinds:
        size = "{} x {}".format(*MEMORY_SIZE)
        work = f"memory of matching 2 x 2 at {size}, {MEMORY_RANGE[1] + 3} levels, best, MiB"
        must, aim = MEMORY_GOALS
        document["memory"] = {"work": work, "mib": peak_mib("joint"), "must": must, "aim": aim}
        print(f"{work}: {document['memory']['mib']:.0f} (must {must}, aim {aim})", file=stream)  # type: ignore[index]
    if arguments.json:
        print(json.dumps(document, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())

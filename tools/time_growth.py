"""How time and memory grow: with picture size, levels, real cameras, virtual views and frames.

    python tools/time_growth.py [--sweeps size,levels,cameras,views,frames] [--figure FILE.png]

CPU time of one thread, each sweep in a process of its own, from small to large, so that the most memory
that the process had at each step is that step's own. Pictures are two planes of noise; compiled code and one
small run come first. Printed: each step, and for each line by which power of what is varied it grows from
its last step but one to its last.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from mvcodec.array import Calibration, CameraArray, Position, Viewpoint
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.speed_choice import SPEEDS
from mvcodec.frames import DecodedSet, FrameSet, Picture
from mvcodec.layers.refinement import make_matcher
from mvcodec.stereo.matcher import SelectiveMatcher
from mvcodec.stream import map_cameras
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.workers import set_threads

LEVELS = 64
LEAST_SECONDS = 0.3
"""What each step is measured for."""

SIZES = ((360, 270), (640, 480), (1152, 864), (1632, 1224), (3264, 2448))
SWEEPS: dict[str, tuple[str, tuple[str, ...]]] = {
    "size": ("pixels of a picture", (*SPEEDS, "layered", "quick")),
    "levels": ("levels of disparity", tuple(SPEEDS)),
    "cameras": ("real cameras", tuple(SPEEDS)),
    "views": ("virtual views", ("layered", "quick")),
    "frames": ("frame sets, coded", ("realtime",)),
}
"""What is varied: in words, and what is measured."""

Step = tuple[float, float, float]
"""How much of what is varied, CPU seconds, MiB."""


def planes(rows: int, cols: int, size: tuple[int, int], levels: int) -> tuple[CameraArray, FrameSet]:
    """An array whose cameras are all real, and what they see: noise on a wall and on a square before it."""
    width, height = size
    array = CameraArray(
        rows, cols, width, height, 25.0, tuple(range(rows)), tuple(range(cols)), Calibration.nominal(*size)
    )
    far, near = round(0.3 * levels), round(0.7 * levels)
    draw = np.random.default_rng(1)
    reach = near * max(rows, cols)
    noise = draw.integers(0, 256, (2, height + reach, width + reach, 3), np.uint8)
    wall, square = (np.asarray(cv2.GaussianBlur(part, (0, 0), 1), np.uint8) for part in noise)
    pictures: dict[Position, Picture] = {}
    for row, col in array.real:
        picture = wall[far * row : far * row + height, far * col : far * col + width].copy()
        top, left = max(height // 2 - near * row, 0), max(width // 2 - near * col, 0)
        part = picture[top : top + height // 4, left : left + width // 4]
        part[:] = square[: part.shape[0], : part.shape[1]]
        pictures[row, col] = picture
    return array, FrameSet(0, 0, pictures)


def matching(speed: str, rows: int, cols: int, size: tuple[int, int], levels: int) -> Callable[[], object]:
    """The maps of a frame set as a speed makes them."""
    array, frame_set = planes(rows, cols, size, levels)
    matcher, span = make_matcher(SPEEDS[speed].matcher), (0.0, levels - 1.0)
    if isinstance(matcher, SelectiveMatcher):
        cameras = map_cameras(array, "alternate")
        return lambda: matcher.match_cameras(array, frame_set.pictures, span, cameras, fresh=False)
    return lambda: matcher.match(array, frame_set.pictures, span)


def viewing(name: str, size: tuple[int, int], views: int) -> Callable[[], object]:
    """Virtual views of one frame set between four cameras."""
    array, frame_set = planes(2, 2, size, LEVELS)
    maps = make_matcher("realtime").match(array, frame_set.pictures, (0.0, LEVELS - 1.0))
    decoded = DecodedSet(array, 0, 0, frame_set.pictures, maps, (0.0, LEVELS - 1.0), ())
    synthesizer = make_synthesizer(name)
    places = [Viewpoint(row, col) for row, col in np.random.default_rng(2).uniform(0.05, 0.95, (views, 2))]

    def render() -> None:
        for place in places:
            synthesizer.render(decoded, place)

    return render


def coding(frames: int) -> Callable[[], object]:
    """Frame sets of four cameras to packets, in real time."""
    array, frame_set = planes(2, 2, (320, 240), LEVELS)
    config = EncoderConfig(speed="realtime", disparity_range_px=(0.0, LEVELS - 1.0), threads=1)

    def code() -> None:
        with Encoder(array, config) as encoder:
            for number in range(frames):
                encoder.push(FrameSet(number, 40_000_000 * number, frame_set.pictures))

    return code


def steps(sweep: str, what: str) -> Iterator[tuple[float, Callable[[], object]]]:
    """How much of what is varied, and the work; one that is small and does not count first."""
    if sweep == "size":
        for size in (SIZES[0], *SIZES):
            whole = matching(what, 2, 2, size, LEVELS) if what in SPEEDS else viewing(what, size, 1)
            yield size[0] * size[1], whole
    elif sweep == "levels":
        for levels in (16, 16, 32, 64, 128, 256):
            yield levels, matching(what, 2, 2, (320, 240), levels)
    elif sweep == "cameras":
        for rows, cols in ((1, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5)):
            yield rows * cols, matching(what, rows, cols, (320, 240), LEVELS)
    elif sweep == "views":
        for views in (1, 1, 9, 25, 81, 289):
            yield views, viewing(what, (320, 240), views)
    else:
        for frames in (1, 1, 4, 16, 64):
            yield frames, coding(frames)


def measure(sweep: str, what: str) -> list[Step]:
    """One line, in this process."""
    set_threads(1)
    cv2.setNumThreads(1)
    found = []
    for amount, work in steps(sweep, what):
        # Again, and short work more often: what is compiled first, and other programs, don't count.
        times: list[float] = []
        while len(times) < 2 or sum(times) < LEAST_SECONDS:
            begun = time.process_time()
            work()
            times.append(time.process_time() - begun)
        best = min(times)
        found.append((amount, best, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024))
    return found[1:]


def power(line: list[Step]) -> float:
    """Of what is varied, by which time grows in the last step."""
    (before, early, _), (after, late, _) = line[-2:]
    return math.log(late / early) / math.log(after / before)


def _short(amount: float) -> str:
    return f"{amount:g}" if amount < 1e4 else f"{amount / 1e6:.1f} M"


def draw(lines: dict[tuple[str, str], list[Step]], path: Path) -> None:
    """A panel for each sweep, and one for memory; all axes logarithmic."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    sweeps = list(dict.fromkeys(sweep for sweep, _ in lines))
    figure = Figure(figsize=(9, 5.6), layout="constrained")
    panels = iter(figure.subplots(2, 3).flat)
    colours = dict(zip((*SPEEDS, "layered", "quick"), ("C0", "C1", "C2", "C3", "C4"), strict=True))
    for sweep in [*sweeps, *(["memory"] if "size" in sweeps else [])]:
        panel = next(panels)
        for (of, what), line in lines.items():
            if of == sweep or (sweep == "memory" and of == "size" and what in SPEEDS):
                amounts, seconds, mib = zip(*line, strict=True)
                figures = mib if sweep == "memory" else seconds
                panel.loglog(amounts, figures, ".-", color=colours[what], label=what)
                panel.set_xticks(amounts, [_short(amount) for amount in amounts])
        panel.set_xlabel(SWEEPS["size" if sweep == "memory" else sweep][0], fontsize=8)
        panel.set_ylabel("MiB" if sweep == "memory" else "CPU seconds", fontsize=8)
        panel.tick_params(which="both", labelsize=7)
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7)
    for panel in panels:
        panel.set_axis_off()
    figure.savefig(path, dpi=100)


def main() -> int:
    """Measure, print, draw; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sweeps", default=",".join(SWEEPS), metavar="A,B")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw them (SVG or PNG)")
    parser.add_argument("--line", nargs=2, metavar=("SWEEP", "WHAT"), help="one of them, as JSON")
    arguments = parser.parse_args()
    if arguments.line:
        print(json.dumps(measure(*arguments.line)))
        return 0
    sweeps = arguments.sweeps.split(",")
    if not set(sweeps) <= SWEEPS.keys():
        parser.error(f"--sweeps: found {arguments.sweeps}, expected some of {', '.join(SWEEPS)}")
    lines = {}
    for sweep in sweeps:
        for what in SWEEPS[sweep][1]:
            command = [sys.executable, __file__, "--line", sweep, what]
            printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            line = lines[sweep, what] = [tuple(step) for step in json.loads(printed)]
            told = "; ".join(f"{amount:g}: {seconds:.3f} s, {mib:.0f} MiB" for amount, seconds, mib in line)
            print(f"{SWEEPS[sweep][0]}, {what}: {told}; last power {power(line):.2f}", flush=True)
    if arguments.figure:
        draw(lines, arguments.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Rows of the benchmark of speed about threads: two over one, in matching, rendering and decoding."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import cv2
from speed_measures import QP, REPEATS, Row, material, take_turns

from mvcodec.array import Viewpoint
from mvcodec.decoding.decoder import Decoder
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.speed_choice import SPEEDS
from mvcodec.layers.refinement import make_matcher
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.workers import run_all, threads

GAIN = 1.7
"""Two threads must be so many times as fast as one."""


def thread_rows(size: tuple[int, int] = (640, 480), repeats: int = REPEATS) -> Iterator[Row]:
    """Wall time with two threads over that with one; OpenCV's own threads are as many."""
    made = material(*size)
    with Encoder(
        made.array, EncoderConfig(qp=QP, speed="realtime", disparity_range_px=made.range_px)
    ) as coder:
        packets = coder.push(made.frame_sets[0])
    with Decoder() as decoder:
        (decoded,) = (found for packet in packets for found in decoder.push(packet))
    matcher, synthesizer = make_matcher(SPEEDS["best"].matcher), make_synthesizer("layered")
    pictures = made.frame_sets[0].pictures

    def decode() -> None:
        with Decoder() as decoder:
            (found,) = (each for packet in packets for each in decoder.push(packet))
            run_all(found.pictures.__getitem__, made.array.real)
            run_all(found.disparities.__getitem__, made.array.real)

    works: dict[str, Callable[[], object]] = {
        "maps of a frame set, best": lambda: matcher.match(made.array, pictures, made.range_px),
        "one virtual view, layered": lambda: synthesizer.render(decoded, Viewpoint(0.4, 0.3)),
        "decode a frame set, all looked at": decode,
    }

    def on(count: int, work: Callable[[], object]) -> None:
        cv2.setNumThreads(count)
        with threads(count):
            work()

    before = cv2.getNumThreads()
    try:
        for name, work in works.items():
            text = f"{name}, two threads / one"
            two, one = partial(on, 2, work), partial(on, 1, work)
            yield take_turns(text, two, one, (round(1 / GAIN, 2), None), repeats=repeats)
    finally:
        cv2.setNumThreads(before)

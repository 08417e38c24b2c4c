"""Rows of the benchmark of speed about encoding: the whole encoder, matching alone, and its memory."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
from speed_measures import QP, REPEATS, Material, Row, material, stock_code, stock_match, take_turns

from mvcodec.array import Calibration, CameraArray
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.encoding.speed_choice import SPEEDS
from mvcodec.layers.refinement import make_matcher
from mvcodec.stereo.matcher import SelectiveMatcher
from mvcodec.stream import map_cameras

CHAINS = {(640, 480): (5, 4, 25, 30), (1280, 720): (None, None, 8, 12), (960, 640): (None, None, 12, 16)}
"""Size: largest ratio that must be reached and is aimed at, and the least frame sets a second, idle."""

MATCHING = {"realtime": (0.8, 0.5), "balanced": (4, 3), "best": (14, 8)}
"""Speed: matching of a frame set over one stock call of a pair, CPU time; must, aim."""

MEMORY_SIZE, MEMORY_RANGE = (1920, 1080), (0, 157)


def encoding_rows() -> Iterator[Row]:
    """The real-time encoder, frames in memory to packets, over libx264 veryfast alone."""
    for (width, height), (must, aim, must_rate, aim_rate) in CHAINS.items():
        made = material(width, height)
        preset = SPEEDS["realtime"].preset
        row = take_turns(
            f"realtime, 2 x 2 at {width} x {height} / libx264 {preset} alone",
            lambda made=made: encode_all(made, "realtime"),  # type: ignore[misc]
            stock_code(made, preset),
            (must, aim),
            units=len(made.frame_sets),
        )
        note = f"{1000 / row.ours_ms:.1f} frame sets a second; must be {must_rate}, better {aim_rate}"
        yield replace(row, note=note)


def encode_all(made: Material, speed: str) -> None:
    """All frame sets to packets."""
    config = EncoderConfig(qp=QP, speed=speed, disparity_range_px=made.range_px, threads=2)
    with Encoder(made.array, config) as encoder:
        for frame_set in made.frame_sets:
            encoder.push(frame_set)


def matching_rows(size: tuple[int, int] = (640, 480)) -> Iterator[Row]:
    """The maps of a frame set by each speed's matcher, over one StereoSGBM call."""
    made = material(*size)
    cv2.setNumThreads(1)
    for speed, goals in MATCHING.items():
        matcher = make_matcher(SPEEDS[speed].matcher)
        pictures = made.frame_sets[1].pictures
        cameras = map_cameras(made.array, "alternate")

        def match(matcher=matcher, pictures=pictures, cameras=cameras) -> None:  # type: ignore[no-untyped-def]
            if isinstance(matcher, SelectiveMatcher):
                matcher.match_cameras(made.array, pictures, made.range_px, cameras, fresh=False)
            else:
                matcher.match(made.array, pictures, made.range_px)

        what = f"maps of a frame set, {speed} / one StereoSGBM 3-way call, 1 thread (CPU)"
        repeats = REPEATS if speed == "best" else 3 * REPEATS
        yield take_turns(what, match, stock_match(made), goals, by_cpu=True, repeats=repeats)


def peak_mib(matcher: str) -> float:
    """How much more memory a process of its own holds at most for having matched, MiB."""
    command = [sys.executable, __file__, matcher]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(json.loads(done.stdout))


def _peak_of_this_process(matcher: str) -> float:
    """Match noise: time and memory do not depend on what is to be seen."""
    width, height = MEMORY_SIZE
    array = CameraArray(2, 2, width, height, 25.0, (0, 1), (0, 1), Calibration(width, width, 0, 0, 1))
    rng = np.random.default_rng(1)
    small = CameraArray(2, 2, 64, 48, 25.0, (0, 1), (0, 1), Calibration(width, width, 0, 0, 1))
    made = make_matcher(matcher)
    pictures = {camera: rng.integers(0, 256, (48, 64, 3), np.uint8) for camera in array.real}
    made.match(small, pictures, (0.0, 8.0))  # what compiled code takes is no part of it
    pictures = {camera: rng.integers(0, 256, (height, width, 3), np.uint8) for camera in array.real}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    made.match(array, pictures, MEMORY_RANGE)
    return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024


if __name__ == "__main__":
    print(_peak_of_this_process(sys.argv[1]))

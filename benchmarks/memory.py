"""Peak memory of encoding, decoding and playing 200 and 2000 frame sets of 320 x 240: it must not grow.

    python benchmarks/memory.py [--short 200] [--long 2000] [--cache-mib 16]

Each run is a process of its own; the figure is the most resident memory that it ever had. Playing is measured
with a cache of 16 MiB, which the short run fills: the player's own of 256 MiB is full only after 218 of these
frame sets, so it wants --short 400 --cache-mib 256.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.container import McapWriter
from mvcodec.decoding.decoder import Decoder
from mvcodec.decoding.frame_store import FrameStore
from mvcodec.encoding.encoder import Encoder, EncoderConfig
from mvcodec.frames import FrameSet
from mvcodec.synthesis.synthesizers import make_synthesizer

WIDTH, HEIGHT, FPS = 320, 240, 25.0
ALLOWED = 0.05
CACHE_MIB = 16


def _array() -> CameraArray:
    return CameraArray(1, 3, WIDTH, HEIGHT, FPS, (0,), (0, 2), Calibration.nominal(WIDTH, HEIGHT))


def encode(path: Path, count: int, _cache_mib: int) -> None:
    """Code a texture that moves."""
    texture = np.random.default_rng(0).integers(0, 255, (HEIGHT // 8 + 9, WIDTH // 8 + 99, 3), np.uint8)
    texture = texture.repeat(8, axis=0).repeat(8, axis=1)
    config = EncoderConfig(preset="ultrafast", matcher="ssd", disparity_range_px=(0.0, 16.0))
    with Encoder(_array(), config) as encoder, McapWriter(path) as writer:
        for index in range(count):
            left = index % 600
            pictures = {(0, 0): texture[:HEIGHT, left : left + WIDTH]}
            pictures[0, 2] = texture[:HEIGHT, left + 8 : left + 8 + WIDTH]
            writer.push(encoder.push(FrameSet(index, round(index * 1e9 / FPS), pictures)))


def decode(path: Path, count: int, _cache_mib: int) -> None:
    """Decode and render one view of each frame set."""
    synthesizer = make_synthesizer("layered")
    with Decoder.open(path) as decoder:
        rendered = [synthesizer.render(found, Viewpoint(0, 1)).pixels.shape[0] for found in decoder]
    assert len(rendered) == count


def play(path: Path, count: int, cache_mib: int) -> None:
    """Ask for every frame set as the player does; its cache must be full in the short run already."""
    store = FrameStore(path, cache_bytes=cache_mib << 20)
    synthesizer = make_synthesizer("layered")
    for number in range(count):
        stored = store.fetch(number)
        assert stored.decoded is not None
        synthesizer.render(stored.decoded, Viewpoint(0, 1))
    store.close()


STAGES: dict[str, Callable[[Path, int, int], None]] = {"encode": encode, "decode": decode, "play": play}


def _peak_mib(stage: str, path: Path, count: int, cache_mib: int) -> float:
    command = [sys.executable, __file__, "--stage", stage, "--file", str(path), "--long", str(count)]
    command += ["--cache-mib", str(cache_mib)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def main() -> int:
    """Measure every stage at both lengths; exit code 1 where one grows by more than 5 %."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--short", type=int, default=200)
    parser.add_argument("--long", type=int, default=2000)
    parser.add_argument("--cache-mib", type=int, default=CACHE_MIB, help="of the player")
    parser.add_argument("--stage", choices=STAGES, help=argparse.SUPPRESS)
    parser.add_argument("--file", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.stage:
        STAGES[arguments.stage](arguments.file, arguments.long, arguments.cache_mib)
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
        return 0
    grown = False
    with tempfile.TemporaryDirectory() as folder:
        for stage in STAGES:
            peaks = [
                _peak_mib(stage, Path(folder) / f"{count}.mcap", count, arguments.cache_mib)
                for count in (arguments.short, arguments.long)
            ]
            growth = peaks[1] / peaks[0] - 1
            grown |= growth > ALLOWED
            print(f"{stage:6} {peaks[0]:7.1f} MiB {peaks[1]:7.1f} MiB {growth:+7.1%}", flush=True)
    return int(grown)


if __name__ == "__main__":
    sys.exit(main())

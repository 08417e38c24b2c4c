"""Compiles what pictures need, or loads it compiled, before the first viewer moves."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

import numpy as np

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.decoding.derived_maps import derive_map
from mvcodec.frames import DecodedSet, DisparityMap
from mvcodec.kernels import on_first_compilation
from mvcodec.stream import map_cameras
from mvcodec.synthesis.synthesizer import Synthesizer
from mvcodec.video.codec import Planes
from mvcodec.video.colour import to_picture
from mvcodec.video.map_size import enlarged

WIDTH, HEIGHT = 64, 48
RANGE_PX = (0.0, 8.0)


def warm_up_beside(
    makers: Sequence[Callable[[], Synthesizer]], on_compiling: Callable[[], object]
) -> threading.Thread:
    """Warm up in a thread of its own, which nothing waits for when the program ends.

    Args:
        on_compiling: called if something has to be compiled, which happens once after an installation.
    """
    on_first_compilation(on_compiling)
    thread = threading.Thread(target=warm_up, args=(makers,), name="warm-up", daemon=True)
    thread.start()
    return thread


def warm_up(makers: Sequence[Callable[[], Synthesizer]]) -> None:
    """Render one small view by each synthesizer: its kernels are the same for all sizes."""
    decoded = _small_set()
    _decode_little(decoded)
    for make in makers:
        make().render(decoded, Viewpoint(0.4, 0.6))


def _decode_little(decoded: DecodedSet) -> None:
    """What decoding does with pictures and maps when they are first looked at."""
    grey = np.full((HEIGHT, WIDTH), 128, np.uint8)
    chroma = np.full((HEIGHT // 2, WIDTH // 2), 128, np.uint8)
    picture = to_picture(Planes(grey, chroma, chroma), WIDTH, HEIGHT)
    small = np.full((HEIGHT // 2, WIDTH // 2), RANGE_PX[0], np.float32)
    sent = {camera: enlarged(small, picture) for camera in map_cameras(decoded.array, "alternate")}
    derive_map(decoded.array, sent, RANGE_PX, (0, 1))


def _small_set() -> DecodedSet:
    """Four cameras before a textured wall, with something nearer in the middle."""
    random = np.random.default_rng(0)
    array = CameraArray(2, 2, WIDTH, HEIGHT, 1.0, (0, 1), (0, 1), Calibration.nominal(WIDTH, HEIGHT))
    pictures, maps = {}, {}
    for camera in array.real:
        pictures[camera] = random.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
        values = np.full((HEIGHT, WIDTH), 2.0, np.float32)
        values[16:32, 24:40] = 6.0
        maps[camera] = DisparityMap(values, np.ones((HEIGHT, WIDTH), np.bool_))
    return DecodedSet(array, 0, 0, pictures, maps, RANGE_PX)

"""What the benchmark of speed measures with: taking turns, the material, stock code on the same pictures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import cv2
import numpy as np

from mvcodec.array import CameraArray, Viewpoint
from mvcodec.encoding.config import default_gop
from mvcodec.frames import FrameSet, Picture
from mvcodec.scenes.scene import RoomScene, SceneSettings
from mvcodec.stream import TrackKind
from mvcodec.video.codec import Planes, RateControl, VideoSettings
from mvcodec.video.codecs import find_codec
from mvcodec.video.colour import even_size, to_planes
from mvcodec.workers import thread_count

REPEATS = 9
FRAMES = 12
QP = 27


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Attributes:
        work: what was done, over what stock code.
        ours_ms, theirs_ms: wall time, least of all turns, ms.
        ours_cpu_ms, theirs_cpu_ms: CPU time of the process, ms.
        ratio: the figure that must be reached: of wall times, or of CPU times where `by_cpu`.
        must, aim: largest ratio; None: none stated.
        note: what else is told of it.
    """

    work: str
    ours_ms: float
    theirs_ms: float
    ours_cpu_ms: float
    theirs_cpu_ms: float
    must: float | None
    aim: float | None
    by_cpu: bool = False
    note: str = ""

    @property
    def ratio(self) -> float:
        """Ours over theirs."""
        return self.ours_cpu_ms / self.theirs_cpu_ms if self.by_cpu else self.ours_ms / self.theirs_ms

    def to_json(self) -> dict[str, Any]:
        """The form of ``--json``."""
        return {**asdict(self), "ratio": self.ratio}


def take_turns(
    work: str,
    ours: Callable[[], object],
    theirs: Callable[[], object],
    goals: tuple[float | None, float | None] = (None, None),
    *,
    units: int = 1,
    by_cpu: bool = False,
    repeats: int = REPEATS,
) -> Row:
    """Both sides in turn, so that a busy moment of the machine hits both; the least time of each counts.

    Args:
        goals: must, aim.
        units: how many things ours and theirs do in one go; times are of one.
    """
    least = np.full(4, np.inf)
    ours(), theirs()
    for _ in range(repeats):
        least = np.minimum(least, [*_timed(ours), *_timed(theirs)])
    ours_ms, ours_cpu, theirs_ms, theirs_cpu = least * 1e3 / units
    return Row(work, ours_ms, theirs_ms, ours_cpu, theirs_cpu, *goals, by_cpu)


def _timed(work: Callable[[], object]) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - cpu


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Frame sets of the sample scene's real cameras, and the range of their disparity, px."""

    array: CameraArray
    frame_sets: Sequence[FrameSet]
    range_px: tuple[float, float]


@cache
def material(width: int, height: int, grid: tuple[int, int] = (2, 2), frames: int = FRAMES) -> Material:
    """The sample scene in memory."""
    scene = RoomScene(SceneSettings(grid, frames, (width, height)))
    array = scene.array
    frame_sets = []
    for number in range(frames):
        pictures = {camera: scene.render(Viewpoint(*camera), number)[0] for camera in array.real}
        frame_sets.append(FrameSet(number, round(number * 1e9 / array.fps), pictures))
    low, high = array.disparity_hint_px or (0.0, 64.0)
    return Material(array, frame_sets, (math.floor(low), math.ceil(high) + 3))


def stock_match(made: Material) -> Callable[[], object]:
    """One StereoSGBM 3-way call of a pair of that size and range, on one thread."""
    low, high = made.range_px
    stock = cv2.StereoSGBM.create(
        minDisparity=math.floor(low),
        numDisparities=16 * math.ceil((math.ceil(high) - math.floor(low) + 1) / 16),
        blockSize=3,
        P1=8 * 3 * 9,
        P2=32 * 3 * 9,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    pictures = made.frame_sets[0].pictures
    left, right = (pictures[camera] for camera in made.array.real[:2])
    return lambda: stock.compute(left, right)


def stock_code(made: Material, preset: str) -> Callable[[], object]:
    """libx264 alone on all cameras' pictures of all frame sets, planes ready-made, a track to a thread."""
    array = made.array
    width, height = even_size(array.width, array.height)
    settings = VideoSettings(
        TrackKind.TEXTURE, width, height, array.fps, default_gop(array.fps), RateControl(QP), preset
    )
    tracks = [
        [to_planes(frame_set.pictures[camera]) for frame_set in made.frame_sets] for camera in array.real
    ]

    def code(track: list[Planes]) -> None:
        encoder = find_codec("h264").encoder(settings)
        for number, planes in enumerate(track):
            encoder.push(planes, keyframe=number % settings.gop == 0)
        encoder.flush()

    def code_all() -> None:
        with ThreadPoolExecutor(thread_count()) as pool:
            list(pool.map(code, tracks))

    return code_all


def bicubic(picture: Picture) -> Callable[[], object]:
    """One bicubic remap of a picture by a fixed shift."""
    height, width = picture.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    x, y = x + np.float32(0.37), y + np.float32(0.21)
    return lambda: cv2.remap(picture, x, y, cv2.INTER_CUBIC)

"""Still scenes of what is hard to match: wires and spokes, mirrors and plain boards, a glossy floor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.errors import SettingError
from mvcodec.frames import FloatMap, Picture
from mvcodec.scenes.lighting import LightBaker, Lighting
from mvcodec.scenes.reflections import Mirror, MirroredScene
from mvcodec.scenes.renderer import Optics
from mvcodec.scenes.solids import Rectangle, Shape, Sphere, Surface, Vector, box, floor, rectangle, spun

WALL_M, FLOOR_M = 6.0, 0.9
FPS = 24.0

_LIGHTING = Lighting((-1.3, -2.7, 2.3), (1.2, 1.2), (9.5, 8.7, 7.6), (0.40, 0.43, 0.50))
_POINT = (0.5, 0.5, 1e-3, 1e-3)
"""A window of a texture that is as good as one colour."""


@dataclass(frozen=True, slots=True)
class Furniture:
    """What a difficult scene holds, and how it is looked at.

    Attributes:
        shapes: what there is.
        mirrors: those of them that reflect.
        grid: rows and columns of views.
        span_m: between the outermost cameras of the longer side.
        converged_m: where disparity is 0; beyond it is negative.
    """

    shapes: Sequence[Shape]
    mirrors: Sequence[Mirror]
    grid: tuple[int, int]
    span_m: float
    converged_m: float


def wires(chance: np.random.Generator) -> Furniture:
    """A wheel of spokes, poles and wires before bricks."""
    metal = Surface("coins", (0.1, 0.1, 0.4, 2.0), (0.45, 0.45, 0.5))
    shapes: list[Shape] = [_wall("brick", 5.0, (1.1, 0.85, 0.75)), _ground("gravel")]
    for x, z in ((-1.55, 4.6), (-0.35, 5.0), (1.75, 3.9)):
        shapes += box((x + chance.uniform(-0.1, 0.1), -0.6, z), (0.05, 3.0, 0.05), metal, yaw=0.4)
    for y, slope, z in ((-1.1, 0.1, 4.2), (-0.85, -0.04, 4.2), (-0.6, 0.22, 3.4), (0.1, -0.3, 4.8)):
        middle = y + chance.uniform(-0.05, 0.05)
        shapes.append(_bar((-3.0, middle - 3 * slope, z), (3.0, middle + 3 * slope, z), 0.018, metal))
    for x, radius, z in ((-0.75, 0.62, 3.2), (0.85, 0.55, 2.8)):
        shapes += _wheel((x, FLOOR_M - radius, z), radius, metal, float(chance.uniform(0, 0.3)))
    return Furniture(shapes, [], (3, 3), 0.12, 3.9)


def mirrors(chance: np.random.Generator) -> Furniture:
    """Two mirrors, and plain boards and balls that are as bright as what is behind them, or not."""
    shapes: list[Shape] = [_wall("moon", 1.5, (1.0, 0.95, 0.85)), _ground("grass")]
    behind = Rectangle(
        np.array([4.0, -2.5, -3.0]), np.array([-8.0, 0, 0]), np.array([0, 3.4, 0]), Surface("coffee")
    )
    shapes.append(behind)
    faces = [
        rectangle((x, y, z), width, height, Surface("moon", _POINT, (0.2, 0.22, 0.25)))
        for x, y, z, width, height in ((-1.0, -0.35, 4.6, 1.3, 1.5), (1.5, -0.2, 3.6, 0.8, 1.4))
    ]
    shapes += faces
    for face in faces:
        x, y, z = (float(place) for place in face.corner + (face.across + face.down) / 2)
        shapes += _frame((x, y, z - 0.02), float(face.across[0]), float(face.down[1]))
    for x, y, z, width, height, level in (
        (0.25, -0.5, 4.9, 0.8, 1.0, 1.0),
        (0.55, 0.35, 3.3, 0.5, 0.7, 0.6),
        (-0.35, 0.4, 2.9, 0.45, 0.6, 1.25),
        (2.3, -0.4, 5.2, 0.7, 1.6, 0.85),
    ):
        tint = tuple(level * float(share) for share in chance.uniform(0.85, 1.1, 3))
        shapes += box((x, y, z), (width, height, 0.03), Surface("moon", _POINT, (tint[0], tint[1], tint[2])))
    for x, z, radius in ((-1.15, 3.1, 0.22), (1.05, 2.7, 0.16)):
        looks = Surface("astronaut", (0.0, 0.0, 0.05, 0.05), (0.9, 0.6, 0.5))
        shapes.append(Sphere((x, FLOOR_M - radius, z), radius, looks, spun(1.0)))
    return Furniture(shapes, [Mirror(face, 0.85) for face in faces], (3, 3), 0.12, 3.9)


def studs(chance: np.random.Generator) -> Furniture:
    """A light, glossy floor of studs with a dark window above it, by a wide row of cameras."""
    ground = floor((-4.0, 4.0), (1.0, WALL_M), FLOOR_M, Surface("moon", _POINT, (1.15, 1.12, 1.08)))
    shapes: list[Shape] = [_wall("gravel", 4.0, (0.8, 0.8, 0.85)), ground]
    white, dark = Surface("moon", _POINT, (1.1, 1.1, 1.05)), Surface("moon", _POINT, (0.12, 0.13, 0.16))
    for z in np.arange(2.1, 5.8, 0.46):
        for x in np.arange(-2.3, 2.4, 0.46):
            shapes.append(Sphere((float(x), FLOOR_M, float(z)), 0.11, white, spun(0.0)))
    shapes += box(
        (0.2, -0.75, WALL_M - 0.05), (1.9, 1.5, 0.06), Surface("grass", (0, 0, 1, 1), (1.3, 1.2, 1.1))
    )
    shapes.append(rectangle((0.2, -0.75, WALL_M - 0.1), 1.6, 1.2, dark))
    for x, z in ((-1.3, 3.4), (1.2, 2.9), (0.1, 4.4)):
        tint = tuple(float(share) for share in chance.uniform(0.5, 1.2, 3))
        shapes += box(
            (x, FLOOR_M - 0.25, z),
            (0.4, 0.5, 0.4),
            Surface("brick", tint=(tint[0], tint[1], tint[2])),
            yaw=0.5,
        )
    return Furniture(shapes, [Mirror(ground, 0.3)], (1, 5), 0.55, 3.6)


ARRANGEMENTS: dict[str, Callable[[np.random.Generator], Furniture]] = {
    "wires": wires,
    "mirrors": mirrors,
    "studs": studs,
}
SIZE = (400, 300)


class DifficultScene:
    """One of ARRANGEMENTS; nothing moves, and there is one frame.

    Cameras stand in one plane, parallel. Their pictures are cut so that what is `converged_m` away has no
    disparity. The truth of a mirror is its own surface's.

    Args:
        name: of the arrangement.
        grid: rows and columns of views; None: the arrangement's own.
        size: (width, height) px; the width is the focal length.
        seed: of places and colours.
    """

    licence = "Rendered by mvcodec; photographs from scikit-image (CC0 and public domain)"
    frame_count = 1

    def __init__(self, name: str, grid: tuple[int, int] | None, size: tuple[int, int], seed: int) -> None:
        furniture = _furniture(name, seed)
        self._name, self._seed = name, seed
        rows, cols = grid or furniture.grid
        width, height = size
        self._step_m = furniture.span_m / max(rows - 1, cols - 1, 1)
        self._shift_px = width * self._step_m / furniture.converged_m
        self.array = CameraArray(
            rows=rows,
            cols=cols,
            width=width,
            height=height,
            fps=FPS,
            real_rows=tuple(sorted({0, rows - 1})),
            real_cols=tuple(sorted({0, cols - 1})),
            calibration=Calibration(
                width, width, (width - 1) / 2, (height - 1) / 2, self._step_m, -self._shift_px
            ),
            name=name,
        )

    def render(self, viewpoint: Viewpoint, frame: int) -> tuple[Picture, FloatMap]:
        """See Scene; any viewpoint within the grid."""
        self.array.check_viewpoint(viewpoint)
        if frame:
            raise SettingError("frame", frame, "0")
        array = self.array
        right, down = viewpoint.col - (array.cols - 1) / 2, viewpoint.row - (array.rows - 1) / 2
        centre = (
            (array.width - 1) / 2 + right * self._shift_px,
            (array.height - 1) / 2 + down * self._shift_px,
        )
        optics = Optics(array.width, array.height, float(array.width), principal_px=centre)
        picture, inverse_depth = _lit(self._name, self._seed).render(
            optics, (right * self._step_m, down * self._step_m, 0.0)
        )
        return picture, np.float32(array.width * self._step_m) * inverse_depth - np.float32(self._shift_px)


@lru_cache(maxsize=8)
def _furniture(name: str, seed: int) -> Furniture:
    return ARRANGEMENTS[name](np.random.default_rng(seed))


@lru_cache(maxsize=4)
def _lit(name: str, seed: int) -> MirroredScene:
    """Lit once, however many grids and sizes look at it."""
    furniture = _furniture(name, seed)
    light = LightBaker(furniture.shapes, _LIGHTING).bake([])
    return MirroredScene(furniture.shapes, light, furniture.mirrors)


def _wall(name: str, times: float, tint: Vector) -> Rectangle:
    return rectangle(
        (0.0, FLOOR_M - 5.0, WALL_M), 14.0, 10.0, Surface(name, (0.0, 0.0, 1.4 * times, times), tint)
    )


def _ground(name: str) -> Rectangle:
    return floor((-7.0, 7.0), (0.3, WALL_M), FLOOR_M, Surface(name, (0, 0, 6, 3), (0.9, 0.85, 0.75)))


def _frame(centre: Vector, width: float, height: float) -> list[Rectangle]:
    """Four bars around what is so large."""
    x, y, z = centre
    wood, bars = Surface("grass", (0.0, 0.0, 1.2, 1.2), (0.95, 0.68, 0.42)), []
    for side in (-1, 1):
        bars += box((x, y + side * height / 2, z), (width + 0.06, 0.06, 0.04), wood)
        bars += box((x + side * width / 2, y, z), (0.06, height - 0.06, 0.04), wood)
    return bars


def _bar(start: Vector, end: Vector, thickness: float, surface: Surface) -> Rectangle:
    """A flat bar that faces the cameras; both ends are equally far away."""
    along = np.array(end) - np.array(start)
    across = np.array([along[1], -along[0], 0.0]) / np.linalg.norm(along) * thickness
    return Rectangle(np.array(start) - across / 2, across, along, surface)


def _wheel(centre: Vector, radius: float, surface: Surface, turn: float) -> list[Shape]:
    """A rim of flat bars, a hub and spokes."""
    x, y, z = centre
    around = [turn + math.tau * number / 28 for number in range(29)]
    rim = [(x + radius * math.cos(angle), y + radius * math.sin(angle), z) for angle in around]
    bars: list[Shape] = [_bar(start, end, 0.045, surface) for start, end in pairwise(rim)]
    bars += [_bar(centre, end, 0.012, surface) for end in rim[:-1:2]]
    return [*bars, rectangle((x, y, z - 0.01), 0.1, 0.1, surface)]

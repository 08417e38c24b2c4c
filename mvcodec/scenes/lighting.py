"""Light maps: how bright each place of each shape is. They hold for every camera (nothing shines)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mvcodec.scenes.solids import Rectangle, Shape, Sphere, Vector
from mvcodec.workers import run_in_bands

if TYPE_CHECKING:
    from mvcodec.kernels.illumination import Rays, Solids

_GAMMA = 2.2
_TEXEL_M = 0.07
_MAX_SIDE = 128
_MIN_SIDE = 4
_SPHERE_SIZE = (48, 24)


@dataclass(frozen=True, slots=True)
class Lighting:
    """A level rectangular lamp and the light from all around.

    Attributes:
        lamp: middle of the lamp, m.
        lamp_size: its width (along x) and depth (along z), m.
        lamp_colour: irradiance on red, green, blue at 1 m, facing it.
        around: irradiance on red, green, blue of an open surface.
        reach_m: how near a surface shuts out the light from around.
        samples: rays to the lamp, and as many to all sides; a square number.
    """

    lamp: Vector
    lamp_size: tuple[float, float]
    lamp_colour: Vector
    around: Vector
    reach_m: float = 1.0
    samples: int = 36


@dataclass(frozen=True, slots=True, eq=False)
class LightMaps:
    """Light of some shapes, in their order.

    Attributes:
        factors: float32 (M, 3), what the colours are multiplied with; all maps, row by row.
        sizes: int64 (P, 2), width and height of each shape's map.
    """

    factors: NDArray[np.float32]
    sizes: NDArray[np.int64]


class LightBaker:
    """Lights shapes that stand still together with ones that move.

    The rays that standing shapes block of each other are found once.

    Args:
        standing: shapes that stand still.
        lighting: what lights them.
        eye: where the cameras are, about: rectangles that turn their backs to it stay dark.
    """

    def __init__(self, standing: Sequence[Shape], lighting: Lighting, eye: Vector = (0.0, 0.0, 0.0)) -> None:
        self._lighting, self._eye, self._rays = lighting, eye, _rays(lighting)
        self._solids = _solids(standing)
        self._places = _places(standing, eye)
        self._blocked = _blocked(self._places, [self._solids], self._rays)

    def bake(self, moving: Sequence[Shape]) -> LightMaps:
        """Light maps of the standing shapes, then of the moving ones."""
        solids, places = _solids(moving), _places(moving, self._eye)
        blocked = _blocked(self._places, [solids], self._rays, self._blocked)
        lights = [
            _gathered(self._places, blocked, self._rays),
            _gathered(places, _blocked(places, [self._solids, solids], self._rays), self._rays),
        ]
        reaching = np.concatenate(lights)
        light = reaching[:, :1] * self._lighting.lamp_colour + reaching[:, 1:] * self._lighting.around
        factors = (light ** (1 / _GAMMA)).astype(np.float32)
        return LightMaps(factors, np.concatenate([self._places.sizes, places.sizes]))


@dataclass(frozen=True, slots=True, eq=False)
class _Places:
    """Places and unit normals (N, 3) of the light maps of some shapes, and the maps' sizes (P, 2)."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    sizes: NDArray[np.int64]


def _places(shapes: Sequence[Shape], eye: Vector) -> _Places:
    parts = [
        _on_rectangle(shape, np.array(eye)) if isinstance(shape, Rectangle) else _on_sphere(shape)
        for shape in shapes
    ]
    return _Places(
        np.concatenate([np.empty((0, 3)), *(part.points for part in parts)]),
        np.concatenate([np.empty((0, 3)), *(part.normals for part in parts)]),
        np.concatenate([np.empty((0, 2), np.int64), *(part.sizes for part in parts)]),
    )


def _on_rectangle(shape: Rectangle, eye: NDArray[np.float64]) -> _Places:
    normal = shape.normal
    width = height = 1
    if normal @ (eye - shape.corner) > 0:
        width, height = (
            int(np.clip(round(float(np.linalg.norm(edge)) / _TEXEL_M), _MIN_SIDE, _MAX_SIDE))
            for edge in (shape.across, shape.down)
        )
    v, u = np.meshgrid(_middles(height), _middles(width), indexing="ij")
    points = shape.corner + u.reshape(-1, 1) * shape.across + v.reshape(-1, 1) * shape.down
    return _Places(points, np.broadcast_to(normal, points.shape), np.array([[width, height]]))


def _on_sphere(shape: Sphere) -> _Places:
    width, height = _SPHERE_SIZE
    latitude, longitude = np.meshgrid(
        _middles(height) * np.pi, (_middles(width) - 0.5) * 2 * np.pi, indexing="ij"
    )
    ring = np.sin(latitude)
    normals = np.stack([ring * np.sin(longitude), np.cos(latitude), ring * np.cos(longitude)], axis=-1)
    normals = normals.reshape(-1, 3)
    return _Places(np.array(shape.centre) + shape.radius * normals, normals, np.array([_SPHERE_SIZE]))


def _rays(lighting: Lighting) -> Rays:
    from mvcodec.kernels.illumination import Rays

    side = round(lighting.samples**0.5)
    v, u = (part.ravel() for part in np.meshgrid(_middles(side), _middles(side), indexing="ij"))
    offsets = [(u - 0.5) * lighting.lamp_size[0], np.zeros_like(u), (v - 0.5) * lighting.lamp_size[1]]
    # Malley: evenly over the unit disc, lifted to the hemisphere, is as dense as the cosine.
    radius, angle = np.sqrt(v), 2 * np.pi * (u + v)
    around = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - v)])
    return Rays(np.array(lighting.lamp) + np.column_stack(offsets), around, float(lighting.reach_m))


def _solids(shapes: Sequence[Shape]) -> Solids:
    from mvcodec.kernels.illumination import Solids

    flat = [shape for shape in shapes if isinstance(shape, Rectangle)]
    spheres = [[*shape.centre, shape.radius] for shape in shapes if isinstance(shape, Sphere)]
    return Solids(
        corners=np.array([shape.corner for shape in flat], np.float64).reshape(-1, 3),
        normals=np.array([shape.normal for shape in flat], np.float64).reshape(-1, 3),
        across=np.array([shape.across / (shape.across @ shape.across) for shape in flat]).reshape(-1, 3),
        down=np.array([shape.down / (shape.down @ shape.down) for shape in flat]).reshape(-1, 3),
        spheres=np.array(spheres, np.float64).reshape(-1, 4),
    )


def _blocked(
    places: _Places, solids: Sequence[Solids], rays: Rays, known: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Which rays of each place are blocked by the solids, or known to be."""
    from mvcodec.kernels.illumination import find_blocked

    count = len(rays.lamp) + len(rays.around)
    blocked = np.zeros((len(places.points), count), np.bool_) if known is None else known.copy()

    def run(band: slice) -> None:
        for group in solids:
            find_blocked(group, places.points[band], places.normals[band], rays, blocked[band])

    _in_bands(run, len(places.points))
    return blocked


def _gathered(places: _Places, blocked: NDArray[np.bool_], rays: Rays) -> NDArray[np.float64]:
    """(N, 2): what reaches each place from the lamp and from around."""
    from mvcodec.kernels.illumination import gather_light

    out = np.empty((len(places.points), 2))

    def run(band: slice) -> None:
        gather_light(places.points[band], places.normals[band], rays.lamp, blocked[band], out[band])

    _in_bands(run, len(places.points))
    return out


def _in_bands(run: Callable[[slice], None], count: int) -> None:
    """Call `run` on equal parts of 0..count, one in each thread."""
    run_in_bands(count, lambda first, last: run(slice(first, last)))


def _middles(count: int) -> NDArray[np.float64]:
    """The middles of `count` equal parts of 0..1."""
    return (np.arange(count) + 0.5) / count

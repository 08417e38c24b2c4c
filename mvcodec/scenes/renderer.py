"""Renders lit shapes by casting rays: from parallel pinhole cameras, or from turned ones with lenses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Picture
from mvcodec.scenes.lighting import LightMaps
from mvcodec.scenes.solids import Rectangle, Shape, Sphere, Vector
from mvcodec.scenes.textures import photograph, pyramids

if TYPE_CHECKING:
    from mvcodec.kernels.raycast import Shapes
    from mvcodec.kernels.texture import Paint

Matrix = NDArray[np.float64]

_NEAREST_M = 0.05
_CUBE = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_SQUARE = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])


@dataclass(frozen=True, slots=True)
class Optics:
    """A camera: a pinhole where k1 and k2 are 0, else with a lens that distorts (see kernels/raycast.py).

    Attributes:
        width, height: of its pictures, px.
        focal_px: focal length.
        k1, k2: radial distortion; monotonic up to the corners of the picture.
        principal_px: (cx, cy); None: the middle of the picture.
    """

    width: int
    height: int
    focal_px: float
    k1: float = 0.0
    k2: float = 0.0
    principal_px: tuple[float, float] | None = None

    @property
    def centre_px(self) -> tuple[float, float]:
        """(cx, cy): the principal point."""
        return self.principal_px or ((self.width - 1) / 2, (self.height - 1) / 2)

    @property
    def scales(self) -> tuple[float, float]:
        """(least, greatest) factor by which the lens moves what the picture shows from its centre."""
        cx, cy = self.centre_px
        corner = np.hypot(max(cx, self.width - 1 - cx), max(cy, self.height - 1 - cy)) / self.focal_px
        # Twice the corner's radius: what a barrel shows there lies farther out.
        square = np.linspace(0.0, 2.0 * corner, 64) ** 2
        factors = np.clip(1 + square * (self.k1 + square * self.k2), 0.0, None)
        return float(factors.min()), float(factors.max())


class LitScene:
    """Shapes and their light, ready to be seen from anywhere.

    Args:
        shapes: what there is.
        light: their light maps, in the same order.
    """

    def __init__(self, shapes: Sequence[Shape], light: LightMaps) -> None:
        flat = [number for number, shape in enumerate(shapes) if isinstance(shape, Rectangle)]
        order = flat + [number for number, shape in enumerate(shapes) if isinstance(shape, Sphere)]
        rectangles = [shape for shape in shapes if isinstance(shape, Rectangle)]
        spheres = [shape for shape in shapes if isinstance(shape, Sphere)]
        self._corners = np.array([shape.corner for shape in rectangles]).reshape(-1, 3)
        self._edges = np.array([(shape.across, shape.down) for shape in rectangles]).reshape(-1, 2, 3)
        self._normals = np.array([shape.normal for shape in rectangles]).reshape(-1, 3)
        self._spheres = np.array([[*shape.centre, shape.radius] for shape in spheres]).reshape(-1, 4)
        self._turns = np.array([shape.turn for shape in spheres]).reshape(-1, 3, 3)
        self._paint = _paint([shapes[number] for number in order], light, order)

    def render(
        self, optics: Optics, eye: Vector, turn: Matrix | None = None, gain: float = 1.0
    ) -> tuple[Picture, FloatMap]:
        """The picture uint8 (H, W, 3) RGB from `eye`, and float32 1/Z of each pixel's centre, 1/m.

        Args:
            optics: of the camera.
            eye: where it stands, m.
            turn: float64 (3, 3), takes a direction in the scene's axes to one in the camera's; None:
                the camera looks along z. Z is that of the camera's axes.
            gain: factor on the light.
        """
        from mvcodec.kernels.raycast import find_nearest, shade

        shapes = self._before(optics, np.array(eye), np.eye(3) if turn is None else turn)
        paint = self._paint if gain == 1.0 else self._paint._replace(tints=self._paint.tints * gain)
        size = optics.height, optics.width
        numbers, inverse_depth = np.empty(size, np.int16), np.empty(size)
        picture = np.empty((*size, 3), np.uint8)
        find_nearest(shapes, numbers, inverse_depth)
        shade(shapes, paint, numbers, picture)
        return picture, inverse_depth.astype(np.float32)

    def _before(self, optics: Optics, eye: Matrix, turn: Matrix) -> Shapes:
        """The shapes as one camera sees them."""
        from mvcodec.kernels.raycast import Shapes

        towards = (self._corners - eye) @ turn.T
        edges, normals = self._edges @ turn.T, self._normals @ turn.T
        spheres = np.column_stack([(self._spheres[:, :3] - eye) @ turn.T, self._spheres[:, 3]])
        flat_corners = towards[:, None] + np.einsum("ks,qsc->qkc", _SQUARE, edges)
        round_corners = spheres[:, None, :3] + spheres[:, None, 3:] * _CUBE
        return Shapes(
            homographies=_homographies(towards, edges, normals),
            spheres=spheres,
            turns=self._turns @ turn.T,
            boxes=np.concatenate([_pixel_boxes(flat_corners, optics), _pixel_boxes(round_corners, optics)]),
            focal_px=float(optics.focal_px),
            cx_px=optics.centre_px[0],
            cy_px=optics.centre_px[1],
            k1=float(optics.k1),
            k2=float(optics.k2),
            axes=np.ascontiguousarray(turn.T),
        )


def _homographies(
    towards: NDArray[np.float64], edges: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(Q, 3, 3): takes a direction (x, y, 1) to (u * w, v * w, w), w = 1/Z, on each rectangle.

    Args:
        towards: (Q, 3), from the eye to the corners where u = v = 0.
        edges: (Q, 2, 3), from there along u and v.
        normals: (Q, 3).
    """
    distance = np.einsum("qc,qc->q", normals, towards)
    # Seen edge-on it covers nothing: w = 0 everywhere.
    w = np.divide(
        normals, distance[:, None], out=np.zeros_like(normals), where=np.abs(distance[:, None]) > 1e-9
    )
    unit = edges / np.einsum("qsc,qsc->qs", edges, edges)[..., None]
    uv = unit - np.einsum("qsc,qc->qs", unit, towards)[..., None] * w[:, None]
    return np.concatenate([uv, w[:, None]], axis=1)


def _pixel_boxes(points: NDArray[np.float64], optics: Optics) -> NDArray[np.int64]:
    """(P, 4): left, top, right, bottom px (the latter exclusive) around the points of each shape.

    Args:
        points: (P, K, 3) in the camera's axes.
        optics: of the camera.
    """
    depth = points[..., 2]
    size = np.array([optics.width, optics.height])
    offsets = points[..., :2] / np.maximum(depth, _NEAREST_M)[..., None] * optics.focal_px
    # A lens moves each point of an edge by a factor of its own, all within these.
    ends = np.stack([offsets * scale for scale in optics.scales], axis=1)
    low = np.clip(np.floor(ends.min(axis=(1, 2)) + optics.centre_px), 0, size)
    high = np.clip(np.ceil(ends.max(axis=(1, 2)) + optics.centre_px) + 1, 0, size)
    boxes = np.concatenate([low, high], axis=1).astype(np.int64)
    # What reaches behind the camera may cover any of the picture; what is all behind, none.
    boxes[depth.min(axis=1) < _NEAREST_M] = 0, 0, optics.width, optics.height
    boxes[depth.max(axis=1) <= 0] = 0
    return boxes


def _paint(shapes: Sequence[Shape], light: LightMaps, order: Sequence[int]) -> Paint:
    """The looks of the shapes, which are taken from the light maps' order by `order`."""
    from mvcodec.kernels.texture import Paint

    surfaces = [shape.surface for shape in shapes]
    names = tuple(dict.fromkeys(surface.photograph for surface in surfaces))
    texels, levels = _textures(names)
    offsets = np.concatenate([[0], np.cumsum(light.sizes.prod(axis=1))[:-1]])
    return Paint(
        texels=texels,
        levels=levels,
        texture=np.array([names.index(surface.photograph) for surface in surfaces], np.int64),
        windows=np.array([surface.window for surface in surfaces], np.float64),
        tints=np.array([surface.tint for surface in surfaces], np.float64),
        light=light.factors,
        light_maps=np.column_stack([offsets, light.sizes])[list(order)].astype(np.int64),
    )


@lru_cache(maxsize=2)
def _textures(names: tuple[str, ...]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    return pyramids([photograph(name) for name in names])

"""Renders lit shapes from parallel cameras by casting rays."""

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

_NEAREST_M = 0.05
_CUBE = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_SQUARE = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])


@dataclass(frozen=True, slots=True)
class Optics:
    """A pinhole camera that looks along z; the principal point is in the middle of its picture."""

    width: int
    height: int
    focal_px: float

    @property
    def centre_px(self) -> tuple[float, float]:
        """(cx, cy): the principal point."""
        return (self.width - 1) / 2, (self.height - 1) / 2


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

    def render(self, optics: Optics, eye: Vector) -> tuple[Picture, FloatMap]:
        """The picture uint8 (H, W, 3) RGB from `eye`, and float32 1/Z of each pixel's centre, 1/m."""
        from mvcodec.kernels.raycast import find_nearest, shade

        shapes = self._before(optics, np.array(eye))
        size = optics.height, optics.width
        numbers, inverse_depth = np.empty(size, np.int16), np.empty(size)
        picture = np.empty((*size, 3), np.uint8)
        find_nearest(shapes, numbers, inverse_depth)
        shade(shapes, self._paint, numbers, picture)
        return picture, inverse_depth.astype(np.float32)

    def _before(self, optics: Optics, eye: NDArray[np.float64]) -> Shapes:
        """The shapes as one camera sees them."""
        from mvcodec.kernels.raycast import Shapes

        towards = self._corners - eye
        spheres = self._spheres - np.append(eye, 0.0)
        flat_corners = towards[:, None] + np.einsum("ks,qsc->qkc", _SQUARE, self._edges)
        round_corners = spheres[:, None, :3] + spheres[:, None, 3:] * _CUBE
        return Shapes(
            homographies=_homographies(towards, self._edges, self._normals),
            spheres=spheres,
            turns=self._turns,
            boxes=np.concatenate([_pixel_boxes(flat_corners, optics), _pixel_boxes(round_corners, optics)]),
            focal_px=float(optics.focal_px),
            cx_px=optics.centre_px[0],
            cy_px=optics.centre_px[1],
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
    pixels = points[..., :2] / np.maximum(depth, _NEAREST_M)[..., None] * optics.focal_px + optics.centre_px
    low = np.clip(np.floor(pixels.min(axis=1)), 0, size)
    high = np.clip(np.ceil(pixels.max(axis=1)) + 1, 0, size)
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

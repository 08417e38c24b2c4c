"""Flat mirrors and glossy floors: windows through which the scene's mirror image is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask, Picture
from mvcodec.scenes.lighting import LightMaps
from mvcodec.scenes.renderer import LitScene, Optics
from mvcodec.scenes.solids import Rectangle, Shape, Sphere, Vector

_SAME = 1e-5
"""Inverse depths nearer to each other, relatively, are of the same surface."""


@dataclass(frozen=True, slots=True, eq=False)
class Mirror:
    """A rectangle that shows the shapes before it.

    Attributes:
        face: one of the scene's shapes, whose normal points to what it shows.
        share: of its look that is reflected, 0..1; the rest is its own surface's.
    """

    face: Rectangle
    share: float


class MirroredScene:
    """A lit scene with mirrors, which do not show each other's reflections.

    Args:
        shapes: what there is, the mirrors' faces too.
        light: their light maps, in the same order.
        mirrors: which of them reflect.
    """

    def __init__(self, shapes: Sequence[Shape], light: LightMaps, mirrors: Sequence[Mirror]) -> None:
        self._scene = LitScene(shapes, light)
        self._behind = [(mirror, _image(shapes, light, mirror.face)) for mirror in mirrors]

    def render(self, optics: Optics, eye: Vector) -> tuple[Picture, FloatMap]:
        """The picture from `eye`, and 1/Z of the surfaces, a mirror's its own: see `LitScene.render`."""
        picture, inverse_depth = self._scene.render(optics, eye)
        for mirror, image in self._behind:
            seen = _covered(mirror.face, optics, eye, inverse_depth)
            if seen.any():
                shown, _ = image.render(optics, eye)
                mixed = (1 - mirror.share) * picture[seen] + mirror.share * shown[seen]
                picture[seen] = np.rint(mixed).astype(np.uint8)
        return picture, inverse_depth


def _image(shapes: Sequence[Shape], light: LightMaps, face: Rectangle) -> LitScene:
    """The mirror image of the shapes before a face."""
    flip = np.eye(3) - 2 * np.outer(face.normal, face.normal)
    numbers = [number for number, shape in enumerate(shapes) if shape is not face and _is_before(shape, face)]
    starts = np.concatenate([[0], np.cumsum(light.sizes.prod(axis=1))])
    factors = [light.factors[starts[number] : starts[number + 1]] for number in numbers]
    mirrored = [_flipped(shapes[number], face.corner, flip) for number in numbers]
    return LitScene(mirrored, LightMaps(np.concatenate(factors), light.sizes[numbers]))


def _is_before(shape: Shape, face: Rectangle) -> bool:
    middle = np.array(shape.centre) if isinstance(shape, Sphere) else shape.corner
    if isinstance(shape, Rectangle):
        middle = middle + (shape.across + shape.down) / 2
    return float(face.normal @ (middle - face.corner)) > -_SAME


def _flipped(shape: Shape, place: NDArray[np.float64], flip: NDArray[np.float64]) -> Shape:
    if isinstance(shape, Sphere):
        x, y, z = place + flip @ (np.array(shape.centre) - place)
        return Sphere((float(x), float(y), float(z)), shape.radius, shape.surface, shape.turn @ flip)
    corner = place + flip @ (shape.corner - place)
    return Rectangle(corner, flip @ shape.across, flip @ shape.down, shape.surface)


def _covered(face: Rectangle, optics: Optics, eye: Vector, inverse_depth: FloatMap) -> Mask:
    """Where a face is what is seen: its plane has the depth there, and its sides are around."""
    cx, cy = optics.centre_px
    x, y = np.meshgrid(np.arange(optics.width) - cx, np.arange(optics.height) - cy)
    rays = np.stack([x / optics.focal_px, y / optics.focal_px, np.ones(x.shape)], axis=-1)
    towards = face.corner - np.array(eye)
    plane = rays @ face.normal / (face.normal @ towards)
    same = (plane > 0) & (np.abs(plane - inverse_depth) <= _SAME * inverse_depth)
    places = rays / np.where(plane > 0, plane, np.inf)[..., None] - towards
    u, v = (places @ edge / (edge @ edge) for edge in (face.across, face.down))
    return np.asarray(same & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1))

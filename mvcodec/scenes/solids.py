"""The building blocks of a rendered scene: textured rectangles, boxes and spheres.

World axes as a camera's: x right, y down, z forward, metres; the middle of the rig is the origin.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvcodec.scenes.textures import photograph

Vector = tuple[float, float, float]
WHOLE = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Surface:
    """How a shape looks.

    Attributes:
        photograph: name of the texture (textures.PHOTOGRAPHS).
        window: (u0, v0, du, dv), the part of the photograph that it shows, in sizes of the
            photograph; beyond 0..1 it is repeated as in a mirror.
        tint: factors on red, green, blue.
    """

    photograph: str
    window: tuple[float, float, float, float] = WHOLE
    tint: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Rectangle:
    """A flat textured rectangle, seen from both sides.

    Attributes:
        corner: float64 (3,), where u = v = 0.
        across, down: float64 (3,), its edges, at right angles; their sides are u = 1 and v = 1.
        surface: its looks.
    """

    corner: NDArray[np.float64]
    across: NDArray[np.float64]
    down: NDArray[np.float64]
    surface: Surface

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal on the side where `across` points right and `down` points down."""
        normal = np.cross(self.down, self.across)
        return np.asarray(normal / np.linalg.norm(normal))


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """A textured sphere. `turn` (3, 3) takes world directions to directions on its globe."""

    centre: Vector
    radius: float
    surface: Surface
    turn: NDArray[np.float64]


Shape = Rectangle | Sphere


def rectangle(centre: Vector, width: float, height: float, surface: Surface) -> Rectangle:
    """An upright rectangle that faces the cameras."""
    x, y, z = centre
    corner = np.array([x - width / 2, y - height / 2, z])
    return Rectangle(corner, np.array([width, 0.0, 0.0]), np.array([0.0, height, 0.0]), surface)


def floor(x_span: tuple[float, float], z_span: tuple[float, float], y: float, surface: Surface) -> Rectangle:
    """A level rectangle, seen from above; u = 0 at its left, v = 0 at its far edge."""
    (left, right), (near, far) = x_span, z_span
    corner = np.array([left, y, far])
    return Rectangle(corner, np.array([right - left, 0.0, 0.0]), np.array([0.0, 0.0, near - far]), surface)


def box(
    centre: Vector,
    size: Vector,
    surface: Surface,
    *,
    yaw: float = 0.0,
    faces: Mapping[str, Surface] | None = None,
) -> list[Rectangle]:
    """The six faces of a box, outwards.

    Args:
        centre: of the box.
        size: (width, height, depth) before it is turned.
        surface: of all faces. They show equally large parts of it for equal lengths, the widest
            face the whole window.
        yaw: turn about the vertical axis, radians; positive brings the front's right end nearer.
        faces: other looks (stretched over the face) of ``front``, ``right``, ``back``, ``left``,
            ``top`` or ``bottom``.
    """
    w, h, d = size
    x, y, z = np.eye(3)
    frames = {
        "front": (-z * d, x * w, y * h),
        "right": (x * w, z * d, y * h),
        "back": (z * d, -x * w, y * h),
        "left": (-x * w, -z * d, y * h),
        "top": (-y * h, x * w, -z * d),
        "bottom": (y * h, x * w, z * d),
    }
    turn = np.array(
        [[math.cos(yaw), 0.0, math.sin(yaw)], [0.0, 1.0, 0.0], [-math.sin(yaw), 0.0, math.cos(yaw)]]
    )
    longest = max(size)
    picture = photograph(surface.photograph)
    aspect = picture.shape[1] / picture.shape[0]
    result = []
    for name, (out, across, down) in frames.items():
        looks = (faces or {}).get(name)
        if looks is None:
            u0, v0, du, _ = surface.window
            share_u, share_v = (float(np.linalg.norm(edge)) / longest for edge in (across, down))
            window = (u0, v0, du * share_u, du * share_v * aspect)
            looks = Surface(surface.photograph, window, surface.tint)
        corner = np.array(centre) + turn @ ((out - across - down) / 2)
        result.append(Rectangle(corner, turn @ across, turn @ down, looks))
    return result


def rolled(angle: float) -> NDArray[np.float64]:
    """`Sphere.turn` of one that has rolled about the z axis by `angle` radians (to the right: > 0)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def spun(angle: float) -> NDArray[np.float64]:
    """`Sphere.turn` of one that has spun about the vertical axis by `angle` radians."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])

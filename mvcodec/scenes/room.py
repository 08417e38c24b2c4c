"""The furniture of the sample scene `room`: what stands where at a given time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mvcodec.scenes.lighting import Lighting
from mvcodec.scenes.solids import (
    Rectangle,
    Shape,
    Sphere,
    Surface,
    Vector,
    box,
    floor,
    rectangle,
    rolled,
    spun,
)

WALL_M = 6.0
FLOOR_M = 0.8
NEAREST_M = 2.0
"""No object comes nearer to the cameras than this; the floor does, in tall pictures."""
FLOOR_FROM_M = 0.3

LIGHTING = Lighting(
    lamp=(-1.3, -2.7, 2.3),
    lamp_size=(1.2, 1.2),
    lamp_colour=(9.5, 8.7, 7.6),
    around=(0.40, 0.43, 0.50),
)

_WOOD = Surface("grass", (0.0, 0.0, 1.2, 1.2), (0.95, 0.68, 0.42))
_DARK_WOOD = Surface("grass", (0.3, 0.1, 0.9, 0.9), (0.62, 0.42, 0.28))
_SKIRTING = Surface("grass", (0.3, 0.1, 14.0, 14.0), _DARK_WOOD.tint)
_STONE = Surface("gravel", (0.0, 0.0, 3.0, 3.0), (0.95, 0.9, 0.85))
_BALL_PERIOD_S = 5.0
_SWING_PERIOD_S = 3.0
_CRATE_PERIOD_S = 12.0


@dataclass(frozen=True, slots=True)
class Room:
    """One arrangement of the room; the seed chooses photographs, colours and phases.

    Attributes:
        hung: photographs on the wall, from the left.
        crate: photographs on the four sides of the turning crate.
        phases: of ball, pendulum and crate, radians.
        ball_tint, bob_tint: colours of the moving spheres.
    """

    hung: tuple[str, ...]
    crate: tuple[str, ...]
    phases: tuple[float, ...]
    ball_tint: Vector
    bob_tint: Vector

    @classmethod
    def of_seed(cls, seed: int) -> Room:
        """The arrangement of a seed; 0 has everything in its first place."""
        chance = np.random.default_rng(seed)
        hung, crate = ["astronaut", "hubble_deep_field", "rocket"], ["coffee", "camera", "coins", "clock"]
        tints: list[Vector] = [(1.6, 0.85, 0.45), (0.55, 0.85, 1.2), (0.8, 1.15, 0.6), (1.2, 0.95, 0.4)]
        phases = [0.4, 1.2, 0.5]
        if seed:
            for choice in (hung, crate, tints):
                chance.shuffle(choice)
            phases = [float(phase) for phase in chance.uniform(0, math.tau, 3)]
        return cls(tuple(hung), tuple(crate), tuple(phases), tints[0], tints[1])

    def standing(self) -> list[Shape]:
        """What never moves."""
        shapes: list[Shape] = [
            _brick_wall(14.0, 14.0),
            floor(
                (-7.0, 7.0),
                (FLOOR_FROM_M, WALL_M),
                FLOOR_M,
                Surface("gravel", (0, 0, 9, 3.7), (0.92, 0.84, 0.74)),
            ),
            *box((0.0, 0.74, WALL_M - 0.02), (13.9, 0.12, 0.04), _SKIRTING),
        ]
        for name, x, width, height in zip(
            self.hung, (-1.95, 0.15, 2.05), (1.25, 1.75, 1.15), (1.25, 1.2, 1.25), strict=True
        ):
            shapes += _framed(name, (x, -0.72, WALL_M - 0.03), width, height)
        shapes += _table((0.35, 0.22, 4.3), (1.7, 0.06, 0.9))
        shapes += _on_table()
        shapes += box((-0.92, 0.76, 3.25), (0.3, 0.08, 0.3), _DARK_WOOD)
        shapes += box((-2.05, -1.2, 4.9), (0.42, 4.0, 0.42), _STONE, yaw=0.5)
        shapes += box(
            (-0.3, FLOOR_M - 0.01, 3.75),
            (2.7, 0.02, 1.5),
            Surface("grass", (0, 0, 2.2, 2.2), (0.55, 0.8, 0.45)),
        )
        shapes += _standing_photograph("chelsea", (1.12, 0.42, 3.35))
        for x, height in ((1.28, 1.5), (1.37, 1.75), (1.47, 1.6)):
            shapes += box((x * 0.84, FLOOR_M - height / 2, 2.75), (0.022, height, 0.022), _WOOD, yaw=0.4)
        return shapes

    def moving(self, time_s: float) -> list[Shape]:
        """What moves, at a time."""
        ball_phase, swing_phase, crate_phase = self.phases
        radius = 0.2
        ball_x = -0.1 + 0.75 * math.sin(math.tau * time_s / _BALL_PERIOD_S + ball_phase)
        swing = 0.28 * math.sin(math.tau * time_s / _SWING_PERIOD_S + swing_phase)
        turn = math.tau * time_s / _CRATE_PERIOD_S + crate_phase
        faces = dict(zip(("front", "right", "back", "left"), map(Surface, self.crate), strict=True))
        return [
            *box((-0.92, 0.47, 3.25), (0.5, 0.5, 0.5), _WOOD, yaw=turn, faces=faces),
            Sphere(
                (ball_x, FLOOR_M - 0.02 - radius, 3.12),
                radius,
                Surface("brick", (0, 0, 2, 1), self.ball_tint),
                rolled(ball_x / radius),
            ),
            *_pendulum((0.42, -2.2, 2.35), 1.85, swing, self.bob_tint),
        ]


def _brick_wall(width: float, height: float) -> Rectangle:
    """The back wall. The photograph shows upright bricks: it is laid on its side."""
    corner = np.array([width / 2, FLOOR_M - height, WALL_M])
    surface = Surface("brick", (0.0, 0.0, height / 2, width / 2), (1.12, 0.86, 0.74))
    return Rectangle(corner, np.array([0.0, height, 0.0]), np.array([-width, 0.0, 0.0]), surface)


def _framed(name: str, centre: Vector, width: float, height: float) -> list[Rectangle]:
    """A photograph on the wall in a raised frame."""
    x, y, z = centre
    border, depth = 0.07, 0.06
    shapes = [rectangle(centre, width, height, Surface(name))]
    for side in (-1, 1):
        shapes += box((x, y + side * height / 2, z), (width + border, border, depth), _DARK_WOOD)
        shapes += box((x + side * width / 2, y, z), (border, height - border, depth), _DARK_WOOD)
    return shapes


def _table(centre: Vector, size: Vector) -> list[Rectangle]:
    """A table top with four legs down to the floor."""
    x, y, z = centre
    shapes = box(centre, size, _WOOD)
    height = FLOOR_M - y - size[1] / 2
    for side in (-1, 1):
        for end in (-1, 1):
            place = x + side * (size[0] / 2 - 0.06), FLOOR_M - height / 2, z + end * (size[2] / 2 - 0.06)
            shapes += box(place, (0.06, height, 0.06), _DARK_WOOD)
    return shapes


def _on_table() -> list[Shape]:
    """A globe and a stack of books; the table's top is at y = 0.19."""
    shapes: list[Shape] = [
        Sphere((0.78, 0.19 - 0.24, 4.25), 0.24, Surface("moon", (0, 0, 2, 1), (0.8, 1.0, 1.25)), spun(2.2)),
    ]
    top = 0.19
    books: list[tuple[float, float, float, Vector]] = [
        (0.62, 0.09, 0.15, (1.1, 0.45, 0.4)),
        (0.52, 0.07, -0.2, (0.45, 0.65, 1.1)),
        (0.44, 0.11, 0.35, (1.1, 1.0, 0.55)),
    ]
    for width, height, yaw, tint in books:
        shapes += box(
            (-0.05, top - height / 2, 4.2),
            (width, height, 0.42),
            Surface("brick", (0, 0, 0.7, 0.7), tint),
            yaw=yaw,
        )
        top -= height
    return shapes


def _standing_photograph(name: str, centre: Vector) -> list[Rectangle]:
    """A photograph on a thick board that stands on the floor, turned towards the middle."""
    x, y, z = centre
    height = 2 * (FLOOR_M - y)
    return box((x, y, z), (height * 1.25, height, 0.04), _WOOD, yaw=0.45, faces={"front": Surface(name)})


def _pendulum(pivot: Vector, length: float, angle: float, tint: Vector) -> list[Shape]:
    """A ball on a flat cord that swings in the plane of the picture."""
    along = np.array([math.sin(angle), math.cos(angle), 0.0])
    across = np.array([math.cos(angle), -math.sin(angle), 0.0]) * 0.012
    cord = Rectangle(
        np.array(pivot) - across / 2,
        across,
        along * length,
        Surface("grass", (0, 0, 0.05, 3.0), (0.9, 0.85, 0.75)),
    )
    end = np.array(pivot) + along * length
    radius = 0.13
    bob = Sphere(
        (float(end[0]), float(end[1]), pivot[2]), radius, Surface("coins", (0, 0, 2, 1), tint), rolled(angle)
    )
    return [cord, bob]

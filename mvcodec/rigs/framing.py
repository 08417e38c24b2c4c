"""What the rectified pictures show: what all cameras see, or as much as the cameras' own pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.errors import MvCodecError
from mvcodec.rigs.remap import source_places
from mvcodec.rigs.rig import Rectified, RigCamera

Crop = Literal["common", "all"]
CROPS: tuple[Crop, ...] = ("common", "all")

_PLANE = 2.0
"""Width of the plane that is looked at, in widths of the pictures."""
_SAMPLES = 320
_LEAST_SHARE = 0.1
"""Of a side of the pictures that must be left over."""


class NothingInCommon(MvCodecError):
    """The cameras don't look at the same part of the scene."""


def framed(
    cameras: Mapping[Position, RigCamera],
    source_size: tuple[int, int],
    view: Rectified,
    crop: Crop = "common",
    size: tuple[int, int] | None = None,
) -> Rectified:
    """The rectified pictures' size, focal length and centre.

    Args:
        cameras: of the rig.
        source_size: (width, height) of their pictures, px.
        view: baseline, rho and typical inverse depth; its focal length is kept where `size` is None.
        crop: `common`: what all cameras see, without any border; `all`: pictures as large as the
            cameras', with black borders.
        size: (width, height) that the pictures shall have; their focal length follows.

    Raises:
        NothingInCommon: there is next to nothing that all cameras see.
    """
    width, height = source_size
    plane = replace(
        view,
        width=round(_PLANE * width),
        height=round(_PLANE * height),
        centre_px=((_PLANE * width - 1) / 2, (_PLANE * height - 1) / 2),
    )
    middle = _middle(cameras, source_size, plane)
    if crop == "common":
        left, top, right, bottom = _common(cameras, source_size, plane, middle, size)
    else:
        aspect = width / height if size is None else size[0] / size[1]
        wide, high = max(width, height * aspect), max(height, width / aspect)
        left, top = middle[0] - (wide - 1) / 2, middle[1] - (high - 1) / 2
        right, bottom = left + wide - 1, top + high - 1
    if size is None:
        # Whole pixels of the plane: a camera that looks straight ahead keeps its pixels as they are.
        size = int(right - left + 1) // 2 * 2, int(bottom - top + 1) // 2 * 2
        left, top = float(np.ceil(left)), float(np.ceil(top))
        right, bottom = left + size[0] - 1, top + size[1] - 1
    scale = min(size[0] / (right - left + 1), size[1] / (bottom - top + 1))
    scale = 1.0 if abs(scale - 1) < 2 / min(size) else scale
    # Centres of pixels: the rectangle's own middle becomes that of the picture.
    centre = [
        (plane.centre_px[axis] - (low + high) / 2) * scale + (size[axis] - 1) / 2
        for axis, (low, high) in enumerate(((left, right), (top, bottom)))
    ]
    return replace(
        view,
        width=size[0],
        height=size[1],
        focal_px=view.focal_px * scale,
        centre_px=(float(centre[0]), float(centre[1])),
    )


def _middle(
    cameras: Mapping[Position, RigCamera], size: tuple[int, int], plane: Rectified
) -> NDArray[np.float64]:
    """(2,): where on the plane the middles of the cameras' pictures are, on average."""
    places = []
    for at, camera in cameras.items():
        found = np.array(plane.centre_px)
        for _ in range(8):
            there = source_places(camera, at, plane, found[None])[0]
            found = found + ((np.array(size) - 1) / 2 - there)
        places.append(found)
    return np.asarray(np.mean(places, axis=0))


def _common(
    cameras: Mapping[Position, RigCamera],
    source_size: tuple[int, int],
    plane: Rectified,
    middle: NDArray[np.float64],
    size: tuple[int, int] | None,
) -> tuple[float, float, float, float]:
    """left, top, right, bottom (inclusive), px of the plane, of what all cameras see."""
    step = plane.width / _SAMPLES
    x = np.arange(0, plane.width, step)
    y = np.arange(0, plane.height, step)
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    seen = np.ones(grid.shape[:2], bool)
    for at, camera in cameras.items():
        inside = _inside(camera, at, source_size, plane, grid.reshape(-1, 2))
        seen &= inside.reshape(seen.shape)
    box = _all_true_box(seen, int(middle[0] / step), int(middle[1] / step))
    if (
        box is None
        or min((box[2] - box[0]) * step / source_size[0], (box[3] - box[1]) * step / source_size[1])
        < _LEAST_SHARE
    ):
        raise NothingInCommon(
            "the cameras see less than a tenth of their pictures in common; turn them to the same things"
        )
    sides = _grown(cameras, source_size, plane, (x[box[0]], y[box[1]], x[box[2]], y[box[3]]), step)
    left, top, right, bottom = sides
    if size is not None:
        aspect = size[0] / size[1]
        spare_x = max((right - left + 1) - (bottom - top + 1) * aspect, 0) / 2
        spare_y = max((bottom - top + 1) - (right - left + 1) / aspect, 0) / 2
        left, right, top, bottom = left + spare_x, right - spare_x, top + spare_y, bottom - spare_y
    return float(np.ceil(left)), float(np.ceil(top)), float(np.floor(right)), float(np.floor(bottom))


def _inside(
    camera: RigCamera,
    at: Position,
    source_size: tuple[int, int],
    plane: Rectified,
    pixels: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """(N,): which pixels (N, 2) of the plane a camera sees."""
    there = source_places(camera, at, plane, pixels)
    return np.asarray(((there >= 0) & (there <= np.array(source_size) - 1)).all(axis=1))


def _grown(
    cameras: Mapping[Position, RigCamera],
    source_size: tuple[int, int],
    plane: Rectified,
    sides: tuple[float, float, float, float],
    step: float,
) -> tuple[float, float, float, float]:
    """A box whose sides (left, top, right, bottom) all cameras see, larger by up to `step`, to a pixel."""
    grown = list(sides)
    while step > 1:
        step /= 2
        for number, outwards in enumerate((-step, -step, step, step)):
            tried = grown.copy()
            tried[number] += outwards
            along, across = (1, 0) if number % 2 == 0 else (0, 1)
            line = np.empty((int(tried[along + 2] - tried[along]) + 2, 2))
            line[:, along] = np.linspace(tried[along], tried[along + 2], len(line))
            line[:, across] = tried[number]
            if all(_inside(camera, at, source_size, plane, line).all() for at, camera in cameras.items()):
                grown = tried
    return grown[0], grown[1], grown[2], grown[3]


def _all_true_box(seen: NDArray[np.bool_], x: int, y: int) -> tuple[int, int, int, int] | None:
    """A large box (left, top, right, bottom; inclusive) of ones around a place: the worst side gives way."""
    ys, xs = np.nonzero(seen)
    if not len(xs) or not seen[min(y, seen.shape[0] - 1), min(x, seen.shape[1] - 1)]:
        return None
    left, right, top, bottom = int(xs.min()), int(xs.max()), int(ys.min()), int(ys.max())
    while left < right and top < bottom:
        sides = (
            seen[top : bottom + 1, left],
            seen[top, left : right + 1],
            seen[top : bottom + 1, right],
            seen[bottom, left : right + 1],
        )
        missing = [1 - float(side.mean()) for side in sides]
        worst = int(np.argmax(missing))
        if missing[worst] == 0:
            return left, top, right, bottom
        left, top = left + (worst == 0), top + (worst == 1)
        right, bottom = right - (worst == 2), bottom - (worst == 3)
    return None

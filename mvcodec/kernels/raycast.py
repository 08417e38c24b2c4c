"""Ray casting of rectangles and spheres: what each pixel sees, and its filtered colour.

Every rectangle is given, for one camera, as a 3 x 3 matrix H that takes a direction to
``(u * w, v * w, w) = H (dx, dy, 1)``: w is the inverse depth 1/Z and (u, v) in 0..1 the place on
the rectangle (a plane's 1/Z, u/Z and v/Z are affine in the direction). A sphere is given in the camera's
axes (x right, y down, z forward). Rectangles are numbered first, then the spheres.

A lens takes the direction (x, y, 1) to the pixel ``focal * s * (x, y) + centre`` with
``s = 1 + k1 r^2 + k2 r^4`` and ``r^2 = x^2 + y^2`` (Brown 1966).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.texture import Paint, filtered, light_at

EDGE_SAMPLES = 4
"""What shares an edge pixel is weighed by 4 x 4 samples."""

_MIN_COSINE = 0.02
_NEWTON_STEPS = 6
"""From the distorted radius on; |k1| = 0.3 at r = 1 is exact to 1e-9 by then."""


class Shapes(NamedTuple):
    """What stands before one camera.

    Attributes:
        homographies: float64 (Q, 3, 3), H of each rectangle.
        spheres: float64 (S, 4), centre and radius in the camera's axes.
        turns: float64 (S, 3, 3), takes a direction in the camera's axes to one on the sphere.
        boxes: int64 (Q + S, 4), (left, top, right, bottom) px that hold the shape; right and
            bottom are exclusive, all within the picture.
        focal_px, cx_px, cy_px: of the camera.
        k1, k2: of its lens; 0 and 0 is a pinhole.
        axes: float64 (3, 3), takes a direction in the camera's axes to one in the scene's.
    """

    homographies: NDArray[np.float64]
    spheres: NDArray[np.float64]
    turns: NDArray[np.float64]
    boxes: NDArray[np.int64]
    focal_px: float
    cx_px: float
    cy_px: float
    k1: float
    k2: float
    axes: NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def find_nearest(shapes: Shapes, numbers: NDArray[np.int16], inverse_depth: NDArray[np.float64]) -> None:
    """Fill in, for each pixel's centre, the number of the nearest shape (-1: none) and its 1/Z (0)."""
    h, spheres, boxes = shapes.homographies, shapes.spheres, shapes.boxes
    k1, k2 = shapes.k1, shapes.k2
    numbers[:] = -1
    inverse_depth[:] = 0.0
    for number in range(boxes.shape[0]):
        for y in range(boxes[number, 1], boxes[number, 3]):
            dy = (y - shapes.cy_px) / shapes.focal_px
            for x in range(boxes[number, 0], boxes[number, 2]):
                dx = (x - shapes.cx_px) / shapes.focal_px
                ray_x, ray_y = straightened(dx, dy, k1, k2)
                found = _inverse_depth(h, spheres, number, ray_x, ray_y)
                if found > inverse_depth[y, x]:
                    inverse_depth[y, x] = found
                    numbers[y, x] = number


@njit(cache=True, nogil=True, error_model="numpy")
def shade(shapes: Shapes, paint: Paint, numbers: NDArray[np.int16], out: NDArray[np.uint8]) -> None:
    """Colour each pixel of `out` (H, W, 3): the shapes that it sees, weighted by their shares.

    A pixel is on an edge where its 3 x 3 neighbourhood in `numbers` (see `find_nearest`) isn't all
    the same; only the shapes in that neighbourhood compete for its 4 x 4 samples. The texture is
    filtered once for each of them, around the middle of its samples.
    """
    # Arrays are taken out of the tuples once: each access counts a reference, atomically.
    h, spheres, turns = shapes.homographies, shapes.spheres, shapes.turns
    texels, levels, texture, windows = paint.texels, paint.levels, paint.texture, paint.windows
    tints, light, light_maps = paint.tints, paint.light, paint.light_maps
    focal, cx, cy, flat = shapes.focal_px, shapes.cx_px, shapes.cy_px, h.shape[0]
    k1, k2, axes = shapes.k1, shapes.k2, shapes.axes
    height, width = numbers.shape
    rivals, shares = np.empty(9, np.int64), np.empty((9, 3), np.float64)
    for y in range(height):
        for x in range(width):
            count = _gather(numbers, x, y, rivals)
            middle_x, middle_y = (x - cx) / focal, (y - cy) / focal
            if count > 1:
                _share_pixel(h, spheres, rivals, count, middle_x, middle_y, 1 / focal, k1, k2, shares)
            else:
                shares[0, 0] = 1.0
                shares[0, 1], shares[0, 2] = straightened(middle_x, middle_y, k1, k2)
            red = green = blue = 0.0
            for index in range(count):
                n, share, dx, dy = rivals[index], shares[index, 0], shares[index, 1], shares[index, 2]
                if n < 0 or share == 0.0:
                    continue
                if n < flat:
                    u, v, ux, uy, vx, vy = _on_rectangle(h, n, dx, dy)
                    light_u, light_v = u, v
                else:
                    u, v, ux, uy, vx, vy, light_u, light_v = _on_sphere(
                        spheres, turns, axes, n - flat, dx, dy
                    )
                wu, wv = windows[n, 2], windows[n, 3]
                tu, tv = windows[n, 0] + u * wu, windows[n, 1] + v * wv
                ux, uy, vx, vy = ux * wu / focal, uy * wu / focal, vx * wv / focal, vy * wv / focal
                r, g, b = filtered(texels, levels, texture[n], tu, tv, ux, uy, vx, vy)
                lr, lg, lb = light_at(light, light_maps, n, n >= flat, light_u, light_v)
                red += share * r * lr * tints[n, 0]
                green += share * g * lg * tints[n, 1]
                blue += share * b * lb * tints[n, 2]
            out[y, x, 0] = min(math.floor(red + 0.5), 255)
            out[y, x, 1] = min(math.floor(green + 0.5), 255)
            out[y, x, 2] = min(math.floor(blue + 0.5), 255)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(numbers: NDArray[np.int16], x: int, y: int, rivals: NDArray[np.int64]) -> int:
    """Put the different numbers of the 3 x 3 neighbourhood into `rivals`; how many there are."""
    height, width = numbers.shape
    count = 0
    for near_y in range(max(y - 1, 0), min(y + 2, height)):
        for near_x in range(max(x - 1, 0), min(x + 2, width)):
            number = numbers[near_y, near_x]
            known = False
            for index in range(count):
                known = known or rivals[index] == number
            if not known:
                rivals[count] = number
                count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _share_pixel(
    h: NDArray[np.float64],
    spheres: NDArray[np.float64],
    rivals: NDArray[np.int64],
    count: int,
    dx: float,
    dy: float,
    pixel: float,
    k1: float,
    k2: float,
    shares: NDArray[np.float64],
) -> None:
    """For each rival: the share of a pixel's samples that see it, and their mean direction."""
    shares[:count] = 0.0
    for part_y in range(EDGE_SAMPLES):
        offset_y = dy + ((part_y + 0.5) / EDGE_SAMPLES - 0.5) * pixel
        for part_x in range(EDGE_SAMPLES):
            offset_x = dx + ((part_x + 0.5) / EDGE_SAMPLES - 0.5) * pixel
            sample_x, sample_y = straightened(offset_x, offset_y, k1, k2)
            nearest, best = -1, 0.0
            for index in range(count):
                if rivals[index] >= 0:
                    found = _inverse_depth(h, spheres, rivals[index], sample_x, sample_y)
                    if found > best:
                        nearest, best = index, found
            if nearest >= 0:
                shares[nearest, 0] += 1.0
                shares[nearest, 1] += sample_x
                shares[nearest, 2] += sample_y
    for index in range(count):
        hits = max(shares[index, 0], 1.0)
        shares[index, 0] /= EDGE_SAMPLES * EDGE_SAMPLES
        shares[index, 1] /= hits
        shares[index, 2] /= hits


@njit(cache=True, nogil=True, error_model="numpy")
def straightened(x: float, y: float, k1: float, k2: float) -> tuple[float, float]:
    """The direction (x, y, 1) that a lens shows at the place (x, y), in focal lengths from the centre."""
    if k1 == 0.0 and k2 == 0.0:
        return x, y
    distorted = math.sqrt(x * x + y * y)
    radius = distorted
    for _ in range(_NEWTON_STEPS):
        square = radius * radius
        error = radius * (1.0 + square * (k1 + square * k2)) - distorted
        radius -= error / (1.0 + square * (3.0 * k1 + 5.0 * square * k2))
    factor = radius / max(distorted, 1e-12)
    return x * factor, y * factor


@njit(cache=True, nogil=True, error_model="numpy")
def _inverse_depth(
    h: NDArray[np.float64], spheres: NDArray[np.float64], number: int, dx: float, dy: float
) -> float:
    """1/Z of a shape in direction (dx, dy, 1); 0 where it isn't there."""
    flat = h.shape[0]
    if number < flat:
        w = h[number, 2, 0] * dx + h[number, 2, 1] * dy + h[number, 2, 2]
        u = h[number, 0, 0] * dx + h[number, 0, 1] * dy + h[number, 0, 2]
        v = h[number, 1, 0] * dx + h[number, 1, 1] * dy + h[number, 1, 2]
        return w if w > 0.0 and 0.0 <= u <= w and 0.0 <= v <= w else 0.0
    index = number - flat
    sx, sy, sz = spheres[index, 0], spheres[index, 1], spheres[index, 2]
    square = dx * dx + dy * dy + 1.0
    along = dx * sx + dy * sy + sz
    root = along * along - square * (sx * sx + sy * sy + sz * sz - spheres[index, 3] ** 2)
    if root < 0.0:
        return 0.0
    depth = (along - math.sqrt(root)) / square
    return 1.0 / depth if depth > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _on_rectangle(
    h: NDArray[np.float64], number: int, dx: float, dy: float
) -> tuple[float, float, float, float, float, float]:
    """u, v in direction (dx, dy, 1), and du/dx, du/dy, dv/dx, dv/dy."""
    w = h[number, 2, 0] * dx + h[number, 2, 1] * dy + h[number, 2, 2]
    u = (h[number, 0, 0] * dx + h[number, 0, 1] * dy + h[number, 0, 2]) / w
    v = (h[number, 1, 0] * dx + h[number, 1, 1] * dy + h[number, 1, 2]) / w
    ux = (h[number, 0, 0] - u * h[number, 2, 0]) / w
    uy = (h[number, 0, 1] - u * h[number, 2, 1]) / w
    vx = (h[number, 1, 0] - v * h[number, 2, 0]) / w
    vy = (h[number, 1, 1] - v * h[number, 2, 1]) / w
    return u, v, ux, uy, vx, vy


@njit(cache=True, nogil=True, error_model="numpy")
def _on_sphere(
    spheres: NDArray[np.float64],
    turns: NDArray[np.float64],
    axes: NDArray[np.float64],
    index: int,
    dx: float,
    dy: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """As `_on_rectangle`, by longitude and latitude; then the place on the sphere at rest.

    The derivatives are those of the tangent plane at the point of sight.
    """
    sx, sy, sz, radius = spheres[index, 0], spheres[index, 1], spheres[index, 2], spheres[index, 3]
    square = dx * dx + dy * dy + 1.0
    along = dx * sx + dy * sy + sz
    root = along * along - square * (sx * sx + sy * sy + sz * sz - radius * radius)
    depth = (along - math.sqrt(max(root, 0.0))) / square
    nx, ny, nz = (dx * depth - sx) / radius, (dy * depth - sy) / radius, (depth - sz) / radius
    # What the place on the tangent plane moves by, in radii, for a step of dx (r) or dy (d): the
    # step itself, and along the ray back onto the plane.
    facing = min(nx * dx + ny * dy + nz, -_MIN_COSINE)
    step = depth / radius
    slope_r, slope_d = -step * nx / facing, -step * ny / facing
    turn = turns[index]
    gx, gy, gz = _turned(turn, nx, ny, nz)
    rx, ry, rz = _turned(turn, step + slope_r * dx, slope_r * dy, slope_r)
    lx, ly, lz = _turned(turn, slope_d * dx, step + slope_d * dy, slope_d)
    ring = max(gx * gx + gz * gz, 1e-6)
    ux, uy = (gz * rx - gx * rz) / (ring * math.tau), (gz * lx - gx * lz) / (ring * math.tau)
    vx, vy = -ry / (math.sqrt(ring) * math.pi), -ly / (math.sqrt(ring) * math.pi)
    u, v = _globe(gx, gy, gz)
    light_x, light_y, light_z = _turned(axes, nx, ny, nz)
    light_u, light_v = _globe(light_x, light_y, light_z)
    return u, v, ux, uy, vx, vy, light_u, light_v


@njit(cache=True, nogil=True, error_model="numpy")
def _turned(turn: NDArray[np.float64], x: float, y: float, z: float) -> tuple[float, float, float]:
    """A direction in the camera's axes as one in the axes that `turn` (3, 3) leads to."""
    return (
        turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z,
        turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z,
        turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _globe(x: float, y: float, z: float) -> tuple[float, float]:
    """Longitude (0.5 along +z) and colatitude from +y of a unit direction, each over 0..1."""
    return math.atan2(x, z) / math.tau + 0.5, math.acos(min(max(y, -1.0), 1.0)) / math.pi

"""How much light reaches points: from a lamp of some size, and from all around.

Each point sends rays to points spread over the lamp, then to all sides. Which of them are blocked
is kept, so that what doesn't move need be looked at once only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

_SKIN_M = 1e-4
"""Rays start this far off their surface, which must not shade itself."""


class Solids(NamedTuple):
    """What casts shadows, in world axes.

    Attributes:
        corners: float64 (Q, 3), one corner of each rectangle.
        normals: float64 (Q, 3), unit.
        across, down: float64 (Q, 3), the edges from the corner divided by their squared lengths.
        spheres: float64 (S, 4), centre and radius.
    """

    corners: NDArray[np.float64]
    normals: NDArray[np.float64]
    across: NDArray[np.float64]
    down: NDArray[np.float64]
    spheres: NDArray[np.float64]


class Rays(NamedTuple):
    """The rays of each point.

    Attributes:
        lamp: float64 (L, 3), points spread over the lamp, in world axes.
        around: float64 (K, 3), unit directions about +z, as dense as the cosine to it; they are
            turned about the normal.
        reach_m: how far along `around` something may be and still block.
    """

    lamp: NDArray[np.float64]
    around: NDArray[np.float64]
    reach_m: float


@njit(cache=True, nogil=True, error_model="numpy")
def find_blocked(
    solids: Solids,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    rays: Rays,
    blocked: NDArray[np.bool_],
) -> None:
    """Set ``blocked[i, r]``, bool (N, L + K), where ray r of point i meets one of the solids.

    Rays that are blocked already are not looked at again, nor those to a lamp behind the surface.

    Args:
        solids: what casts shadows.
        points, normals: float64 (N, 3), places and unit normals.
        rays: the same for all points.
        blocked: changed in place.
    """
    corners, faces, across, down = solids.corners, solids.normals, solids.across, solids.down
    spheres, lamp, around, reach_m = solids.spheres, rays.lamp, rays.around, rays.reach_m
    lamps = lamp.shape[0]
    for i in range(points.shape[0]):
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        ox, oy, oz = points[i, 0] + _SKIN_M * nx, points[i, 1] + _SKIN_M * ny, points[i, 2] + _SKIN_M * nz
        # A frame (t, s, n) without a branch (Duff et al., JCGT 6(1), 2017).
        sign = 1.0 if nz >= 0.0 else -1.0
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        tx, ty, tz = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
        sx, sy, sz = b, sign + ny * ny * a, -ny
        for ray in range(blocked.shape[1]):
            if blocked[i, ray]:
                continue
            if ray < lamps:
                dx, dy, dz = lamp[ray, 0] - ox, lamp[ray, 1] - oy, lamp[ray, 2] - oz
                if dx * nx + dy * ny + dz * nz <= 0.0:
                    continue
                limit = 1.0
            else:
                x, y, z = around[ray - lamps, 0], around[ray - lamps, 1], around[ray - lamps, 2]
                dx, dy, dz = x * tx + y * sx + z * nx, x * ty + y * sy + z * ny, x * tz + y * sz + z * nz
                limit = reach_m
            blocked[i, ray] = _meets_rectangle(
                corners, faces, across, down, ox, oy, oz, dx, dy, dz, limit
            ) or _meets_sphere(spheres, ox, oy, oz, dx, dy, dz, limit)


@njit(cache=True, nogil=True, error_model="numpy")
def gather_light(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    lamp: NDArray[np.float64],
    blocked: NDArray[np.bool_],
    out: NDArray[np.float64],
) -> None:
    """Sum up the rays that are free.

    Args:
        points, normals: float64 (N, 3).
        lamp: float64 (L, 3), points spread over the lamp.
        blocked: bool (N, L + K), see `find_blocked`.
        out: float64 (N, 2), set to the mean over the lamp's points of
            ``free * max(cosine, 0) / distance ** 2``, and to the share of the K rays that are free.
    """
    lamps, sides = lamp.shape[0], blocked.shape[1] - lamp.shape[0]
    for i in range(points.shape[0]):
        direct, free = 0.0, 0
        for ray in range(lamps):
            if not blocked[i, ray]:
                dx, dy, dz = (
                    lamp[ray, 0] - points[i, 0],
                    lamp[ray, 1] - points[i, 1],
                    lamp[ray, 2] - points[i, 2],
                )
                facing = dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]
                square = dx * dx + dy * dy + dz * dz
                direct += max(facing, 0.0) / (square * math.sqrt(square))
        for ray in range(lamps, blocked.shape[1]):
            free += not blocked[i, ray]
        out[i, 0], out[i, 1] = direct / lamps, free / sides


@njit(cache=True, nogil=True, error_model="numpy")
def _meets_rectangle(
    corners: NDArray[np.float64],
    normals: NDArray[np.float64],
    across: NDArray[np.float64],
    down: NDArray[np.float64],
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    limit: float,
) -> bool:
    """Whether a rectangle lies at o + t * d with 0 < t < limit."""
    for n in range(corners.shape[0]):
        slope = normals[n, 0] * dx + normals[n, 1] * dy + normals[n, 2] * dz
        px, py, pz = ox - corners[n, 0], oy - corners[n, 1], oz - corners[n, 2]
        away = -(normals[n, 0] * px + normals[n, 1] * py + normals[n, 2] * pz)
        # t = away / slope in (0, limit), without the division that most rectangles don't need.
        if away * slope > 0.0 and abs(away) < abs(slope) * limit:
            t = away / slope
            px, py, pz = px + t * dx, py + t * dy, pz + t * dz
            u = across[n, 0] * px + across[n, 1] * py + across[n, 2] * pz
            v = down[n, 0] * px + down[n, 1] * py + down[n, 2] * pz
            if 0.0 <= u <= 1.0 and 0.0 <= v <= 1.0:
                return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _meets_sphere(
    spheres: NDArray[np.float64],
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    limit: float,
) -> bool:
    """Whether a sphere's near side lies at o + t * d with 0 < t < limit."""
    square = dx * dx + dy * dy + dz * dz
    for n in range(spheres.shape[0]):
        px, py, pz = spheres[n, 0] - ox, spheres[n, 1] - oy, spheres[n, 2] - oz
        along = px * dx + py * dy + pz * dz
        root = along * along - square * (px * px + py * py + pz * pz - spheres[n, 3] * spheres[n, 3])
        if root > 0.0 and along > 0.0:
            t = (along - math.sqrt(root)) / square
            if 0.0 < t < limit:
                return True
    return False

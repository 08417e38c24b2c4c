"""One joint adjustment of a whole rig to the points that its cameras see.

Every point has a direction (p, q) and an inverse depth w in the axes of the array, w in 1 / (steps of the
grid). A camera at C (steps) that is turned by R sees it where its ray, turned back, meets

    a = p - (Cx - a * Cz) * w,    b = q - (Cy - b * Cz) * w        (a, b: slopes of the ray)

which is linear in p, q and w. So these are eliminated in closed form for given cameras (variable
projection: Golub and Pereyra 1973; its Jacobian as Kaufman 1975 has it), and SciPy's least squares see the
cameras' own parameters alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mvcodec.rigs.features import Tracks

Vectors = NDArray[np.float64]

_PLACE_KINDS = range(6, 9)
_NEWTON_STEPS = 6
_LOOSEST_RADIUS = 3.0
_OBSERVATIONS = (1500, 2500, 6000, 6000)
"""How many are looked at in each round, which is stricter than the one before."""
_LEAST_NOISE_PX = 0.05
_SHARED, _EACH = 4, 11
_STEP = 1e-6


@dataclass(frozen=True, slots=True)
class Priors:
    """How much the cameras are expected to differ from ideal ones: standard deviations.

    They hold for most rigs; one that differs more in some respect is told by its pictures (Cauchy's loss).

    Attributes:
        angle_rad: of each angle.
        pitch_rad: of the mean turn around the line of cameras of a single row or column, which nothing shows.
        focal: of the logarithm of the focal length that all share.
        focal_each: of each camera's own against it.
        k1, k2: of the lens that all share.
        k1_each, k2_each: of each camera's own against it.
        place_steps: of each coordinate of a camera.
        stretch: of the logarithm of the height of the grid's steps.
        centre: of each coordinate of a principal point, in widths of the picture.
    """

    angle_rad: float = 0.2
    pitch_rad: float = 1e-4
    focal: float = 0.02
    focal_each: float = 0.01
    k1: float = 0.3
    k2: float = 0.03
    k1_each: float = 0.02
    k2_each: float = 0.003
    place_steps: float = 0.006
    stretch: float = 0.1
    centre: float = 0.0015


@dataclass(frozen=True, slots=True, eq=False)
class Cameras:
    """The parameters of N cameras.

    Attributes:
        turns: float64 (N, 3), rotation vectors, from the array's axes to the camera's.
        focal_px: float64 (N,).
        k1, k2: float64 (N,), Brown's radial distortion.
        places: float64 (N, 3), steps of the grid.
        centres_px: float64 (N, 2), (cx, cy).
        stretch: factor on the height of the grid's steps, which `places` have in them.
    """

    turns: Vectors
    focal_px: Vectors
    k1: Vectors
    k2: Vectors
    places: Vectors
    centres_px: Vectors
    stretch: float


@dataclass(frozen=True, slots=True, eq=False)
class Adjusted:
    """An adjusted rig.

    Attributes:
        cameras: their parameters.
        tracks: T points, with the observations that agree.
        residual_px: float64 (T, N, 2), px of each camera's picture; 0 where it doesn't see the point.
        inverse_depth: float64 (T,), 1 / steps.
    """

    cameras: Cameras
    tracks: Tracks
    residual_px: Vectors
    inverse_depth: Vectors


def adjust(
    tracks: Tracks,
    grid: Vectors,
    size: tuple[int, int],
    focal_px: float,
    priors: Priors | None = None,
    *,
    focal_known: bool = False,
) -> Adjusted:
    """Cameras that explain the points best, robustly.

    Args:
        tracks: points that the cameras see.
        grid: float64 (N, 2), (x, y) of each camera's place, steps.
        size: (width, height) of the pictures, px.
        focal_px: what the focal length is expected to be.
        priors: how sure all that is.
        focal_known: the cameras' mean focal length is `focal_px`.
    """
    problem = _Problem(grid, size, focal_px, priors or Priors(), focal_known=focal_known)
    values = np.zeros(problem.unknowns)
    noise_px, bound_px = 2.0, 8.0
    for most in _OBSERVATIONS:
        some = _thinned(tracks, most)
        kept = problem.agreeing(values, some, bound_px) if most != _OBSERVATIONS[0] else some
        values = problem.solved(values, kept, noise_px)
        residual, _ = problem.reprojected(problem.cameras(values), kept)
        noise_px, bound_px = _stricter(residual[kept.seen], noise_px, bound_px)
    cameras = problem.cameras(values)
    kept = problem.agreeing(values, tracks, bound_px)
    return Adjusted(cameras, kept, *problem.reprojected(cameras, kept))


def _stricter(residual_px: Vectors, noise_px: float, bound_px: float) -> tuple[float, float]:
    """The noise to reckon with next and how far off observations may be: by what is left, but by steps."""
    spread = 1.4826 * float(np.median(np.abs(residual_px))) if residual_px.size else noise_px
    noise = max(spread, _LEAST_NOISE_PX)
    return max(noise, noise_px / 4), max(6 * noise, bound_px / 4)


def _thinned(tracks: Tracks, most: int) -> Tracks:
    """Points with at most so many observations: those that most cameras see first."""
    lengths = tracks.seen.sum(axis=1)
    if lengths.sum() <= most:
        return tracks
    order = np.argsort(np.random.default_rng(0).uniform(0, 0.5, len(lengths)) - lengths)
    chosen = np.zeros(len(lengths), bool)
    chosen[order[np.cumsum(lengths[order]) <= most]] = True
    return tracks.kept(tracks.seen & chosen[:, None])


class _Problem:
    """The unknowns of a rig as one vector, in units of their priors' standard deviations."""

    def __init__(
        self,
        grid: Vectors,
        size: tuple[int, int],
        focal_px: float,
        priors: Priors,
        *,
        focal_known: bool = False,
    ) -> None:
        self._grid, self._focal_px, self._priors = grid, focal_px, priors
        self._centre = (np.array(size, np.float64) - 1) / 2
        self._count = len(grid)
        # In a single column steps down are what the unit is.
        self._heights = grid[:, 1] * bool(np.ptp(grid[:, 0]))
        p = priors
        self._focal_known = focal_known
        self._shared = np.array([0 if focal_known else p.focal, p.k1, p.k2, p.stretch])
        self._each = np.array(
            [p.angle_rad] * 3
            + [p.focal_each, p.k1_each, p.k2_each]
            + [p.place_steps] * 3
            + [p.centre * size[0]] * 2
        )
        self.unknowns = _SHARED + _EACH * self._count
        self._gauge = self._gauge_rows()

    def _gauge_rows(self) -> Vectors:
        """(G, unknowns): what no picture shows, and is 0 by choice.

        The axes, the steps and the origin are those of the grid that the cameras stand on: their
        displacements don't turn, stretch or move it. A single line of cameras says nothing of turns
        around itself: the mean one is 0. A focal length that is known is the cameras' mean one.
        """
        x, y = (self._grid - self._grid.mean(axis=0)).T
        rows = []
        for displacement in (
            np.column_stack([0 * x + 1, 0 * x, 0 * x]),
            np.column_stack([0 * x, 0 * x + 1, 0 * x]),
            np.column_stack([0 * x, 0 * x, 0 * x + 1]),
            np.column_stack([x, 0 * x, 0 * x]),
            np.column_stack([0 * x, y, 0 * x]),
            np.column_stack([0 * x, 0 * x, x]),
            np.column_stack([0 * x, 0 * x, y]),
            np.column_stack([-y, x, 0 * x]),
        ):
            if np.any(displacement):
                each = np.zeros((self._count, _EACH))
                each[:, 6:9] = displacement
                rows.append(np.concatenate([np.zeros(_SHARED), each.ravel()]) * 100)
        if self._focal_known:
            each = np.zeros((self._count, _EACH))
            each[:, 3] = 100
            rows.append(np.concatenate([np.zeros(_SHARED), each.ravel()]))
        for axis, across in ((0, y), (1, x)):
            if not np.any(across):
                each = np.zeros((self._count, _EACH))
                each[:, axis] = self._priors.angle_rad / self._priors.pitch_rad / self._count
                rows.append(np.concatenate([np.zeros(_SHARED), each.ravel()]))
        return np.array(rows).reshape(-1, self.unknowns)

    def cameras(self, values: Vectors) -> Cameras:
        """What a vector of unknowns stands for."""
        focal, k1, k2, stretch = values[:_SHARED] * self._shared
        each = values[_SHARED:].reshape(self._count, _EACH) * self._each
        x, y = self._grid.T
        places = np.column_stack([x, y + self._heights * np.expm1(stretch), 0 * x]) + each[:, 6:9]
        focal_px = self._focal_px * np.exp(focal + each[:, 3])
        lens = focal_px, k1 + each[:, 4], k2 + each[:, 5]
        return Cameras(each[:, :3], *lens, places, self._centre + each[:, 9:11], float(np.exp(stretch)))

    def solved(self, values: Vectors, tracks: Tracks, noise_px: float) -> Vectors:
        """The unknowns that explain the points best; observations count less beyond twice the noise."""
        seen = np.repeat(tracks.seen.ravel(), 2)
        # A camera may differ a lot in some respect: priors count less from there on, like wrong matches.
        doubtful = int(np.count_nonzero(seen)) + self.unknowns

        def residuals(values: Vectors) -> Vectors:
            residual, _ = self.reprojected(self.cameras(values), tracks)
            return np.concatenate([residual.ravel()[seen] / noise_px, values, self._gauge @ values])

        def jacobian(values: Vectors) -> Vectors:
            rows = self._jacobian(values, tracks).reshape(-1, self.unknowns)[seen]
            return np.concatenate([rows / noise_px, np.eye(self.unknowns), self._gauge])

        def loss(squares: Vectors) -> Vectors:
            rho = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
            more = 1 + squares[:doubtful] / 4
            rho[:, :doubtful] = 4 * np.log(more), 1 / more, -0.25 / more**2
            return rho

        found = least_squares(residuals, values, jacobian, loss=loss, max_nfev=15, ftol=1e-4, xtol=1e-5)
        return np.asarray(found.x)

    def reprojected(self, cameras: Cameras, tracks: Tracks) -> tuple[Vectors, Vectors]:
        """(T, N, 2) residuals, px of the cameras' pictures, and the inverse depth of each point."""
        slopes, scales_px = self._slopes(cameras, tracks)
        leans, spread = _leans(cameras, slopes, tracks.seen)
        a = _centred(slopes, tracks.seen)
        depth = -(a * leans).sum(axis=(1, 2)) / spread
        return (a + leans * depth[:, None, None]) * scales_px, depth

    def _slopes(self, cameras: Cameras, tracks: Tracks) -> tuple[Vectors, Vectors]:
        """(T, N, 2): slopes of the rays in the array's axes; (T, N, 1): px of the picture for 1 of it."""
        places = (tracks.xy_px - cameras.centres_px) / cameras.focal_px[:, None]
        distorted = np.hypot(places[..., 0], places[..., 1])
        factor = (straight_radius(distorted, cameras.k1, cameras.k2) / np.maximum(distorted, 1e-12))[
            ..., None
        ]
        rays = np.concatenate([places * factor, np.ones_like(factor)], axis=-1)
        turns = Rotation.from_rotvec(cameras.turns).as_matrix()
        rays = (rays[:, :, None] @ turns)[:, :, 0]
        return rays[..., :2] / rays[..., 2:], cameras.focal_px[:, None] / np.maximum(factor, 1e-3)

    def _jacobian(self, values: Vectors, tracks: Tracks) -> Vectors:
        """(T, N, 2, unknowns): how the residuals change.

        Each camera's slopes depend on its own parameters only, so that one step of all cameras at once
        gives all derivatives of a kind.
        """
        cameras, seen = self.cameras(values), tracks.seen
        slopes, scales_px = self._slopes(cameras, tracks)
        leans, spread = _leans(cameras, slopes, seen)
        a = _centred(slopes, seen)
        depth = -(a * leans).sum(axis=(1, 2)) / spread
        left = a + leans * depth[:, None, None]
        moved, scaled = np.empty((*slopes.shape, _EACH)), np.empty((*slopes.shape, _EACH))
        for kind in range(_EACH):
            stepped = values.copy()
            stepped[_SHARED:].reshape(self._count, _EACH)[:, kind] += _STEP
            after = self.cameras(stepped)
            # Places move no ray.
            slopes_after, scales_after = (
                (slopes, scales_px) if kind in _PLACE_KINDS else self._slopes(after, tracks)
            )
            towards = after.places - cameras.places
            lean = towards[:, :2] - slopes * towards[:, 2:]
            moved[..., kind] = (slopes_after - slopes + lean * depth[:, None, None]) / _STEP
            scaled[..., kind] = left * (scales_after - scales_px) / _STEP
        moved *= seen[..., None, None]
        # A point follows the camera that moves: its direction by the mean, its depth along the leans.
        share = 1 / seen.sum(axis=1)
        along = np.einsum("tnck,tnc->tnk", moved, leans) / spread[:, None, None]
        rows = (
            -np.einsum("tjc,tnk->tjcnk", leans, along)
            - moved.transpose(0, 2, 1, 3)[:, None] * share[:, None, None, None, None]
        )
        own = np.arange(self._count)
        rows[:, own, :, own] += moved.transpose(1, 0, 2, 3)
        rows *= (scales_px * seen[..., None])[..., None, None]
        rows[:, own, :, own] += scaled.transpose(1, 0, 2, 3)
        shared = rows[..., 3:6].sum(axis=3) * (self._shared[:3] / self._each[3:6])
        heights = self._heights * cameras.stretch * self._shared[3] / self._each[7]
        stretch = (rows[..., 7] @ heights)[..., None]
        return np.concatenate([shared, stretch, rows.reshape(*slopes.shape, -1)], axis=-1)

    def agreeing(self, values: Vectors, tracks: Tracks, bound_px: float) -> Tracks:
        """The observations that agree with the others of their point: the worst of a point go one by one."""
        cameras, kept = self.cameras(values), tracks
        while True:
            residual, _ = self.reprojected(cameras, kept)
            length = np.hypot(residual[..., 0], residual[..., 1])
            bad = (length > bound_px) & (length == length.max(axis=1, keepdims=True))
            if not bad.any():
                return kept
            kept = kept.kept(kept.seen & ~bad)


def straight_radius(distorted: Vectors, k1: Vectors, k2: Vectors) -> Vectors:
    """The radius that a lens with Brown's k1 and k2 shows at another one, by Newton's method."""
    radius = distorted.copy()
    for _ in range(_NEWTON_STEPS):
        square = radius * radius
        slope = np.maximum(1 + square * (3 * k1 + 5 * square * k2), 0.1)
        radius -= (radius * (1 + square * (k1 + square * k2)) - distorted) / slope
        radius = np.clip(radius, 0, _LOOSEST_RADIUS)
    return radius


def _leans(cameras: Cameras, slopes: Vectors, seen: NDArray[np.bool_]) -> tuple[Vectors, Vectors]:
    """(T, N, 2): how each slope answers to its point's inverse depth; (T,): the sum of their squares."""
    leans = _centred(cameras.places[:, :2] - slopes * cameras.places[:, None, 2:].swapaxes(0, 1), seen)
    return leans, np.maximum((leans * leans).sum(axis=(1, 2)), 1e-12)


def _centred(values: Vectors, seen: NDArray[np.bool_]) -> Vectors:
    """Less the mean over the cameras that see the point; 0 for the others."""
    weights = seen[..., None] / seen.sum(axis=1)[:, None, None]
    return np.asarray((values - (values * weights).sum(axis=1, keepdims=True)) * seen[..., None])

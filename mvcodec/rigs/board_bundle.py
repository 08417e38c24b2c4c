"""All cameras of a rig and all places of a board, adjusted at once to the corners that were seen."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.sparse import coo_array, csr_array, vstack
from scipy.spatial.transform import Rotation

from mvcodec.rigs.board import Sightings
from mvcodec.rigs.rig import Lens

Vectors = NDArray[np.float64]

_LENS, _POSE = 8, 6
_EACH = _LENS + _POSE
_STEP = 1e-6
_ROUNDS = (1.0, 0.3)
"""px that corners are expected to be off, first and last."""
_BEYOND = 6.0
"""Corners farther off than so many times the typical distance are wrong."""
_LEAST_NOISE_PX = 0.05
_FOCAL, _ASPECT, _CENTRE, _K, _TANGENT = 1.0, 0.003, 0.02, 0.5, 0.002
"""Standard deviations of what lenses are expected to be: logarithms of the focal length and of fy / fx, the
principal point in widths of the picture, k1 and k2 (and k3, k4 of fisheyes), p1 and p2."""


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Where to begin.

    Attributes:
        model: of the lenses.
        matrices: float64 (N, 3, 3), K.
        coefficients: float64 (N, 4), of the distortion.
        cameras: float64 (N, 4, 4), from the first camera's axes to each one's.
        boards: float64 (F, 4, 4), from the board's axes to the first camera's.
    """

    model: str
    matrices: Vectors
    coefficients: Vectors
    cameras: Vectors
    boards: Vectors


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """Adjusted cameras.

    Attributes:
        lenses: N of them.
        turns: float64 (N, 3, 3), from the first camera's axes to each one's.
        centres_m: float64 (N, 3), in the first camera's axes.
        rms_px: of the corners that agree.
        left_out: share of the corners that don't.
    """

    lenses: list[Lens]
    turns: Vectors
    centres_m: Vectors
    rms_px: float
    left_out: float


def adjusted(guess: Guess, sightings: Sightings) -> Bundle:
    """The cameras that explain the corners best, robustly."""
    problem = _Problem(guess, sightings)
    values = np.zeros(problem.unknowns)
    seen = sightings.seen
    for noise_px in _ROUNDS:
        values = problem.solved(values, seen, noise_px)
        length = np.linalg.norm(problem.residuals_px(values), axis=-1)
        bound = _BEYOND * max(float(np.median(length[seen])), _LEAST_NOISE_PX)
        seen = sightings.seen & (length <= bound)
    rms = float(np.sqrt(np.mean(length[seen] ** 2)))
    lenses, turns, centres = problem.cameras(values)
    left_out = 1 - np.count_nonzero(seen) / np.count_nonzero(sightings.seen)
    return Bundle(lenses, turns, centres, rms, float(left_out))


class _Problem:
    """The unknowns as one vector: what the cameras differ from their guess, and then the boards.

    The first camera stays where it is; its unknown place is held by a prior of no width.
    """

    def __init__(self, guess: Guess, sightings: Sightings) -> None:
        self._guess, self._sightings = guess, sightings
        self._corners = sightings.board.corners_m
        self._frames, self._count = sightings.seen.shape[:2]
        self.unknowns = _EACH * self._count + _POSE * self._frames
        fisheye = guess.model == "fisheye"
        self._widths = np.array(
            [_FOCAL, _ASPECT, *[_CENTRE * sightings.size[0]] * 2]
            + ([_K] * 4 if fisheye else [_K, _K, _TANGENT, _TANGENT])
        )

    def _split(self, values: Vectors) -> tuple[Vectors, Vectors]:
        cut = _EACH * self._count
        return values[:cut].reshape(self._count, _EACH), values[cut:].reshape(self._frames, _POSE)

    def _lenses(self, each: Vectors) -> tuple[Vectors, Vectors]:
        """(N, 3, 3) K, (N, 4) coefficients."""
        matrices = self._guess.matrices.copy()
        matrices[:, 0, 0] *= np.exp(each[:, 0])
        matrices[:, 1, 1] *= np.exp(each[:, 0] + each[:, 1])
        matrices[:, :2, 2] += each[:, 2:4]
        return matrices, self._guess.coefficients + each[:, 4:8]

    def cameras(self, values: Vectors) -> tuple[list[Lens], Vectors, Vectors]:
        """Lenses, turns and centres."""
        each, _ = self._split(values)
        matrices, bent = self._lenses(each)
        poses = _moved(self._guess.cameras, each[:, _LENS:])
        lenses = [
            Lens(
                self._guess.model,
                (float(k[0, 0]), float(k[1, 1])),
                (float(k[0, 2]), float(k[1, 2])),
                tuple(coefficients.tolist()),
            )
            for k, coefficients in zip(matrices, bent, strict=True)
        ]
        turns = poses[:, :3, :3]
        return lenses, turns, -np.einsum("nji,nj->ni", turns, poses[:, :3, 3])

    def residuals_px(self, values: Vectors) -> Vectors:
        """float64 (F, N, C, 2): how far each corner is from where it was seen, px."""
        each, boards = self._split(values)
        matrices, bent = self._lenses(each)
        first = _moved(self._guess.boards, boards)
        points = self._corners @ first[:, :3, :3].swapaxes(1, 2) + first[:, None, :3, 3]
        poses = _moved(self._guess.cameras, each[:, _LENS:])
        found = np.empty((self._frames, self._count, len(self._corners), 2))
        project = cv2.fisheye.projectPoints if self._guess.model == "fisheye" else cv2.projectPoints
        zero = np.zeros(3)
        for number, (matrix, coefficients) in enumerate(zip(matrices, bent, strict=True)):
            rays = points.reshape(-1, 3) @ poses[number, :3, :3].T + poses[number, :3, 3]
            rays[:, 2] = np.maximum(rays[:, 2], 1e-3)
            pixels, _ = project(rays[:, None], zero, zero, matrix, coefficients)
            found[:, number] = np.reshape(pixels, (self._frames, -1, 2))
        return found - self._sightings.xy_px

    def solved(self, values: Vectors, seen: NDArray[np.bool_], noise_px: float) -> Vectors:
        """The unknowns that explain the corners that count; these count less beyond twice the noise."""
        there = np.repeat(seen.ravel(), 2)
        corners = int(np.count_nonzero(there))
        each = np.zeros((self._count, _EACH), bool)
        each[:, :_LENS] = True
        each[0] = True
        held = np.nonzero(np.concatenate([each.ravel(), np.zeros(_POSE * self._frames, bool)]))[0]
        widths = np.broadcast_to(np.append(self._widths, [1e-6] * _POSE), (self._count, _EACH)).ravel()[held]
        start = self._prior_start()[held]

        def residuals(values: Vectors) -> Vectors:
            off = self.residuals_px(values).ravel()[there] / noise_px
            return np.concatenate([off, (start + values[held]) / widths])

        def jacobian(values: Vectors) -> csr_array:
            own = coo_array((1 / widths, (np.arange(len(held)), held)), shape=(len(held), self.unknowns))
            return vstack([csr_array(self._jacobian(values)[there] / noise_px), own], format="csr")

        def loss(squares: Vectors) -> Vectors:
            rho = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
            more = 1 + squares[:corners] / 4
            rho[:, :corners] = 4 * np.log(more), 1 / more, -0.25 / more**2
            return rho

        found = least_squares(
            residuals,
            values,
            jacobian,
            loss=loss,
            max_nfev=60,
            ftol=1e-6,
            xtol=1e-8,
            x_scale="jac",
            tr_solver="lsmr",
        )
        return np.asarray(found.x)

    def _prior_start(self) -> Vectors:
        """(N * _EACH,): how far the guess itself is from what lenses are expected to be."""
        matrices, width = self._guess.matrices, self._sightings.size
        start = np.zeros((self._count, _EACH))
        start[:, 1] = np.log(matrices[:, 1, 1] / matrices[:, 0, 0])
        start[:, 2:4] = matrices[:, :2, 2] - (np.array(width) - 1) / 2
        start[:, 4:8] = self._guess.coefficients
        return start.ravel()

    def _jacobian(self, values: Vectors) -> Vectors:
        """(F * N * C * 2, unknowns): one step of all cameras (boards) gives all derivatives of a kind."""
        before = self.residuals_px(values)
        rows = np.zeros((self._frames, self._count, *before.shape[2:], self.unknowns))
        for kind in range(_EACH):
            stepped = values.copy()
            self._split(stepped)[0][:, kind] += _STEP
            change = (self.residuals_px(stepped) - before) / _STEP
            for number in range(self._count):
                rows[:, number, ..., number * _EACH + kind] = change[:, number]
        for kind in range(_POSE):
            stepped = values.copy()
            self._split(stepped)[1][:, kind] += _STEP
            change = (self.residuals_px(stepped) - before) / _STEP
            for frame in range(self._frames):
                rows[frame, ..., _EACH * self._count + frame * _POSE + kind] = change[frame]
        return rows.reshape(-1, self.unknowns)


def _moved(poses: Vectors, change: Vectors) -> Vectors:
    """(N, 4, 4): poses turned by rotation vectors and moved by metres, (N, 6)."""
    moved = poses.copy()
    moved[:, :3, :3] = Rotation.from_rotvec(change[:, :3]).as_matrix() @ poses[:, :3, :3]
    moved[:, :3, 3] += change[:, 3:]
    return moved

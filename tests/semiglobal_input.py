"""What the tests of semi-global matching run kernels on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mvcodec.kernels import matching_costs
from mvcodec.kernels.byte_vectors import LANES

SIZES = [(7, 9), (1, 1), (1, 11), (8, 1), (4, 5)]
STEPS = {
    "right": [(1, 0)],
    "left": [(-1, 0)],
    "lower, rho 0.5": [(0, 0.5)],
    "upper, rho 2": [(0, -2)],
    "right and lower, rho 2": [(1, 0), (0, 2)],
    "all four, rho 0.5": [(0, -0.5), (-1, 0), (1, 0), (0, 0.5)],
}
LEVELS = 8
LIMITS = (30, 2, 45)  # colour_limit, bit_cost, most_bits
size_parameter = pytest.mark.parametrize("size", SIZES, ids=str)
low_parameter = pytest.mark.parametrize("low", [-5, 0, 2])
steps_parameter = pytest.mark.parametrize(
    "steps", [np.array(steps, np.float32) for steps in STEPS.values()], ids=list(STEPS)
)


def random_bytes(shape: tuple[int, ...], seed: int, spread: int = 256) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, spread, shape).astype(np.uint8)


def levels_second(volume: NDArray[Any]) -> NDArray[Any]:
    """Twins have (H, W, levels), kernels (H, levels, W)."""
    return np.ascontiguousarray(volume.transpose(0, 2, 1))


def joint_costs(
    planes: NDArray[np.uint8],
    census: NDArray[np.uint8],
    bounds: NDArray[np.uint8],
    blind: NDArray[np.uint8],
    across: NDArray[np.bool_],
    steps: NDArray[np.float32],
    *,
    low: int,
    lone_cost: int = 6,
    levels: int = LEVELS,
    windows: list[tuple[int, int]] | None = None,
) -> NDArray[np.uint8]:
    """Of camera 0 against all others: (H, W, levels), or of windows of 2 rows side by side."""
    width = planes.shape[3]
    columns = -(-width // LANES) * LANES
    places = windows or [(0, column) for column in range(0, columns, LANES)]
    shape = 2 if windows else planes.shape[1], levels, len(places) * LANES
    volume = np.full(shape, 77, np.uint8)

    def with_borders(rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
        beyond = (LANES, columns - width + LANES)
        return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [beyond], constant_values=99)

    matching_costs.joint_costs(
        0,
        np.arange(1, len(planes)),
        with_borders(planes),
        with_borders(census),
        across,
        with_borders(bounds),
        with_borders(blind),
        width,
        steps,
        low,
        *LIMITS,
        lone_cost,
        100,
        np.array(places),
        volume,
    )
    return volume.transpose(0, 2, 1) if windows else volume[..., :width].transpose(0, 2, 1)


def uniform_costs(
    differences: list[int],
    bits: list[int],
    steps: list[tuple[float, float]],
    lone_cost: int = 6,
    blind_rows: int = 0,
) -> NDArray[np.uint8]:
    """Volume (1, 6, 3), low 0, where a partner differs by so much grey a channel and so many census bits.

    Partners stand along rows, where they are `blind_rows` blind, but for those below.
    """
    cameras = 1 + len(steps)
    bounds = np.full((2, cameras, 1, 2, 3, 6), 100, np.uint8)
    census = np.zeros((cameras, 1, 8, 6), np.uint8)
    for camera, (difference, count) in enumerate(zip(differences, bits, strict=True), 1):
        bounds[:, camera] += np.uint8(difference % 256)
        census[camera] = np.packbits(np.arange(64) < count)[None, :, None]
    planes = np.full((cameras, 1, 3, 6), 100, np.uint8)
    where = np.array(steps, np.float32)
    blind = np.zeros((2, 1, 6), np.uint8)
    blind[0] = blind_rows
    across = where[:, 1] == 0
    return joint_costs(planes, census, bounds, blind, across, where, low=0, lone_cost=lone_cost, levels=3)

"""What the tests of the default renderer's kernels run them on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import view_twins as twins
from hypothesis import strategies as st
from numpy.typing import NDArray

from mvcodec.kernels import view_vectors

SHAPES = [(1, 1), (1, 13), (13, 1), (2, 3), (9, 11), (14, 8), (3, 37), (2, 32)]
seeds = st.integers(0, 2**32 - 1)
shapes = st.tuples(st.integers(1, 12), st.integers(1, 12))
Shape = tuple[int, int]
Run = Callable[[int, int], None]


def some_maps(rng: np.random.Generator, count: int, shape: Shape, holes: float = 0.0) -> NDArray[np.float32]:
    """Maps of few surfaces of either sign in multiples of 1/16 px, so that float32 has no rounding to do."""
    surfaces = rng.integers(-96, 97, 4) / 16
    maps = rng.choice(surfaces, (count, *shape)) + rng.integers(-4, 5, (count, *shape)) / 16
    maps = np.where(rng.random(maps.shape) < holes, twins.UNKNOWN, maps)
    return np.ascontiguousarray(maps, np.float32)


def smoother(maps: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """The same, in which whole blocks of pixels lie on one surface, as on a real map."""
    block = int(rng.integers(1, 12))
    height, width = maps.shape[1:]
    rows, columns = np.arange(height) // block * block, np.arange(width) // block * block
    return np.ascontiguousarray(maps[:, rows][:, :, columns])


def in_bands(height: int, out: NDArray[np.float32] | NDArray[np.uint8], run: Run) -> None:
    """Run a kernel band by band, and see that each leaves the rows of the others alone."""
    cut = height // 3
    for first, last in ((cut, height), (0, cut)):
        others = np.ones(height, np.bool_)
        others[first:last] = False
        before = out[others].copy()
        run(first, last)
        np.testing.assert_array_equal(out[others], before)


def in_steps(levels: NDArray[np.floating]) -> NDArray[np.int16]:
    """Grey levels as the kernels take them."""
    return np.asarray(np.rint(levels * view_vectors.LEVELS), np.int16)


def in_pairs(levels: NDArray[np.floating]) -> NDArray[np.int16]:
    """Planes of luma (..., H, W) as the kernels take them: each pixel with the one below it."""
    below = np.concatenate([levels[..., 1:, :], levels[..., -1:, :]], axis=-2)
    return np.stack([in_steps(levels), in_steps(below)], axis=-1)

"""Which matches are the only ones: on textures whose repetition is known."""

from __future__ import annotations

import numpy as np
import pytest
import rival_twin
from numpy.typing import NDArray
from stereo_scene import Planes, linear_or_grid, texture

from mvcodec.frames import FloatMap
from mvcodec.kernels import rival_matches
from mvcodec.stereo.ambiguity import contrast_scales, unambiguous
from mvcodec.stereo.disparity_range import estimate_range

DISPARITY = 5
SPAN_PX = (-30.0, 40.0)
INNER = np.s_[10:-10, 60:-60]
"""Where everything of the span lies within both pictures."""


def pair_of(wall: NDArray[np.float64]) -> tuple[NDArray[np.uint8], NDArray[np.uint8], FloatMap]:
    """The left and the right view of a wall, and its disparity."""
    width = wall.shape[1] - DISPARITY
    left, right = (np.rint(wall[:, at : at + width]).astype(np.uint8) for at in (0, DISPARITY))
    return left, right, np.full(left.shape, DISPARITY, np.float32)


def bricks(height: int, width: int, noise: float) -> NDArray[np.float64]:
    """Bricks of 24 x 12 px, no two alike where there is noise."""
    y, x = np.mgrid[:height, :width]
    mortar = (y % 12 < 2) | ((x + y // 12 % 2 * 12) % 24 < 2)
    return np.where(mortar, 200.0, 100.0) + noise * (texture(height, width, 3)[..., 0] - 127) / 40


def test_what_is_nowhere_repeated_is_unambiguous() -> None:
    assert unambiguous(*pair_of(texture(80, 260, 1)[..., 0]), SPAN_PX)[INNER].mean() > 0.95


def test_what_is_repeated_within_the_span_is_ambiguous() -> None:
    assert not unambiguous(*pair_of(bricks(80, 260, 0.5)), SPAN_PX)[INNER].any()


def test_a_period_that_the_span_does_not_hold_does_not_matter() -> None:
    assert unambiguous(*pair_of(bricks(80, 260, 0.5)), (1.0, 12.0))[INNER].mean() > 0.8


def test_a_wrong_match_is_not_the_only_one() -> None:
    left, right, disparity = pair_of(texture(80, 260, 1)[..., 0])
    assert not unambiguous(left, right, disparity + 9, SPAN_PX)[INNER].any()


@pytest.mark.parametrize("size", [(1, 1), (3, 40), (40, 3)])
def test_pictures_smaller_than_a_window_have_nothing_to_say(size: tuple[int, int]) -> None:
    picture = texture(*size, 1)[..., 0].astype(np.uint8)
    assert unambiguous(picture, picture, np.zeros(size, np.float32), (-2.0, 2.0)).shape == size


@pytest.mark.parametrize("size", [(7, 13), (70, 50), (33, 64)], ids=str)
def test_the_kernel_says_what_plain_numpy_says(size: tuple[int, int]) -> None:
    draw = np.random.default_rng(3)
    left, right = draw.integers(0, 256, (2, *size), np.uint8)
    left[: size[0] // 2] //= 16
    right[:, :-4] = left[:, 4:]
    disparity = draw.uniform(-9, 9, size).astype(np.float32)
    sums, squares = np.empty((2, *size), np.int32), np.empty((2, *size), np.int32)
    for grey, total, square in zip((left, right), sums, squares, strict=True):
        mirrored = np.pad(grey, rival_matches.RADIUS, mode="reflect")
        rival_matches.window_sums(mirrored, np.ones_like(mirrored), total)
        rival_matches.window_sums(mirrored, mirrored, square)
        assert np.array_equal(square, rival_twin.window_sums(grey.astype(np.int64) ** 2))
    own, other = np.full((2, *size), np.float32(-1))
    rows, scales = (
        np.pad(np.arange(size[0]), rival_matches.RADIUS, mode="reflect"),
        contrast_scales(sums, squares),
    )
    rival_matches.compare_places(left, right, rows, sums, scales, disparity, -12, 7, own, other)
    expected = rival_twin.compare_places(left, right, disparity, -12, 7)
    np.testing.assert_allclose((own, other), expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(
    ("grid", "far", "near", "unlike", "sensor"),
    [((2, 2), -20, -4, 1.0, 2.0), ((1, 2), 6, 40, 0.0, 3.0)],
    ids=["hardly", "exactly"],
)
def test_a_brick_wall_neither_stretches_the_range_nor_falls_out_of_it(
    grid: tuple[int, int], far: int, near: int, unlike: float, sensor: float
) -> None:
    array = linear_or_grid(*grid, 320, 240)
    scene = Planes(array, far, near)
    height, width = scene._far.shape[:2]
    wall = bricks(height, width, unlike)
    scene._far = np.repeat(wall[..., None], 3, axis=2)
    frames = scene.frame_set()
    noise = np.random.default_rng(5)
    for picture in frames.pictures.values():
        picture[:] = np.rint(picture + noise.normal(0, sensor, picture.shape)).clip(0, 255)
    low, high = estimate_range(array, [frames])
    assert far - 5 <= low <= far
    assert near <= high <= near + 6

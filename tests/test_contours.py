"""Surfaces reach over plain ground as far as their edge, where it moves with them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from mvcodec.frames import FloatMap
from mvcodec.kernels.contours import MOST_LEVELS, widen

STEP, DEPTH, LEVELS, SHARE = 1.5, 3, 7, 0.7
Grey = NDArray[np.uint8]


def fetched(grey: Grey, y: float, x: float) -> float:
    """Between pixels, the border repeated."""
    height, width = grey.shape
    top, left = int(np.floor(y)), int(np.floor(x))
    total = 0.0
    for v, u in ((top, left), (top, left + 1), (top + 1, left), (top + 1, left + 1)):
        share = (1 - abs(y - v)) * (1 - abs(x - u))
        total += share * float(grey[min(max(v, 0), height - 1), min(max(u, 0), width - 1)])
    return total


def misfit(grey: Grey, other: Grey, y: int, x: int, shift: NDArray[np.float32]) -> float | None:
    height, width = grey.shape
    left, up = (float(value) for value in shift)
    if not (0 <= x - left <= width - 1 and 0 <= y - up <= height - 1):
        return None
    offsets = [(down, across) for down in (-1, 0, 1) for across in (-1, 0, 1)]
    apart = [
        abs(fetched(other, y - up + down, x - left + across) - fetched(grey, y + down, x + across))
        for down, across in offsets
    ]
    return sum(min(difference, float(MOST_LEVELS)) for difference in apart)


def plain_twin(disparity: FloatMap, greys: Grey, steps: NDArray[np.float32]) -> FloatMap:
    """Of camera 0, the others its partners."""
    height, width = disparity.shape
    out = disparity.copy()
    for y, x in np.ndindex(height, width):
        own, nearer = disparity[y, x], disparity[y, x]
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                beyond = [(y + i * (y - v), x + i * (x - u)) for i in range(1, DEPTH + 1)]
                like = [abs(fetched(greys[0], *place) - float(greys[0, y, x])) < LEVELS for place in beyond]
                if disparity[v, u] > own + STEP and all(like):
                    nearer = max(nearer, disparity[v, u])
        if nearer == own:
            continue
        pairs = [
            (misfit(greys[0], other, y, x, by * own), misfit(greys[0], other, y, x, by * nearer))
            for other, by in zip(greys[1:], steps, strict=True)
        ]
        both = [(one, two) for one, two in pairs if one is not None and two is not None]
        against_own, against_nearer = (sum(side) for side in zip(*both, strict=True)) if both else (0, 0)
        if against_own > 0 and against_nearer <= SHARE * against_own:
            out[y, x] = nearer
    return out


def widened(disparity: FloatMap, greys: Grey, steps: NDArray[np.float32]) -> FloatMap:
    out = disparity.copy()
    nearest = np.asarray(cv2.dilate(disparity, np.ones((3, 3), np.uint8)), np.float32)
    partners = np.arange(1, len(greys))
    widen(disparity, nearest, greys, 0, partners, steps, STEP, DEPTH, LEVELS, SHARE, out)
    return out


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (25, 1), (24, 33)], ids=str)
@pytest.mark.parametrize("steps", [[(1, 0)], [(-1, 0), (0, 1)], [(0, -0.5)]], ids=str)
def test_equals_its_plain_twin(size: tuple[int, int], steps: list[tuple[float, float]]) -> None:
    rng = np.random.default_rng(3)
    blocks = rng.integers(0, 3, (-(-size[0] // 6), -(-size[1] // 6))).repeat(6, axis=0).repeat(6, axis=1)
    disparity = np.ascontiguousarray(4 * blocks[: size[0], : size[1]] + 0.25, np.float32)
    greys = rng.integers(0, 8, (1 + len(steps), *size)) + 40 * (rng.random((1 + len(steps), *size)) < 0.03)
    by = np.array(steps, np.float32)
    found = widened(disparity, greys.astype(np.uint8), by)
    np.testing.assert_allclose(found, plain_twin(disparity, greys.astype(np.uint8), by))
    if min(size) > 1:
        assert (found != disparity).any()


def soft_edge(at: float) -> Grey:
    """Bright on the left of `at`, dark on its right."""
    x = np.arange(60, dtype=np.float32)
    return np.tile(np.clip(200 - 160 * (x - at + 0.5), 40, 200), (20, 1)).astype(np.uint8)


@pytest.mark.parametrize("moves_with_nearer", [True, False])
def test_the_edge_says_whose_it_is(moves_with_nearer: bool) -> None:
    """The nearer surface lies on the left, at 8 px, before another at 2 px."""
    disparity = np.full((20, 60), 2, np.float32)
    disparity[:, :31] = 8
    greys = np.stack([soft_edge(30.4), soft_edge(30.4 - (8 if moves_with_nearer else 2))])
    found = widened(disparity, greys, np.array([(1, 0)], np.float32))
    assert (found[:, 31] == (8 if moves_with_nearer else 2)).all()
    np.testing.assert_array_equal(np.delete(found, 31, axis=1), np.delete(disparity, 31, axis=1))


def test_ground_with_detail_keeps_its_disparity() -> None:
    disparity = np.full((20, 60), 2, np.float32)
    disparity[:, :31] = 8
    pictures = [soft_edge(30.4), soft_edge(22.4)]
    for picture, first in zip(pictures, (31, 29), strict=True):
        picture[:, first::2] += 20
    found = widened(disparity, np.stack(pictures), np.array([(1, 0)], np.float32))
    np.testing.assert_array_equal(found, disparity)

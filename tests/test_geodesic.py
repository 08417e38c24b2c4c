"""Disparities are carried along the ways that Dijkstra's algorithm finds too."""

from __future__ import annotations

import heapq

import numpy as np
import pytest
from numpy.typing import NDArray

from mvcodec.frames import FloatMap, Mask
from mvcodec.kernels.geodesic import UNREACHED, carry


def plain_twin(
    planes: NDArray[np.float32], known: Mask, edge_cost: float, row_cost: float, disparity: FloatMap
) -> tuple[FloatMap, FloatMap]:
    """(distance, disparity) by Dijkstra's algorithm."""
    height, width = known.shape
    distance = np.full((height, width), UNREACHED, np.float32)
    carried = disparity.copy()
    queue = [(0.0, int(y), int(x), float(disparity[y, x])) for y, x in np.argwhere(known)]
    done = np.zeros((height, width), np.bool_)
    while queue:
        length, y, x, value = heapq.heappop(queue)
        if done[y, x]:
            continue
        done[y, x], distance[y, x], carried[y, x] = True, length, value
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if not done[v, u]:
                    contrast = np.abs(planes[:, y, x] - planes[:, v, u]).max()
                    step = np.hypot(u - x, row_cost * (v - y)) + edge_cost * contrast
                    heapq.heappush(queue, (float(length + step), v, u, value))
    return distance, carried


@pytest.mark.parametrize("size", [(1, 1), (1, 17), (13, 1), (23, 31)], ids=str)
@pytest.mark.parametrize("share", [0.0, 0.03, 0.5, 1.0])
@pytest.mark.parametrize(("edge_cost", "row_cost"), [(0.0, 1.0), (0.3, 1.0), (0.3, 25.0)])
def test_equals_its_plain_twin(
    size: tuple[int, int], share: float, edge_cost: float, row_cost: float
) -> None:
    rng = np.random.default_rng(5)
    planes = rng.uniform(0, 255, (3, *size)).astype(np.float32)
    known = rng.random(size) < share
    values = rng.permutation(size[0] * size[1]).reshape(size).astype(np.float32)
    expected, said = plain_twin(planes, known, edge_cost, row_cost, values)
    carried = values.copy()
    distance = carry(planes, known, edge_cost, row_cost, carried)
    np.testing.assert_allclose(distance, expected, rtol=1e-4)
    np.testing.assert_array_equal(carried[known], values[known])
    if edge_cost:  # whole px alone leave ties
        assert np.mean(carried == said) > 0.999
    else:
        assert set(carried.ravel()) <= set(values[known] if known.any() else values.ravel())


def test_a_contour_is_not_crossed_where_a_detour_is_cheaper() -> None:
    """A wall with one gap; the near pixel beyond the wall is farther than the gap's side."""
    planes = np.zeros((3, 21, 21), np.float32)
    planes[:, :18, 10] = 200
    known = np.zeros((21, 21), np.bool_)
    known[2, 2] = known[2, 20] = True
    disparity = np.zeros((21, 21), np.float32)
    disparity[2, 2], disparity[2, 20] = 5, 9
    carry(planes, known, 3.0, 1.0, disparity)
    assert (disparity[:10, :10] == 5).all()
    assert (disparity[:10, 11:] == 9).all()

"""How well each pixel correlates with its match, and how well with the best of all other places."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

WINDOW = 11
"""Side of the windows that are compared, px: enough that edges alone are not taken for each other.

Whole numbers hold the sums: WINDOW^4 * 255^2 is below 2^31.
"""

RADIUS = WINDOW // 2

BAND = 32
"""Rows that are compared at all places before the next: what they need stays in the cache."""

OWN_PX = np.float32(3)
"""Disparities this close are the same match."""


@njit(cache=True, nogil=True)
def _sums_of_eleven(column, two, four, out):  # type: ignore[no-untyped-def]
    """out[x] = column[x] + ... + column[x + 10]. Three loops, each vectorised by itself."""
    count = out.size
    for x in range(count + 9):
        two[x] = column[x] + column[x + 1]
    for x in range(count + 6):
        four[x] = two[x] + two[x + 2]
    for x in range(count):
        out[x] = four[x] + four[x + 4] + two[x + 8] + column[x + 10]


@njit(cache=True, nogil=True)
def _add_products(row, other, sign, column):  # type: ignore[no-untyped-def]
    """Add sign * (row * other) to the sums of columns."""
    for x in range(row.size):
        column[x] += np.int32(sign) * np.int32(row[x]) * np.int32(other[x])


@njit(cache=True, nogil=True)
def window_sums(picture: NDArray[np.uint8], other: NDArray[np.uint8], out: NDArray[np.int32]) -> None:
    """Sum up the products of two pictures over each window.

    Args:
        picture, other: uint8 (H + 2 RADIUS, W + 2 RADIUS).
        out: int32 (H, W), overwritten.
    """
    height, width = out.shape
    column = np.zeros(width + 2 * RADIUS, np.int32)
    two, four = np.empty(column.size, np.int32), np.empty(column.size, np.int32)
    for y in range(height + 2 * RADIUS):
        _add_products(picture[y], other[y], 1, column)
        v = y - 2 * RADIUS
        if v >= 0:
            _sums_of_eleven(column, two, four, out[v])
            _add_products(picture[v], other[v], -1, column)


@njit(cache=True, nogil=True)
def compare_places(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    rows: NDArray[np.int64],
    sums: NDArray[np.int32],
    scales: NDArray[np.float32],
    disparity: NDArray[np.float32],
    lowest: int,
    highest: int,
    own: NDArray[np.float32],
    other: NDArray[np.float32],
) -> None:
    """The best correlation of each window near its match, and elsewhere (NCC).

    Products of the two pictures are mirrored where one of them ends, each picture by itself at its border.
    So what lies at the end of one correlates badly with anything, and is not taken for the only match
    because the others would lie outside.

    Args:
        left, right: uint8 (H, W), grey.
        rows: int64 (H + 2 RADIUS,), the rows of the pictures, mirrored beyond both ends.
        sums: of the windows of left and right, int32 (2, H, W), pictures mirrored beyond their borders.
        scales: 1 / the root of WINDOW^2 * sum of squares - square of the sum of these, float32 (2, H, W).
        disparity: float32 (H, W), px: (x, y) of left is seen at (x - d, y) in right.
        lowest, highest: of the whole disparities that are compared.
        own, other: float32 (H, W), raised to the best correlation within OWN_PX of `disparity`, and beyond.
    """
    for top in range(0, disparity.shape[0], BAND):
        end = min(top + BAND, disparity.shape[0])
        _compare_rows(left, right, rows, sums, scales, disparity, lowest, highest, own, other, top, end)


@njit(cache=True, nogil=True)
def _compare_rows(  # type: ignore[no-untyped-def]
    left, right, rows, sums, scales, disparity, lowest, highest, own, other, top, end
):
    """The same of rows top..end-1."""
    width = disparity.shape[1]
    columns = np.empty(width + 2 * RADIUS, np.int32)
    two, four = np.empty(columns.size, np.int32), np.empty(columns.size, np.int32)
    products = np.empty(width, np.int32)
    pixels, none = np.int32(WINDOW * WINDOW), np.float32(-1)
    for shift in range(lowest, highest + 1):
        first = max(shift, 0)
        count = min(width + shift, width) - first
        if count < WINDOW:
            continue
        at, step = first - shift, np.float32(shift)
        columns[:] = 0
        column = columns[RADIUS : RADIUS + count]
        for y in range(top, end + 2 * RADIUS):
            row = rows[y]
            _add_products(left[row, first : first + count], right[row, at : at + count], 1, column)
            v = y - 2 * RADIUS
            if v < top:
                continue
            for k in range(1, RADIUS + 1):
                columns[RADIUS - k] = column[k]
                columns[RADIUS + count - 1 + k] = column[count - 1 - k]
            _sums_of_eleven(columns, two, four, products[:count])
            row = rows[v]
            _add_products(left[row, first : first + count], right[row, at : at + count], -1, column)
            here, there = sums[0, v, first : first + count], sums[1, v, at : at + count]
            of_left, of_right = scales[0, v, first : first + count], scales[1, v, at : at + count]
            matched = disparity[v, first : first + count]
            near, far = own[v, first : first + count], other[v, first : first + count]
            for x in range(count):
                # Numba makes 64 bits of products of 32, which no vector instruction converts.
                covariance = np.float32(np.int32(pixels * products[x] - here[x] * there[x]))
                found = covariance * of_left[x] * of_right[x]
                is_own = abs(matched[x] - step) < OWN_PX
                near[x] = max(near[x], found if is_own else none)
                far[x] = max(far[x], none if is_own else found)

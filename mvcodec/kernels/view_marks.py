"""Few pixels of a row that need more work than the others."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.runs import first_of

BLOCK = 32
"""Marks that are asked together, in one vector."""


@njit(cache=True, nogil=True)
def list_marked(marks: NDArray[np.uint8], chosen: NDArray[np.int32]) -> int:
    """List where a row is marked.

    Args:
        marks: uint8 (W,), 0 or 1.
        chosen: int32 (W,), its beginning overwritten with the marked places.

    Returns:
        How many there are.
    """
    count = 0
    for start in range(0, marks.size, BLOCK):
        end = min(start + BLOCK, marks.size)
        found = np.uint8(0)
        for x in range(start, end):
            found |= marks[x]
        if found:
            for x in range(start, end):
                chosen[count] = x
                count += marks[x]
    return count


@njit(cache=True, nogil=True, inline="always")
def list_bits(bits, x, chosen, count):  # type: ignore[no-untyped-def]
    """Append the pixels that the bits say from x on to a list; how long it is then."""
    while bits:
        chosen[count] = x + first_of(bits)
        count += 1
        bits &= bits - np.uint32(1)
    return count

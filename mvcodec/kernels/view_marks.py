"""Few pixels of a row that need more work than the others."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mvcodec.kernels.lanes import COUNT
from mvcodec.kernels.runs import first_of, marked


@njit(cache=True, nogil=True, inline="always")
def list_bits(bits, x, chosen, count):  # type: ignore[no-untyped-def]
    """Append the pixels that the bits say from x on to a list; how long it is then."""
    while bits:
        chosen[count] = x + first_of(bits)
        count += 1
        bits &= bits - np.uint32(1)
    return count


@njit(cache=True, nogil=True)
def list_marked(marks: NDArray[np.uint8], chosen: NDArray[np.int32]) -> int:
    """List where a row is marked.

    Args:
        marks: uint8 (W,), 0 or 1.
        chosen: int32 (W,), its beginning overwritten with the marked places.

    Returns:
        How many there are.
    """
    count, end = 0, marks.size - marks.size % COUNT
    for start in range(0, end, COUNT):
        count = list_bits(marked(marks, start), start, chosen, count)
    for x in range(end, marks.size):
        if marks[x]:
            chosen[count] = x
            count += 1
    return count

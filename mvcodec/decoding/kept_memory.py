"""Memory that frame sets have left is kept for those that follow."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

import numpy as np

LARGEST_BYTES = 31 << 20
"""A larger block would not count: glibc follows blocks of up to 32 MiB."""

SERVER_BYTES = 1 << 30

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8
"""Of glibc's mallopt."""


@cache
def keep_freed_memory() -> None:
    """Let the C library keep what is freed, up to some 60 MiB, where it is glibc; elsewhere nothing happens.

    Else it gives memory back to the system whenever a frame set is let go of, and asks for it again, page by
    page, for the next one. How much it keeps follows the largest block freed so far (mallopt(3), on the
    dynamic mmap threshold), which may be one that nobody has written to.
    """
    np.empty(LARGEST_BYTES, np.uint8)


def keep_freed_memory_of_a_server() -> None:
    """Let glibc keep up to 1 GiB of what is freed: only where the whole process is ours.

    All threads then share one store of it, so that pictures which one thread has let go of serve another.
    Where there is another C library, nothing happens.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_ARENA_MAX, 1)
        mallopt(_M_MMAP_THRESHOLD, 32 << 20)  # the most that it takes
        mallopt(_M_TRIM_THRESHOLD, SERVER_BYTES)

"""Memory that frame sets have left is kept for those that follow."""

from __future__ import annotations

from functools import cache

import numpy as np

LARGEST_BYTES = 31 << 20
"""A larger block would not count: glibc follows blocks of up to 32 MiB."""


@cache
def keep_freed_memory() -> None:
    """Let the C library keep what is freed, up to some 60 MiB, where it is glibc; elsewhere nothing happens.

    Else it gives memory back to the system whenever a frame set is let go of, and asks for it again, page by
    page, for the next one. How much it keeps follows the largest block freed so far (mallopt(3), on the
    dynamic mmap threshold), which may be one that nobody has written to.
    """
    np.empty(LARGEST_BYTES, np.uint8)

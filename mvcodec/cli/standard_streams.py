"""Standard input and output as files, for `-`."""

from __future__ import annotations

import sys
from typing import BinaryIO, cast

STANDARD = "-"
"""What the user writes for standard input or output."""


def standard_output() -> BinaryIO:
    """Standard output without a buffer, so that what is written is gone, and nothing is left at a failure."""
    return cast("BinaryIO", open(sys.stdout.fileno(), "wb", buffering=0, closefd=False))

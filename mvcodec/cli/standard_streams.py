"""Standard input and output as files, for `-`."""

from __future__ import annotations

import sys
from typing import BinaryIO, cast

STANDARD = "-"
"""What the user writes for standard input or output."""


def standard_input() -> BinaryIO:
    """Standard input without a buffer, so that what is there can be read at once."""
    return cast("BinaryIO", open(sys.stdin.fileno(), "rb", buffering=0, closefd=False))


def standard_output() -> BinaryIO:
    """Standard output without a buffer, so that what is written is gone, and nothing is left at a failure."""
    return cast("BinaryIO", open(sys.stdout.fileno(), "wb", buffering=0, closefd=False))

"""The progress bar: on standard error, on a terminal only, and not with --quiet."""

from __future__ import annotations

import sys

from tqdm import tqdm


def progress(description: str, total: int | None, *, quiet: bool = False, unit: str = "frame") -> tqdm[None]:
    """A bar to be used as a context manager and moved on with `update`.

    Args:
        total: how many units there are to do; None where that is not known.
    """
    hidden = quiet or not sys.stderr.isatty()
    return tqdm(total=total, desc=description, unit=unit, file=sys.stderr, disable=hidden, leave=False)

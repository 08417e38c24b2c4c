"""The progress bar: on standard error, on a terminal only, and not with --quiet."""

from __future__ import annotations

import sys

from tqdm import tqdm


def tell_written(target: object, what: str, pictures: int, fps: float) -> None:
    """Say on standard error what was written: where, how much, and how long it plays."""
    print(f"mvcodec: {target}: {what}, {fps:g} fps, {pictures / fps:.2f} s", file=sys.stderr)


def progress(description: str, total: int | None, *, quiet: bool = False, unit: str = "frame") -> tqdm[None]:
    """A bar to be used as a context manager and moved on with `update`.

    Args:
        total: how many units there are to do; None where that is not known.
    """
    hidden = quiet or not sys.stderr.isatty()
    return tqdm(total=total, desc=description, unit=unit, file=sys.stderr, disable=hidden, leave=False)

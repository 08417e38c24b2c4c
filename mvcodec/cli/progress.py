"""Progress: on standard error, on a terminal only, and not with --quiet."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Self

from tqdm import tqdm

_COUNTED = "{l_bar}{bar}| {n_fmt}/{total_fmt}, {remaining} left [{elapsed}, {rate_fmt}{postfix}]"
_CODING = "encode"
_AT_ONCE = 2
"""So many frame sets are shown as soon as they are coded, however quickly: the first estimates."""
_COMPILING = "compiling, once after an installation"


def tell_written(target: object, what: str, pictures: int, fps: float) -> None:
    """Say on standard error what was written: where, how much, and how long it plays."""
    print(f"mvcodec: {target}: {what}, {fps:g} fps, {pictures / fps:.2f} s", file=sys.stderr)


def progress(description: str, total: int | None, *, quiet: bool = False, unit: str = "frame") -> tqdm[None]:
    """A bar to be used as a context manager and moved on with `update`; it tells how long the rest will take.

    Args:
        total: how many units there are to do; None where that is not known.
    """
    return tqdm(
        total=total,
        desc=description,
        unit=unit,
        file=sys.stderr,
        disable=_hidden(quiet),
        leave=False,
        bar_format=_COUNTED if total else None,
    )


@contextmanager
def stage(description: str, *, quiet: bool = False) -> Iterator[None]:
    """A line that says what the block does, for work whose length nobody knows beforehand."""
    line = tqdm(desc=description, file=sys.stderr, disable=_hidden(quiet), leave=False, bar_format="{desc}")
    with line:
        _tell_compiling(line, description, lambda: None)
        yield


class CodingProgress:
    """The bar of a coding, which leaves the time out of its estimate that is spent compiling."""

    def __init__(self, frame_sets: int, *, quiet: bool) -> None:
        self._bar, self._compiled = progress(_CODING, frame_sets, quiet=quiet, unit="frame set"), False
        _tell_compiling(self._bar, _CODING, self._has_compiled)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._bar.close()

    def update(self) -> None:
        """One more frame set was coded."""
        bar = self._bar
        if not self._compiled:
            bar.update()
            if bar.n <= _AT_ONCE:
                bar.refresh()
            return
        self._compiled = False
        bar.n += 1
        bar.initial = bar.last_print_n = bar.n
        bar.start_t = bar.last_print_t = time.time()
        bar.set_description_str(_CODING)

    def _has_compiled(self) -> None:
        self._compiled = True


def _tell_compiling(bar: tqdm[None], description: str, also: Callable[[], object]) -> None:
    """Have the bar say so when a kernel has to be compiled while it is shown."""
    if bar.disable:
        return
    # Numba takes a while to load; whoever sees no bar does not need it here.
    from mvcodec.kernels.compiled_code import on_first_compilation

    def tell() -> None:
        if not bar.disable:  # else it was closed
            also()
            bar.set_description_str(f"{description}, {_COMPILING}")

    on_first_compilation(tell)


def _hidden(quiet: bool) -> bool:
    return quiet or not sys.stderr.isatty()

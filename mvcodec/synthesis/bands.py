"""Kernels over bands of rows, side by side."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from itertools import pairwise

THREADS = 2


def make_pool(name: str) -> ThreadPoolExecutor:
    """THREADS threads for `run_in_bands`."""
    return ThreadPoolExecutor(THREADS, name)


def run_in_bands(pool: Executor, height: int, kernel: Callable[..., None], *arguments: object) -> None:
    """Call ``kernel(*arguments, first, last)`` for bands of the rows, one a thread; wait for all."""
    edges = [height * band // THREADS for band in range(THREADS + 1)]
    jobs = [pool.submit(kernel, *arguments, first, last) for first, last in pairwise(edges)]
    for job in jobs:
        job.result()

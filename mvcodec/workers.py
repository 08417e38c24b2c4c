"""One setting for threads, and one pool that all that computes shares.

How many threads compute at once changes how long something takes, never a bit of what comes out. A job may
hand out jobs of its own: whoever waits for one that nobody has begun does it, so that none waits for ever.
"""

from __future__ import annotations

import contextvars
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from mvcodec.settings import check_settings, setting

MAX_THREADS = 256

Result = TypeVar("Result")

_scope: contextvars.ContextVar[int | None] = contextvars.ContextVar("threads", default=None)
_pools: dict[int, ThreadPoolExecutor] = {}
_lock = threading.Lock()


def thread_setting() -> Any:
    """The field of every settings class that has a number of threads."""
    return setting(
        None,
        "threads that compute at once; no result depends on it (default: one for each core)",
        low=1,
        high=MAX_THREADS,
    )


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """How a process, a decoder or a synthesizer computes."""

    threads: int | None = thread_setting()

    def __post_init__(self) -> None:
        check_settings(self)


class _Process:
    """The setting of the process, where nothing narrower is set."""

    threads: int | None = None


def check_threads(count: int | None) -> None:
    """Raise SettingError where a number of threads is given that cannot be."""
    WorkerSettings(count)


def set_threads(count: int | None) -> None:
    """How many threads this process computes with; None: one for each core that it may use.

    Raises:
        SettingError: not 1..256.
    """
    check_threads(count)
    _Process.threads = count


@contextmanager
def threads(count: int | None) -> Iterator[None]:
    """Compute with this many threads inside of the block; None: as outside of it."""
    check_threads(count)
    before = _scope.set(thread_count() if count is None else count)
    try:
        yield
    finally:
        _scope.reset(before)


def thread_count() -> int:
    """How many threads compute at once here."""
    return _scope.get() or _Process.threads or _cores()


@contextmanager
def scheduling_kept() -> Iterator[None]:
    """This thread, and the threads that begin inside of the block, end with the scheduling it has now.

    Where a process may (as root), SVT-AV1 makes its own threads and its caller's real-time ones. All else
    on the machine would wait for them, and each program that the process starts would inherit it.
    """
    if not hasattr(os, "sched_setscheduler"):
        yield
        return
    policy, parameters, before = os.sched_getscheduler(0), os.sched_getparam(0), _thread_ids()
    try:
        yield
    finally:
        for thread in {0} | (_thread_ids() - before):
            with suppress(ProcessLookupError):
                if os.sched_getscheduler(thread) != policy:
                    os.sched_setscheduler(thread, policy, parameters)


def _thread_ids() -> set[int]:
    tasks = Path("/proc/self/task")
    return {int(task.name) for task in tasks.iterdir()} if tasks.is_dir() else set()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return min(len(os.sched_getaffinity(0)), MAX_THREADS)
    return min(os.cpu_count() or 1, MAX_THREADS)


class Job(Generic[Result]):
    """Something that a thread of the pool does, or whoever needs it first."""

    def __init__(self, function: Callable[..., Result], arguments: tuple[Any, ...]) -> None:
        self._work: Callable[[], Result] = lambda: function(*arguments)
        self._context = contextvars.copy_context()
        self._future: Future[Result] = Future()
        self._begun = threading.Lock()

    def begin(self) -> None:
        """Do it now, unless somebody has begun."""
        if not self._begun.acquire(blocking=False):
            return
        try:
            found = self._context.run(self._work)
        except BaseException as error:
            self._future.set_exception(error)
            if not isinstance(error, Exception):
                raise
        else:
            self._future.set_result(found)

    def result(self) -> Result:
        """What came of it; does it here if nobody has begun. Raises what it raised."""
        self.begin()
        return self._future.result()

    def wait(self) -> None:
        """Wait for its end, good or bad."""
        wait([self._future])

    def cancel(self) -> None:
        """Let it be, if nobody has begun."""
        if self._begun.acquire(blocking=False):
            self._future.cancel()
            self._future.set_running_or_notify_cancel()


def submit(function: Callable[..., Result], *arguments: Any) -> Job[Result]:
    """Start a job on the shared pool; with one thread it is done before this returns."""
    job = Job(function, arguments)
    count = thread_count()
    if count == 1:
        job.begin()
    else:
        _pool(count).submit(job.begin)
    return job


def settle(jobs: Iterable[Job[Any]]) -> None:
    """Do what nobody has begun, the last first, and wait for the rest. Errors stay in the jobs."""
    waiting = list(jobs)
    for job in reversed(waiting):
        job.begin()
    for job in waiting:
        job.wait()


def run_all(function: Callable[..., Result], *items: Iterable[Any]) -> list[Result]:
    """`function` of each item (of each group, from several iterables), side by side, in order.

    All are done when it returns, also when it raises what the first that failed has raised.
    """
    jobs = [submit(function, *group) for group in zip(*items, strict=True)]
    settle(jobs)
    return [job.result() for job in jobs]


def run_in_bands(length: int, work: Callable[..., object], *arguments: object) -> None:
    """``work(*arguments, first, last)`` for bands of ``range(length)``, one a thread.

    Wherever they end, the same must come out.
    """
    count = max(min(thread_count(), length), 1)
    edges = [length * band // count for band in range(count + 1)]
    run_all(partial(work, *arguments), edges[:-1], edges[1:])


def _pool(count: int) -> ThreadPoolExecutor:
    """The pool of everything that computes with this many threads; whoever waits is one of them."""
    with _lock:
        if count not in _pools:
            _pools[count] = ThreadPoolExecutor(count - 1, "mvcodec")
        return _pools[count]

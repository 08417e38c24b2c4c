"""One setting for threads, and one pool that all that computes shares.

How many threads compute at once changes how long something takes, never a bit of what comes out. A job may
hand out jobs of its own: whoever waits for one that nobody has begun does it, so that none waits for ever.
"""

from __future__ import annotations

import contextvars
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from mvcodec.settings import check_settings, setting

MAX_THREADS = 256

Result = TypeVar("Result")

_scope: contextvars.ContextVar[int | None] = contextvars.ContextVar("threads", default=None)
_pools: dict[int, _Pool] = {}
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
    if count is not None:
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
    """Something that a thread of the pool does, or whoever needs it first.

    A plain lock says that it is done: futures cost several times as much, which counts where jobs are short.
    """

    def __init__(self, function: Callable[..., Result], arguments: tuple[Any, ...]) -> None:
        self._work: Callable[[], Result] | None = partial(function, *arguments)
        self._context = contextvars.copy_context()
        self._begun, self._undone = threading.Lock(), threading.Lock()
        self._undone.acquire()
        self._found: Result
        self._error: BaseException | None = None

    @property
    def done(self) -> bool:
        """Whether it has come to its end, good or bad."""
        return not self._undone.locked()

    def begin(self) -> None:
        """Do it now, unless somebody has begun."""
        if not self._begun.acquire(blocking=False):
            return
        work, self._work = self._work, None
        assert work is not None
        try:
            self._found = self._context.run(work)
        except BaseException as error:
            self._error = error
            if not isinstance(error, Exception):
                raise
        finally:
            del work  # what it needed is let go of before it counts as done
            self._undone.release()

    def result(self) -> Result:
        """What came of it; does it here if nobody has begun. Raises what it raised."""
        self.begin()
        self.wait()
        if self._error is not None:
            try:
                raise self._error
            finally:
                del self  # the error's frames would hold the job, and it them
        return self._found

    def wait(self) -> None:
        """Wait for its end, good or bad."""
        if self._undone.locked():
            with self._undone:
                pass

    def cancel(self) -> None:
        """Let it be, if nobody has begun."""
        if self._begun.acquire(blocking=False):
            self._error = CancelledError()
            self._undone.release()


class _Pool:
    """The threads beside the one that hands out the work. What is urgent is begun before what can wait."""

    def __init__(self, helpers: int) -> None:
        self._threads = ThreadPoolExecutor(helpers, "mvcodec")
        self._helpers, self._busy = helpers, 0
        self._urgent, self._later = deque[Callable[[], None]](), deque[Callable[[], None]]()
        self._lock = threading.Lock()

    def submit(self, begin: Callable[[], None], *, later: bool = False) -> None:
        """Have it done; wake another thread only if one sleeps."""
        with self._lock:
            (self._later if later else self._urgent).append(begin)
            if self._busy == self._helpers:
                return
            self._busy += 1
        self._threads.submit(self._serve)

    def take_later(self) -> Callable[[], None] | None:
        """Something of what can wait, for who has to wait."""
        with self._lock:
            return self._later.popleft() if self._later else None

    def _serve(self) -> None:
        while (begin := self._next()) is not None:
            with suppress(BaseException):  # who waits for the job is told
                begin()

    def _next(self) -> Callable[[], None] | None:
        with self._lock:
            for queue in (self._urgent, self._later):
                if queue:
                    return queue.popleft()
            self._busy -= 1
            return None


def submit(function: Callable[..., Result], *arguments: Any) -> Job[Result]:
    """Start a job on the shared pool; with one thread it is done before this returns."""
    return _submit(Job(function, arguments), later=False)


def submit_later(function: Callable[..., Result], *arguments: Any) -> Job[Result]:
    """Like `submit`, but it is begun when a thread has nothing else to do, or to wait for.

    Such a job must wait for no other, since it is done in the midst of jobs that it knows nothing of.
    """
    return _submit(Job(function, arguments), later=True)


def _submit(job: Job[Result], *, later: bool) -> Job[Result]:
    count = thread_count()
    if count == 1:
        job.begin()
    else:
        _pool(count).submit(job.begin, later=later)
    return job


def settle(jobs: Iterable[Job[Any]]) -> None:
    """Do what nobody has begun, the last first, and wait for the rest. Errors stay in the jobs.

    Who waits meanwhile does what can wait (`submit_later`).
    """
    waiting = list(jobs)
    for job in reversed(waiting):
        job.begin()
    for job in waiting:
        while not job.done and (begin := _pool(thread_count()).take_later()) is not None:
            begin()
        job.wait()


def run_all(function: Callable[..., Result], *items: Iterable[Any]) -> list[Result]:
    """`function` of each item (of each group, from several iterables), side by side, in order.

    All are done when it returns, also when it raises what the first that failed has raised.
    """
    jobs = [submit(function, *group) for group in zip(*items, strict=True)]
    settle(jobs)
    return [job.result() for job in jobs]


def run_in_bands(length: int, work: Callable[..., object], *arguments: object) -> None:
    """``work(*arguments, first, last)`` for bands of ``range(length)``, one for each thread.

    Wherever they end, the same must come out. More bands than threads would share out uneven rows better, but
    a band of a view asks rows beyond its ends, which costs more.
    """
    count = max(min(thread_count(), length), 1)
    edges = [length * band // count for band in range(count + 1)]
    run_all(partial(work, *arguments), edges[:-1], edges[1:])


def _pool(count: int) -> _Pool:
    """The pool of everything that computes with this many threads; whoever waits is one of them."""
    pool = _pools.get(count)
    if pool is None:
        with _lock:
            pool = _pools.setdefault(count, _Pool(count - 1))
    return pool

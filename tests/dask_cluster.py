"""A Dask scheduler with two workers, each in a process of its own, on the loopback address."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

DEADLINE_S = 180
"""Everything comes long before; what never comes fails the test."""


def wait_for(what: Callable[[], bool], name: str) -> None:
    """Wait until something is so."""
    end = time.monotonic() + DEADLINE_S
    while not what():
        assert time.monotonic() < end, f"{name} did not come"
        time.sleep(0.05)


@contextmanager
def running_cluster(folder: Path) -> Iterator[str]:
    """Start the scheduler and its workers.

    Args:
        folder: for the scheduler's address and the workers' own files.

    Yields:
        The scheduler's address.
    """
    found = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = ["--scheduler-file", str(found), "--host", "127.0.0.1", "--no-dashboard"]
    started = [subprocess.Popen([*dask, "scheduler", *common, "--port", "0"], **quiet)]  # type: ignore[call-overload]
    try:
        wait_for(found.exists, "the scheduler")
        for number in range(2):
            space = ["--local-directory", str(folder), "--nthreads", "1", "--name", str(number)]
            started.append(subprocess.Popen([*dask, "worker", *common, *space], **quiet))  # type: ignore[call-overload]
        with Client(scheduler_file=str(found)) as client:
            wait_for(lambda: len(client.scheduler_info()["workers"]) == 2, "two workers")
            address = str(client.scheduler.address)
        yield address
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(30)


def kill_a_busy_worker(address: str) -> None:
    """`kill -9` one worker while it runs a task."""
    with Client(address) as client:
        busy: list[str] = []

        def found() -> bool:
            busy[:] = [worker for worker, tasks in client.processing().items() if tasks]
            return bool(busy)

        wait_for(found, "a busy worker")
        pid = client.run(os.getpid, workers=busy[:1])[busy[0]]
    os.kill(pid, signal.SIGKILL)

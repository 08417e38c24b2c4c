"""Starts commands quickly: a process that has imported what they need forks one for each of them.

Importing, and loading compiled code that is kept, is most of a short command's time. Run as a program, it
takes from a socket (the descriptor in its one argument) what to run, with which standard streams, and gives
back how it ended.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

COMMANDS = ("batch", "compare", "decode", "encode", "evaluate", "info", "rectify", "render", "validate")
MODULES = (*(f"cli.{command}" for command in COMMANDS), "evaluation.report", "evaluation.study")
"""Imported ahead; commands need little more than these."""
OF_ONE_TEST = "PYTEST_CURRENT_TEST"
"""Differs from test to test in the environment, and means nothing to a command."""
_MOST_BYTES = 1 << 16


class Starter:
    """The process that forks; it ends with this one."""

    def __init__(self) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._environment = _environment()
        self._lock = threading.Lock()
        self._process = subprocess.Popen(
            [sys.executable, __file__, str(theirs.fileno())], pass_fds=[theirs.fileno()]
        )
        theirs.close()
        atexit.register(self.close)

    def run(self, arguments: list[str], stdin: bytes | None) -> subprocess.CompletedProcess[bytes] | None:
        """One command to its end, in this folder; None: it is busy, or has another environment."""
        if _environment() != self._environment or not self._lock.acquire(blocking=False):
            return None
        try:
            return self._run(arguments, stdin or b"")
        finally:
            self._lock.release()

    def close(self) -> None:
        """End it."""
        self._socket.close()
        self._process.wait()

    def _run(self, arguments: list[str], stdin: bytes) -> subprocess.CompletedProcess[bytes]:
        pipes = [os.pipe() for _ in range(3)]
        theirs = [pipes[0][0], pipes[1][1], pipes[2][1]]
        socket.send_fds(self._socket, [json.dumps([str(Path.cwd()), *arguments]).encode()], theirs)
        for descriptor in theirs:
            os.close(descriptor)
        with ThreadPoolExecutor(3) as pool:
            pool.submit(_write, pipes[0][1], stdin)
            printed, said = (pool.submit(_read, pipes[stream][0]) for stream in (1, 2))
            code = int(self._socket.recv(_MOST_BYTES))
            return subprocess.CompletedProcess(arguments, code, printed.result(), said.result())


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != OF_ONE_TEST}


def _write(descriptor: int, data: bytes) -> None:
    try:
        with os.fdopen(descriptor, "wb") as pipe:
            pipe.write(data)
    except BrokenPipeError:  # it ended without reading all
        pass


def _read(descriptor: int) -> bytes:
    with os.fdopen(descriptor, "rb") as pipe:
        return pipe.read()


def serve(channel: socket.socket) -> None:
    """Fork for each command that is asked for; returns at the end of the channel, and in each child."""
    from mvcodec.cli.main import tell_libraries

    tell_libraries()
    from warm_up import warm_up

    for module in MODULES:
        import_module(f"mvcodec.{module}")
    warm_up()
    gc.collect()
    gc.freeze()  # or each command would look through all of it at its end
    usual = signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        message, streams, _, _ = socket.recv_fds(channel, _MOST_BYTES, 3)
        if not message:
            return
        child = os.fork()
        if child == 0:
            signal.signal(signal.SIGINT, usual)
            channel.close()
            for number, descriptor in enumerate(streams):
                os.dup2(descriptor, number)
                os.close(descriptor)
            folder, *sys.argv[1:] = json.loads(message)
            os.chdir(folder)
            return
        for descriptor in streams:
            os.close(descriptor)
        channel.send(b"%d" % os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))


class Ending:
    """How a forked command ends: as usual, but its objects are not taken apart one by one.

    They lie in memory that it shares with the process it was forked from, each page of which would be copied.
    """

    def __init__(self) -> None:
        self.code = 1  # of an exception that nobody caught
        self._parent = os.getpid()
        atexit.register(self._leave)  # before what is imported later registers its own: those run first

    @property
    def is_fork(self) -> bool:
        return os.getpid() != self._parent

    def _leave(self) -> None:
        if self.is_fork:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(self.code)


if __name__ == "__main__":
    ending = Ending()
    with socket.socket(fileno=int(sys.argv[1])) as given:
        given.set_inheritable(False)
        serve(given)
    if ending.is_fork:
        try:
            runpy.run_module("mvcodec", run_name="__main__", alter_sys=True)
        except SystemExit as left:
            ending.code = left.code if isinstance(left.code, int) else int(left.code is not None)
            raise

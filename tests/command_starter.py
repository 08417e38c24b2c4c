"""Starts commands quickly: a process that has imported what they need forks one for each of them.

Importing, and loading compiled code that is kept, is most of a short command's time. Run as a program, it
takes from a socket (the descriptor in its one argument) what to run, with which standard streams, and gives
back how it ended.
"""

from __future__ import annotations

import atexit
import gc
import io
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
"""Whose modules are imported ahead; the others need little more than these."""
OF_ONE_TEST = "PYTEST_CURRENT_TEST"
"""Differs from test to test in the environment, and means nothing to a command."""
AGAIN_AFTER = (1, 2, 4, 8, 16, 32)
"""Commands after which it is tried again to warm up, where kernels were not compiled yet."""
_MOST_BYTES = 1 << 16


class _NotCompiled(Exception):
    """A kernel would have to be compiled."""


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


def _warm_up() -> bool:
    """Code, decode and look at a small picture, so that each command has what that loads, kernels above all.

    Commands fork from here, so nothing of it may leave a thread behind. Where kernels are not compiled yet,
    that is left to the commands; returns whether they were.
    """
    import cv2
    import numpy as np

    from mvcodec.array import Calibration, CameraArray, Viewpoint
    from mvcodec.container import McapWriter
    from mvcodec.decoding.decoder import Decoder
    from mvcodec.encoding.encoder import Encoder, EncoderConfig
    from mvcodec.frames import FrameSet
    from mvcodec.kernels import on_first_compilation
    from mvcodec.stereo.disparity_range import estimate_range
    from mvcodec.synthesis.synthesizers import SYNTHESIZERS, make_synthesizer
    from mvcodec.workers import threads

    warming = True

    def compiling() -> None:
        if warming:
            raise _NotCompiled

    on_first_compilation(compiling)
    array = CameraArray(2, 2, 64, 48, 10.0, (0, 1), (0, 1), Calibration.nominal(64, 48))
    noise = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    frame_set = FrameSet(0, 0, dict.fromkeys(array.real, noise))
    file = io.BytesIO()
    usual = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threads(1):
            estimate_range(array, [frame_set], None)
            with McapWriter(file) as writer, Encoder(array, EncoderConfig()) as encoder:
                writer.push(encoder.push(frame_set))
            file.seek(0)
            with Decoder.open(file) as decoder:
                (decoded,) = decoder
            for name in SYNTHESIZERS:
                make_synthesizer(name).render(decoded, Viewpoint(0.5, 0.5))
    except _NotCompiled:
        return False
    finally:
        warming = False
        cv2.setNumThreads(usual)
        gc.collect()
        gc.freeze()  # or each command would look through all of it at its end
    return True


def serve(channel: socket.socket) -> None:
    """Fork for each command that is asked for; returns at the end of the channel, and in each child."""
    from mvcodec.cli.main import tell_libraries

    tell_libraries()
    for command in COMMANDS:
        import_module(f"mvcodec.cli.{command}")
    forked, warm = 0, _warm_up()
    usual = signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        message, streams, _, _ = socket.recv_fds(channel, _MOST_BYTES, 3)
        if not message:
            return
        if not warm and forked in AGAIN_AFTER:
            warm = _warm_up()
        forked += 1
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


if __name__ == "__main__":
    parent = os.getpid()
    with socket.socket(fileno=int(sys.argv[1])) as given:
        given.set_inheritable(False)
        serve(given)
    if os.getpid() != parent:
        runpy.run_module("mvcodec", run_name="__main__", alter_sys=True)

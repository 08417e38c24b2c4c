"""What workers do: one command of `mvcodec` each, in a process of its own, its output put in place whole.

Only names, settings and figures travel through the scheduler; pictures and files never do.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mvcodec
from mvcodec.cluster.places import Place
from mvcodec.errors import MvCodecError

CHILD = "mvcodec.cli.child"

PART = ".part"
"""The ending of folders that hold an output until it is whole."""

POLL_SECONDS = 0.5
"""How often a worker looks whether its child is done."""

ASK_SECONDS = 2.0
"""How often a worker asks the scheduler whether the run was cancelled: one small message."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a task that came to an end.

    Attributes:
        error: one line, where it failed for a reason that another try would not change.
        result: what the command printed as JSON, if it did.
        seconds: wall-clock time of the command.
        warnings: lines.
    """

    error: str | None = None
    result: Any = None
    seconds: float = 0.0
    warnings: tuple[str, ...] = ()


class Lost(Exception):
    """A command that was killed, or a place that could not be reached: another try may help."""


def run_command(
    command: str,
    source: str,
    options: Sequence[str],
    target: str | None,
    run: str,
    version: str,
) -> Outcome:
    """Run one command on a recording.

    Args:
        command: its name.
        source: path or URL of its input; what is not of this machine is fetched first.
        options: as on the command line.
        target: where its output goes; None where it writes none.
        run: name of the event that cancels the run.
        version: of the client's mvcodec.

    Raises:
        Lost: it was killed.
    """
    if version != mvcodec.__version__:
        return Outcome(f"this worker has mvcodec {mvcodec.__version__}, the client has {version}")
    try:
        with Place(source).fetched() as found:
            if target is None:
                return _child([command, str(found), *options], run)
            with _workplace(Place(target), run) as part:
                outcome = _child([command, str(found), str(part), *options], run)
                if outcome.error is None:
                    Place(target).put(part)
                return outcome
    except MvCodecError as error:
        return Outcome(" ".join(str(error).split()))


def join_parts(parts: Sequence[str], target: str, run: str) -> Outcome:
    """Join segments to the recording's file, then remove them.

    Raises:
        Lost: it was killed.
    """
    try:
        with (
            tempfile.TemporaryDirectory(prefix="mvcodec-join-") as folder,
            _workplace(Place(target), run) as made,
        ):
            here = [_here(Place(part), Path(folder)) for part in parts]
            outcome = _child(["join", *map(str, here), str(made), "--json"], run)
            if outcome.error is None:
                Place(target).put(made)
        if outcome.error is None:
            for part in parts:
                Place(part).remove()
        return outcome
    except MvCodecError as error:
        return Outcome(" ".join(str(error).split()))


def _here(part: Place, folder: Path) -> Path:
    """A part on this machine, copied where it is not."""
    if part.local is not None:
        return part.local
    copy = folder / part.name
    copy.write_bytes(part.read())
    return copy


@contextmanager
def _workplace(target: Place, run: str) -> Iterator[Path]:
    """A path for a new output, beside its target where that is on this machine; nothing stays there.

    It has the same name at each try of one run, so that what a killed try left behind is removed by the next
    one; another run, whose cancelled tasks may take a while to end, has others.
    """
    if target.local is None:
        with tempfile.TemporaryDirectory(prefix="mvcodec-out-") as made:
            yield Path(made) / target.name
        return
    folder = target.local.parent / f".{target.name}.{run[-8:]}{PART}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        yield folder / target.name
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _child(arguments: Sequence[str], run: str) -> Outcome:
    """Run `mvcodec` in a process that ends when this one does."""
    started = time.monotonic()
    command = [sys.executable, "-m", CHILD, *arguments]
    with (
        tempfile.TemporaryFile() as out,
        tempfile.TemporaryFile() as said,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=out, stderr=said) as child,
    ):
        try:
            _wait(child, run)
        finally:
            child.kill()  # nothing happens where it ended by itself
        code = child.wait()
        out.seek(0)
        said.seek(0)
        printed, lines = out.read().decode(), said.read().decode().splitlines()
    return _outcome(code, printed, lines, time.monotonic() - started)


def _outcome(code: int, printed: str, lines: Sequence[str], seconds: float) -> Outcome:
    if code < 0:
        raise Lost(f"killed by signal {-code}; it said: {lines[-1] if lines else 'nothing'}")
    told = tuple(line for line in lines if line.startswith("mvcodec: warning: "))
    rest = [line for line in lines if line not in told]
    try:
        result = json.loads(printed) if printed.strip() else None
    except ValueError:
        result = None
    error = (rest[-1] if rest else f"exit code {code}") if code else None
    return Outcome(error and error.removeprefix("mvcodec: error: "), result, seconds, told)


def _wait(child: subprocess.Popen[bytes], run: str) -> None:
    """Wait for the child, or until the run is cancelled."""
    import distributed

    cancelled = distributed.Event(run)
    asked = time.monotonic()
    while True:
        try:
            child.wait(POLL_SECONDS)
            return
        except subprocess.TimeoutExpired:
            if time.monotonic() - asked > ASK_SECONDS:
                asked = time.monotonic()
                if cancelled.is_set():
                    return

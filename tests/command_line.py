"""Runs the command line as a user does: in a process of its own.

It is forked from one that has the imports behind it, where that can be. What a user's start does beside,
tests see that start `COMMAND` themselves.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

from command_starter import Starter

COMMAND = (sys.executable, "-m", "mvcodec")


def mvcodec(*arguments: str | Path, stdin: bytes | None = None) -> subprocess.CompletedProcess[str]:
    """Run one command to its end."""
    words = list(map(str, arguments))
    starter = _starter()
    done = None if starter is None else starter.run(words, stdin)
    if done is None:
        done = subprocess.run([*COMMAND, *words], input=stdin, capture_output=True, check=False)
    return subprocess.CompletedProcess(done.args, done.returncode, done.stdout.decode(), done.stderr.decode())


@cache
def _starter() -> Starter | None:
    """The one of this process; None where the system cannot fork as it needs."""
    return Starter() if sys.platform == "linux" else None


def succeeds(*arguments: str | Path, stdin: bytes | None = None) -> str:
    """Run a command that must succeed; returns its standard output."""
    done = mvcodec(*arguments, stdin=stdin)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout


def fails(code: int, *arguments: str | Path, stdin: bytes | None = None) -> str:
    """Run a command that must fail with that exit code and one line; returns the line.

    Warnings have lines of their own and are left out.
    """
    done = mvcodec(*arguments, stdin=stdin)
    assert done.returncode == code, (done.returncode, done.stderr)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("mvcodec: warning: ")]
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    return lines[0]

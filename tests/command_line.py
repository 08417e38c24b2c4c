"""Runs the command line as a user does: in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

COMMAND = (sys.executable, "-m", "mvcodec")


def mvcodec(*arguments: str | Path, stdin: bytes | None = None) -> subprocess.CompletedProcess[str]:
    """Run one command to its end."""
    done = subprocess.run([*COMMAND, *map(str, arguments)], input=stdin, capture_output=True, check=False)
    return subprocess.CompletedProcess(done.args, done.returncode, done.stdout.decode(), done.stderr.decode())


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

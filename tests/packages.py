"""Packages built and installed into a folder of their own, without an index."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

OLDEST_SETUPTOOLS = "77"
"""Older ones do not know how pyproject.toml names a licence."""

PIP = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check")
OFFLINE = ("--no-deps", "--no-index")


def build_wheel(project: Path, folder: Path) -> Path:
    """The wheel of a project; skips the test where setuptools is too old to make one."""
    pytest.importorskip("setuptools", OLDEST_SETUPTOOLS)
    command = [*PIP, "wheel", *OFFLINE, "--no-build-isolation", "--wheel-dir", str(folder), str(project)]
    subprocess.run(command, check=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def installed(target: Path, *packages: Path) -> dict[str, str]:
    """Install projects or wheels into a folder; returns an environment whose Python sees them first."""
    pytest.importorskip("setuptools", OLDEST_SETUPTOOLS)
    command = [*PIP, "install", *OFFLINE, "--no-build-isolation", "--target", str(target)]
    subprocess.run([*command, *map(str, packages)], check=True)
    return {**os.environ, "PYTHONPATH": str(target)}

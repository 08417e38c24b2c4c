"""Kernels stay within the memory of their arrays: they write by address."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).with_name("guarded_memory.py")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="pages are protected as Linux does it")
@pytest.mark.parametrize("side", ["low", "high"])
def test_nothing_is_touched_beside_an_array(side: str) -> None:
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", PROGRAM, side], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr

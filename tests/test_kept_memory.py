"""Memory of frame sets that were let go of serves those that follow."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

PAGES = """
import resource
import sys

import numpy as np
from mvcodec.decoding import kept_memory

if sys.argv[1] != "given back":
    getattr(kept_memory, sys.argv[1])()


def pages(rounds):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(rounds):
        for picture in [np.empty(1 << 20, np.uint8) for _ in range(12)]:
            picture[:] = 1
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


pages(2)
print(pages(10))
"""


def _pages(how: str) -> int:
    printed = subprocess.run(
        [sys.executable, "-c", PAGES, how], capture_output=True, text=True, check=True
    ).stdout
    return int(printed)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries keep memory as they like")
@pytest.mark.parametrize("how", ["keep_freed_memory", "keep_freed_memory_of_a_server"])
def test_pictures_that_follow_each_other_take_no_fresh_pages(how: str) -> None:
    kept, given_back = _pages(how), _pages("given back")
    assert kept < given_back / 10, f"{kept} pages, and {given_back} where memory is given back"

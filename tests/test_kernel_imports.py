"""Kernels' modules are imported where they are first needed: by several threads at once, too."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import mvcodec

KERNELS = Path(mvcodec.__file__).parent / "kernels"
NAMES = sorted(path.stem for path in KERNELS.glob("[a-z]*.py") if path.stem != "compiled_code")
"""All but the one that the package itself imports, whose names are taken from the package."""

PROGRAM = """
import importlib, sys, threading, time

def load(name, wait):
    time.sleep(wait)
    try:
        importlib.import_module(f"mvcodec.kernels.{name}")
    except Exception as error:
        failed.append(f"{name}: {error!r}")

failed, apart, names = [], float(sys.argv[1]), sys.argv[2:]
threads = [threading.Thread(target=load, args=(name, number * apart)) for number, name in enumerate(names)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(failed)
"""


@pytest.mark.parametrize("apart_s", [0, 0.02])
@pytest.mark.parametrize("names", [NAMES, NAMES[::-1], ["growth", "byte_vectors", "view_vectors"]])
def test_threads_that_import_at_once_do_not_disturb_each_other(names: list[str], apart_s: float) -> None:
    command = [sys.executable, "-c", PROGRAM, str(apart_s), *names]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
    assert done.stdout == "[]\n"

"""Loads compiled code beside what a command begins with."""

from __future__ import annotations

import threading

import numpy as np


def load_kernels_beside() -> None:
    """Begin to load Numba and a first kernel, in a thread of its own.

    That takes most of a second, which passes while pictures are read and looked at. Whoever needs a kernel
    before waits for it. The program ends after it, since half-loaded libraries end badly.
    """
    threading.Thread(target=_load, name="kernels").start()


def _load() -> None:
    from mvcodec.kernels.rival_matches import window_sums

    grey = np.zeros((8, 8), np.uint8)
    window_sums(grey, grey, np.empty((8, 8), np.int32))

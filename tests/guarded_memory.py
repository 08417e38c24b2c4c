"""A program for Linux: what matches and renders, on arrays between pages that nobody may touch.

Kernels load and store sixteen pixels at a time by address. One that goes beyond an array ends this process at
once, where elsewhere it spoils what happens to lie there, and the process dies much later or never.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from mmap import PAGESIZE
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Calibration, CameraArray, Viewpoint
from mvcodec.decoding.derived_maps import derive_map
from mvcodec.frames import DecodedSet, DisparityMap
from mvcodec.layers.refinement import make_matcher
from mvcodec.synthesis.synthesizers import make_synthesizer
from mvcodec.video.codec import Planes
from mvcodec.video.past import ALL, MOST_SHARE, Past

READ_WRITE, PRIVATE_ANONYMOUS = 3, 0x22
SIZES = ((1, 1), (17, 5), (16, 16), (33, 2), (75, 46))

libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
libc.mprotect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]


def between_pages(shape: tuple[int, ...], dtype: Any, *, low: bool) -> NDArray[Any]:
    """An array that begins (`low`) or ends at a page that nobody may touch; never given back."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    pages = -(-size // PAGESIZE)
    first = libc.mmap(None, (pages + 2) * PAGESIZE, READ_WRITE, PRIVATE_ANONYMOUS, -1, 0)
    libc.mprotect(first, PAGESIZE, 0)
    libc.mprotect(first + (pages + 1) * PAGESIZE, PAGESIZE, 0)
    start = first + PAGESIZE + (0 if low else pages * PAGESIZE - size)
    return np.frombuffer((ctypes.c_char * size).from_address(start), dtype).reshape(shape)


def guard(*, low: bool) -> None:
    """Make NumPy's arrays so, for all that is called by this program."""

    def copied(make: Callable[..., Any]) -> Callable[..., Any]:
        def made(*arguments: Any, **options: Any) -> Any:
            found = make(*arguments, **options)
            if found.dtype.hasobject or not found.size:
                return found
            array = between_pages(found.shape, found.dtype, low=low)
            array[...] = found
            return array

        return made

    for name in ("empty", "zeros", "full", "stack", "pad", "ascontiguousarray"):
        setattr(np, name, copied(getattr(np, name)))


def work(width: int, height: int) -> None:
    """Match a frame set of noise, derive a map, render views."""
    rng = np.random.default_rng(width)
    pinhole = Calibration(width, width, 0, 0, 0.1)
    array = CameraArray(2, 2, width, height, 1, (0, 1), (0, 1), pinhole)
    pictures = {
        place: np.ascontiguousarray(rng.integers(0, 256, (height, width, 3)).astype(np.uint8))
        for place in array.real
    }
    range_px = (-3.0, 9.0)
    for name in ("joint", "balanced", "realtime"):
        maps = make_matcher(name).match(array, pictures, range_px)
    known = {
        place: DisparityMap(np.ascontiguousarray(each.values_px), each.valid) for place, each in maps.items()
    }
    derive_map(array, {(0, 0): known[0, 0], (1, 1): known[1, 1]}, range_px, (0, 1))
    decoded = DecodedSet(array, 0, 0, pictures, known, range_px)
    for name in ("layered", "quick"):
        for row, col in ((0, 0), (0.3, 0.7), (1, 0.5)):
            make_synthesizer(name).render(decoded, Viewpoint(row, col))


def mix(width: int, height: int) -> None:
    """Mix predictions with pasts that have moved as far as is looked for, and with others."""
    rng = np.random.default_rng(height)
    noise = rng.integers(0, 256, (2 * height, 2 * width), dtype=np.uint8)
    chroma = np.ascontiguousarray(noise[:height, :width])
    for step in ((24, 24), (-24, 24), (24, -24), (-24, -24), (7, 90)):
        past = np.ascontiguousarray(np.roll(noise, step, (0, 1)))
        found = Past(Planes(noise, chroma, chroma), Planes(past, chroma, chroma))
        for share in range(1, MOST_SHARE + 1):
            found.blended(share)
        found.luma(ALL)


if __name__ == "__main__":
    guard(low=sys.argv[1] == "low")
    for size in SIZES:
        work(*size)
        mix(*size)

"""Matching done once for all codings of an input: it depends on pictures and range, on no quantiser."""

from __future__ import annotations

import hashlib
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from mvcodec.array import CameraArray, Position
from mvcodec.closing import Closing
from mvcodec.errors import OutputError
from mvcodec.frames import DisparityMap, Picture
from mvcodec.stereo.matcher import Matcher


@dataclass(frozen=True, slots=True)
class _Entry:
    """Maps in the file: where they begin, which cameras they belong to, seconds that they took."""

    offset: int
    cameras: tuple[Position, ...]
    shape: tuple[int, int]
    seconds: float


class MapSpool(Closing):
    """Maps as one matcher found them, bit for bit, in a temporary file that goes with the spool.

    Memory holds an index alone; the file takes 33 bits for each pixel of each map.

    Args:
        folder: where the file is made when the first maps come; exists by then.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: IO[bytes] | None = None
        self._entries: dict[bytes, _Entry] = {}

    def keep(self, key: bytes, maps: Mapping[Position, DisparityMap], seconds: float) -> None:
        """Append the maps of all cameras, of one shape, and the seconds that they took.

        Raises:
            OutputError: the system refuses.
        """
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(dir=self._folder)  # noqa: SIM115 - `close` is ours
            offset = self._file.seek(0, 2)
            for found in maps.values():
                self._file.write(np.ascontiguousarray(found.values_px, np.float32).data)
                self._file.write(np.packbits(found.valid).data)
        except OSError as error:
            raise OutputError(self._folder, error.strerror or error) from None
        height, width = next(iter(maps.values())).values_px.shape
        self._entries[key] = _Entry(offset, tuple(maps), (height, width), seconds)

    def find(self, key: bytes) -> tuple[dict[Position, DisparityMap], float] | None:
        """The maps kept under a key, and the seconds that they took; None where there are none."""
        entry = self._entries.get(key)
        if entry is None or self._file is None:
            return None
        self._file.seek(entry.offset)
        return {camera: _read_map(self._file, entry.shape) for camera in entry.cameras}, entry.seconds

    def close(self) -> None:
        """Forget all."""
        self._entries.clear()
        if self._file is not None:
            self._file.close()
            self._file = None


class Remembered:
    """A `Matcher` that leaves to another one what the spool does not hold yet.

    Args:
        matcher: always the same one for one spool.

    Attributes:
        seconds: wall-clock seconds of matching for all that was asked: as measured when the maps were
            made, by this object or by one before it.
        spared_seconds: the part of them that was not spent this time, less what looking up took.
    """

    def __init__(self, matcher: Matcher, spool: MapSpool) -> None:
        self._matcher, self._spool = matcher, spool
        self.seconds = self.spared_seconds = 0.0

    def match(
        self, array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]
    ) -> dict[Position, DisparityMap]:
        """See `Matcher`."""
        started = time.perf_counter()
        key = _key(array, pictures, range_px)
        kept = self._spool.find(key)
        if kept is not None:
            maps, seconds = kept
            self.spared_seconds += seconds - (time.perf_counter() - started)
        else:
            started = time.perf_counter()
            maps = self._matcher.match(array, pictures, range_px)
            seconds = time.perf_counter() - started
            self._spool.keep(key, maps, seconds)
        self.seconds += seconds
        return maps


def _key(array: CameraArray, pictures: Mapping[Position, Picture], range_px: tuple[float, float]) -> bytes:
    digest = hashlib.blake2b(repr((array, range_px)).encode(), digest_size=16)
    for camera in array.real:
        digest.update(np.ascontiguousarray(pictures[camera]).data)
    return digest.digest()


def _read_map(file: IO[bytes], shape: tuple[int, int]) -> DisparityMap:
    pixels = shape[0] * shape[1]
    values = np.frombuffer(file.read(4 * pixels), np.float32).reshape(shape)
    packed = np.frombuffer(file.read(-(-pixels // 8)), np.uint8)
    return DisparityMap(values, np.unpackbits(packed, count=pixels).astype(np.bool_).reshape(shape))

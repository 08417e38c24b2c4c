"""Ground-truth disparity in: 8- and 16-bit PNG or PGM, and PFM."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mvcodec.capture.picture_files import read_grey
from mvcodec.errors import InputError
from mvcodec.frames import DisparityMap, FloatMap

# Magic, width, height and scale, each ended by white space, exactly one character after the last.
_PFM_HEADER = re.compile(rb"(P[Ff])\s+(\d+)\s+(\d+)\s+([-+.\deE]+)\s")


@dataclass(frozen=True, slots=True)
class TruthFiles:
    """The truth of one view, as `array.json` states it.

    Attributes:
        folder: what the names are relative to.
        names: one file for each frame, a single one for all of them, or one pattern with {frame}.
        scale: ``disparity_px = value / scale``.
        invalid: the value that means unknown, or None.
        steps: signed grid steps of the baseline that the values belong to; not 0.
    """

    folder: Path
    names: tuple[str, ...]
    scale: float = 1.0
    invalid: float | None = None
    steps: int = 1

    def path(self, frame: int) -> Path:
        """The file of one frame."""
        if len(self.names) > 1:
            return self.folder / self.names[frame]
        return self.folder / (self.names[0].format(frame=frame) if "{" in self.names[0] else self.names[0])

    def read(self, frame: int, size: tuple[int, int]) -> DisparityMap:
        """The map of one frame in px for one grid step, 0 and invalid where unknown.

        Raises:
            InputError: missing, unreadable or not of `size` (width, height).
        """
        path = self.path(frame)
        values = read_map(path)
        height, width = values.shape
        if (width, height) != size:
            raise InputError(
                path, f"{width}x{height} px", f"{size[0]}x{size[1]} px as the pictures of its view"
            )
        valid = np.isfinite(values)
        if self.invalid is not None:
            valid &= values != np.float32(self.invalid)
        per_step = np.where(valid, values, 0) / (self.scale * abs(self.steps))
        return DisparityMap(per_step.astype(np.float32), valid)


def read_map(path: Path) -> FloatMap:
    """Read a one-channel map as float32 (H, W), values as stored.

    Raises:
        InputError: missing, unreadable, or with more than one channel.
    """
    if path.suffix.lower() == ".pfm":
        return read_pfm(path)
    return read_grey(path).astype(np.float32)


def read_pfm(path: Path) -> FloatMap:
    """Read a Portable Float Map (rows bottom-up on disk) as float32 (H, W), top row first.

    Raises:
        InputError: missing, truncated, in colour, or no PFM.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(path, error.strerror or "an unreadable file", "a disparity map") from None
    header = _PFM_HEADER.match(data)
    if header is None:
        raise InputError(path, "no PFM header", "a PFM file: Pf, width, height, scale")
    if header[1] == b"PF":
        raise InputError(path, "a PFM of three channels", "a disparity map of one channel")
    width, height = int(header[2]), int(header[3])
    body = memoryview(data)[header.end() :]
    if len(body) != 4 * width * height or not width * height:
        raise InputError(
            path, f"{len(body)} bytes of pixels", f"{4 * width * height} for {width}x{height} px"
        )
    order = "<f4" if header[4].startswith(b"-") else ">f4"
    rows = np.frombuffer(body, order).reshape(height, width)[::-1]
    return np.ascontiguousarray(rows, np.float32)

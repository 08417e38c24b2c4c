"""Small video files whose pictures show their number, at any times, as cameras and recorders write them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from mvcodec.frames import Picture

SIZE = (64, 48)
"""(width, height) px."""

_BITS = 6


def numbered(number: int, col: int = 0) -> Picture:
    """A picture with texture, seen `col` steps to the right, and its number in six squares on top."""
    x, y = np.meshgrid(np.arange(SIZE[0]) + 2.0 * col, np.arange(SIZE[1]))
    grey = 110 + 50 * np.sin(x * 0.55 + 3 * np.sin(y * 0.31)) + 45 * np.sin(y * 0.47 + x * 0.13)
    grey[:8] = np.repeat([235 if number >> bit & 1 else 16 for bit in range(8)], 8)[None, :]
    return np.repeat(grey[..., None], 3, axis=2).round().clip(0, 255).astype(np.uint8)


def number_of(picture: Picture) -> int:
    """The number that a picture shows."""
    return sum(1 << bit for bit in range(_BITS) if picture[2:6, bit * 8 + 2 : bit * 8 + 6].mean() > 128)


def write_video(
    path: Path,
    numbers: Iterable[int],
    times_ms: Sequence[int] | None = None,
    *,
    col: int = 0,
    fps: Fraction | int = 30,
    form: str | None = None,
    **options: str,
) -> Path:
    """One H.264 file of the pictures of these numbers, at these times or at `fps`."""
    pictures = (numbered(number, col) for number in numbers)
    return write_frames(path, pictures, times_ms, fps=fps, form=form, **options)


def write_frames(
    path: Path,
    pictures: Iterable[Picture],
    times_ms: Sequence[int] | None = None,
    *,
    fps: Fraction | int = 30,
    form: str | None = None,
    **options: str,
) -> Path:
    """One H.264 file of pictures, at these times or at `fps`."""
    base = Fraction(1, 1000) if times_ms is not None else 1 / Fraction(fps)
    with av.open(str(path), "w", format=form) as out:
        settings = {"crf": "16", "preset": "ultrafast", "bf": "0"} | options
        stream = out.add_stream("libx264", rate=Fraction(fps), options=settings)
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = base
        for index, picture in enumerate(pictures):
            if index == 0:
                stream.width, stream.height = picture.shape[1], picture.shape[0]
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = index if times_ms is None else times_ms[index], base
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path

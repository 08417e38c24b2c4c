"""Small array folders and video files for the tests of what comes in."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

import av
import cv2
import numpy as np
from av.video.frame import VideoFrame
from numpy.typing import NDArray

from mvcodec.array import Position
from mvcodec.frames import Picture

_T = TypeVar("_T")


def picture_of(position: Position, frame: int, size: tuple[int, int] = (24, 16)) -> Picture:
    """A picture whose colour tells its view and frame."""
    row, col = position
    pixels = np.zeros((size[1], size[0], 3), np.uint8)
    pixels[..., 0], pixels[..., 1], pixels[..., 2] = 40 * row, 40 * col, 10 * frame
    pixels[0, 0] = 255
    return pixels


def save(path: Path, picture: NDArray[Any]) -> None:
    """Write a picture (RGB or grey) with OpenCV, in the format of its suffix."""
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), picture[..., ::-1] if picture.ndim == 3 else picture)


def make_folder(
    folder: Path, rows: int = 2, cols: int = 3, frames: int = 2, changes: dict[str, Any] | None = None
) -> Path:
    """An array folder of PNG pictures with a list of them; `changes` go into array.json (None: out)."""
    views: list[list[list[str]]] = []
    for row in range(rows):
        views.append([])
        for col in range(cols):
            names = [f"cam/{row}{col}_{frame}.png" for frame in range(frames)]
            for frame, name in enumerate(names):
                save(folder / name, picture_of((row, col), frame))
            views[-1].append(names)
    document: dict[str, Any] = {"name": "small", "rows": rows, "cols": cols, "fps": 10.0, "views": views}
    return rewrite(folder, document | (changes or {}))


def rewrite(folder: Path, document: dict[str, Any]) -> Path:
    """Write array.json without the keys that are None."""
    folder.mkdir(parents=True, exist_ok=True)
    kept = {key: value for key, value in document.items() if value is not None}
    (folder / "array.json").write_text(json.dumps(kept))
    return folder


def save_planes(
    path: Path, planes: list[NDArray[np.uint8]], *, matrix: int = 2, full: bool = False, fps: float = 25.0
) -> None:
    """Write yuv444p frames (each uint8 (3, H, W)) losslessly, with the given tags.

    Args:
        path: a .mkv file.
        planes: the frames.
        matrix: H.273 code, 1 = BT.709, 6 = BT.601, 2 = unspecified.
        full: full range, else limited.
        fps: frames a second.
    """
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=Fraction(fps).limit_denominator(1001))
        stream.height, stream.width = planes[0].shape[1:]
        stream.pix_fmt = "yuv444p"
        stream.codec_context.colorspace = matrix
        stream.codec_context.color_range = 2 if full else 1
        for yuv in planes:
            frame = VideoFrame.from_ndarray(yuv, "yuv444p")
            frame.colorspace, frame.color_range = matrix, 2 if full else 1
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def files_in(folder: Path) -> set[str]:
    """Every file below a folder, relative to it."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


class Broken(Exception):
    """Stands for anything that goes wrong inside a `with` block."""


def break_off(context: AbstractContextManager[_T], act: Callable[[_T], object]) -> None:
    """Enter, act, and fail with Broken."""
    with context as entered:
        act(entered)
        raise Broken

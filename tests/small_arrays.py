"""A small array on disk: a photograph before which a nearer piece of another one moves."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from skimage import data

from mvcodec.array import Position
from mvcodec.frames import Picture
from mvcodec.output.array_folder import ArrayFacts, ArrayFolderWriter

WIDTH, HEIGHT = 96, 64
FAR_PX, NEAR_PX = 1, 3
"""Disparity per grid step."""


@cache
def photograph(name: str) -> Picture:
    """A photograph that scikit-image ships."""
    return np.asarray(getattr(data, name)(), np.uint8)


def picture(view: Position, frame: int, width: int = WIDTH, height: int = HEIGHT) -> Picture:
    """uint8 (height, width, 3): what a view of the array sees, exact at whole pixels."""
    row, col = view
    background = photograph("coffee")
    top, left = 100 + FAR_PX * row, 150 + FAR_PX * col
    seen = background[top : top + height, left : left + width].copy()
    patch = photograph("chelsea")[100:124, 150:180]
    top, left = 24 - NEAR_PX * row, 40 - NEAR_PX * col + 2 * (frame % 10)
    seen[top : top + 24, left : left + 30] = patch
    return seen


def write_array(folder: Path, rows: int = 3, cols: int = 3, frames: int = 4, **facts: object) -> Path:
    """Write an array folder; `facts` as in ArrayFacts."""
    stated = ArrayFacts(rows, cols, fps=10.0, **facts)  # type: ignore[arg-type]
    views = [(row, col) for row in range(rows) for col in range(cols)]
    with ArrayFolderWriter(folder, stated) as writer:
        for frame in range(frames):
            writer.push({view: picture(view, frame) for view in views})
    return folder

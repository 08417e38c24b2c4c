"""`mvcodec.encode`: pictures in memory -> one file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mvcodec.array import Calibration, CameraArray, Position
from mvcodec.capture.selection import select_real
from mvcodec.container import McapWriter, StreamInfo, read_info
from mvcodec.depth import require_calibration
from mvcodec.encoding.config import EncoderConfig
from mvcodec.encoding.encoder import Encoder
from mvcodec.errors import InputError, SettingError
from mvcodec.frames import FrameSet, Picture

SUFFIX = ".mcap"
DEFAULT_FPS = 30.0

ViewPictures = NDArray[np.uint8] | Mapping[Position, Picture]
"""The views of one time: uint8 (R, C, H, W, 3) RGB, or (row, col) -> uint8 (H, W, 3) RGB."""


def encode(
    frames: Iterable[ViewPictures],
    output: str | os.PathLike[str],
    *,
    fps: float = DEFAULT_FPS,
    real: str = "all",
    calibration: Calibration | None = None,
    rho: float = 1.0,
    name: str = "",
    config: EncoderConfig | None = None,
    **settings: Any,
) -> StreamInfo:
    """Code a sequence of frame sets into a file.

    Args:
        frames: one item for each time: uint8 (R, C, H, W, 3) RGB, or a mapping (row, col) -> uint8 (H, W, 3).
            All have the views and the size of the first one. They are taken one by one, never all at once.
        output: path of the file, which ends in ``.mcap``.
        fps: frame sets a second.
        real: which views are coded, the others being left out: ``all``, ``corners``, ``every:K`` or
            ``R,R..xC,C..``. Of a mapping the first and the last row and column must be there.
        calibration: of the cameras; None: nominal values, with which nothing is metric.
        rho: (vertical step * fy) / (horizontal step * fx) of the grid.
        name: of the scene, for the record.
        config: settings of the encoder.
        settings: single settings of the encoder, such as ``qp=22`` or ``matcher="sgbm"``, in place of those
            in `config`.

    Returns:
        What the file holds.

    Raises:
        InputError: no frame set, or one of another form or size than expected; it is named by its number.
        SettingError: a setting is unknown or outside its range, or does not fit the array.
        OutputError: the system refuses to write.

    Whatever is raised, by the iterable too, the frame sets before it are in the file, which is a proper
    one; where there are none, there is no file.
    """
    path = Path(output)
    if path.suffix.lower() != SUFFIX:
        raise SettingError("output", path, f"a file name that ends in {SUFFIX}")
    chosen = _config(config, settings)
    numbered = enumerate(frames)
    first = next(numbered, None)
    if first is None:
        raise InputError("frames", "no frame set", "at least one")
    array = _array(_views(*first), fps, real, calibration, rho, name)
    if chosen.depth:
        require_calibration(array, nominal=False)
    with McapWriter(path) as writer, Encoder(array, chosen) as encoder:
        try:
            for frame_set in _frame_sets(array, chain([first], numbered)):
                writer.push(encoder.push(frame_set))
        except BaseException as error:
            if writer.frame_count:
                error.add_note(f"{path} holds the {writer.frame_count} frame sets before that")
            raise
    return read_info(path)


def _config(config: EncoderConfig | None, settings: Mapping[str, Any]) -> EncoderConfig:
    try:
        return replace(config or EncoderConfig(), **settings)
    except TypeError:
        known = EncoderConfig.names()
        (unknown, *_) = [setting for setting in settings if setting not in known]
        raise SettingError(unknown, "no such setting", f"one of {', '.join(known)}") from None


def _array(
    views: Mapping[Position, Picture],
    fps: float,
    real: str,
    calibration: Calibration | None,
    rho: float,
    name: str,
) -> CameraArray:
    rows, cols = (1 + max(place[axis] for place in views) for axis in (0, 1))
    height, width = next(iter(views.values())).shape[:2]
    if real == "all":
        real_rows, real_cols = (tuple(sorted({place[axis] for place in views})) for axis in (0, 1))
    else:
        real_rows, real_cols = select_real(real, rows, cols)
    try:
        return CameraArray(
            rows=rows,
            cols=cols,
            width=width,
            height=height,
            fps=fps,
            real_rows=real_rows,
            real_cols=real_cols,
            calibration=calibration or Calibration.nominal(width, height),
            rho=rho,
            name=name,
        )
    except SettingError as error:
        raise SettingError(error.setting.removeprefix("array."), error.found, error.expected) from None


def _frame_sets(array: CameraArray, frames: Iterator[tuple[int, ViewPictures]]) -> Iterator[FrameSet]:
    for number, views in frames:
        pictures = _views(number, views)
        yield FrameSet(number, round(number * 1e9 / array.fps), pictures)


def _views(number: int, views: ViewPictures) -> Mapping[Position, Picture]:
    """The pictures by place; their sizes are the encoder's business."""
    where = f"frame {number}"
    if isinstance(views, Mapping):
        if not views or not all(_is_place(place) for place in views):
            raise InputError(where, f"the places {list(views)[:4]}", "(row, col) -> picture, from (0, 0) on")
        for place, picture in views.items():
            shape, kind = np.shape(picture), getattr(picture, "dtype", type(picture).__name__)
            if len(shape) != 3 or shape[2] != 3 or kind != np.uint8:
                found = f"a picture of shape {shape}, {kind}"
                raise InputError(f"{where}, view {place}", found, "uint8 (H, W, 3), RGB")
        return views
    shape, kind = np.shape(views), getattr(views, "dtype", type(views).__name__)
    if len(shape) != 5 or shape[4] != 3 or kind != np.uint8 or 0 in shape:
        found = f"an array of shape {shape}, {kind}"
        raise InputError(where, found, "uint8 (R, C, H, W, 3), RGB, or (row, col) -> picture")
    rows, cols = shape[:2]
    return {(row, col): views[row, col] for row in range(rows) for col in range(cols)}


def _is_place(place: object) -> bool:
    return (
        isinstance(place, tuple)
        and len(place) == 2
        and all(isinstance(step, int | np.integer) and step >= 0 for step in place)
    )

"""Disparity or depth that an array folder already has: `disparity` and `depth` of `array.json`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from mvcodec.array import MAX_GRID_SIDE, CameraArray, Position
from mvcodec.capture.file_patterns import pattern_files, pattern_names
from mvcodec.capture.truth import read_map
from mvcodec.errors import InputError
from mvcodec.fields import Fields
from mvcodec.frames import DisparityMap, FloatMap, Mask

_KINDS = ("disparity", "depth")


@dataclass(frozen=True, slots=True)
class GivenFiles:
    """The maps of an array's views.

    Attributes:
        kind: what the values are: disparity for `steps` grid steps in px of the pictures, or depth in m.
        files: of each view one for each of its pictures, or one for all.
        scale: the quantity is value / scale.
        invalid: the value that means unknown, besides those that are not finite; None: none does.
        steps: grid steps of the baseline that disparity belongs to.
    """

    kind: Literal["disparity", "depth"]
    files: Mapping[Position, tuple[Path, ...] | Path]
    scale: float
    invalid: float | None
    steps: int = 1

    def read(self, view: Position, number: int, array: CameraArray) -> DisparityMap:
        """The map of a view's picture, px of the picture for the baseline of one cell.

        It may be smaller than the picture, in the same proportion. Where unknown it is 0 and invalid.

        Raises:
            InputError: missing, unreadable, or of another shape.
        """
        files = self.files[view]
        path = files if isinstance(files, Path) else files[number]
        values = read_map(path)
        check_map_size(values, array, path)
        unknown = None if self.invalid is None else values == np.float32(self.invalid)
        if self.kind == "depth":
            return disparity_of_depth(values / self.scale, array, unknown)
        valid = np.isfinite(values) if unknown is None else np.isfinite(values) & ~unknown
        px = np.where(valid, values, 0) / self.scale / abs(self.steps) * array.baseline_steps
        return DisparityMap(px.astype(np.float32), valid)


def check_map_size(values: FloatMap, array: CameraArray, source: str | Path) -> None:
    """A map must be of its picture's size, or smaller in the same proportion.

    Raises:
        InputError: it isn't; names `source`.
    """
    height, width = values.shape
    fits = abs(width * array.height - height * array.width) <= max(array.width, array.height)
    if not (fits and width <= array.width and height <= array.height):
        expected = f"{array.width}x{array.height} px as the pictures, or smaller in proportion"
        raise InputError(source, f"{width}x{height} px", expected)


def disparity_of_depth(depth_m: FloatMap, array: CameraArray, unknown: Mask | None = None) -> DisparityMap:
    """Disparity, px of a cell's baseline, of depth in metres: by the calibration, ALGORITHMS 0.

    Args:
        unknown: where it is besides where depth is not finite or not above 0.
    """
    valid = np.isfinite(depth_m) & (depth_m > 0)
    if unknown is not None:
        valid &= ~unknown
    calibration = array.calibration
    focal_px = calibration.fx_px if array.cols > 1 else calibration.fy_px
    per_step = focal_px * calibration.baseline_m / np.where(valid, depth_m, 1) + calibration.d_inf_px_per_step
    return DisparityMap(np.where(valid, per_step * array.baseline_steps, 0).astype(np.float32), valid)


class GivenOfFrame(Mapping[Position, DisparityMap]):
    """The maps of one frame set, read when they are asked for."""

    def __init__(self, files: GivenFiles, numbers: Mapping[Position, int], array: CameraArray) -> None:
        self._files, self._numbers, self._array = files, numbers, array

    def __getitem__(self, view: Position) -> DisparityMap:
        return self._files.read(view, self._numbers[view], self._array)

    def __iter__(self) -> Iterator[Position]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)


def read_given(fields: Fields, rows: int, cols: int) -> GivenFiles | None:
    """What `array.json` says of given maps; None where it says nothing.

    Raises:
        InputError: a field is missing or wrong, or there are both disparity and depth.
    """
    kinds = [kind for kind in _KINDS if kind in fields]
    if not kinds:
        return None
    if len(kinds) > 1:
        raise InputError(fields.source, "both disparity and depth", "one of them")
    inner = fields.inner(kinds[0])
    pattern = inner.text("pattern")
    names = pattern_names(inner, "pattern", pattern, {"row", "col", "frame"})
    frames = fields.integer("frames", 1, 10_000_000) if "frame" in names else None
    steps = inner.integer("steps", -MAX_GRID_SIDE, MAX_GRID_SIDE, 1)
    if steps == 0:
        raise inner.wrong("steps", steps, "a number of grid steps, not 0")
    return GivenFiles(
        kind="disparity" if kinds[0] == "disparity" else "depth",
        files=pattern_files(Path(fields.source), pattern, names, rows, cols, frames),
        scale=inner.number("scale", 1.0, positive=True),
        invalid=inner.number("invalid") if inner.values.get("invalid") is not None else None,
        steps=steps,
    )

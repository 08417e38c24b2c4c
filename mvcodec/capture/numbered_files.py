"""Which view and frame a file is, by the numbers in its name; for folders that have no array.json yet."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from mvcodec.array import Position
from mvcodec.errors import InputError, MvCodecWarning, SettingError

PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".ppm", ".pgm", ".bmp", ".tif", ".tiff")
VIDEO_SUFFIXES = (".mp4", ".mkv", ".mov", ".avi", ".webm", ".m4v", ".ts", ".h264", ".hevc", ".y4m")

_NUMBER = re.compile(r"\d+")
_ROW_AND_COLUMN = re.compile(r"(?i)(?<![a-z])r(?:ow)?_?(\d+)[_-]?c(?:ol)?_?(\d+)")

_SPARSE = 3
"""Numbers that count frames are not that much more than frames; times are."""

Numbers = tuple[int, ...]

NUMBERED = (
    "names that differ in their numbers only; files of other names are read as they are named, in row order,"
    " with `grid` RxC and no array.json"
)


@dataclass(frozen=True, slots=True)
class FoundViews:
    """The files of a folder by view.

    Attributes:
        rows, cols: the grid.
        files: names relative to the folder, of each view its frames in order, or its one video file.
        videos: whether they are video files.
    """

    rows: int
    cols: int
    files: Mapping[Position, tuple[str, ...]]
    videos: bool


def find_views(folder: Path, grid: tuple[int, int] | None = None) -> FoundViews:
    """Sort the pictures or videos in a folder, or in folders right below it, into views and frames.

    Numbers may begin anywhere, with or without leading zeros; their order counts. Names have a row and a
    column (``r0_c1``, or two numbers), or one number that counts cameras in row order; pictures then have
    the frame's number, last.

    Args:
        grid: (rows, cols); needed where names have one number for the camera.

    Raises:
        InputError: no such files, files that are named differently, or one that is missing in a view.
        SettingError: `grid` is needed, or another one than that of the names.
    """
    names, videos = _listed(folder)
    keys = _keys(folder, names)
    axes = len(next(iter(keys)))
    expected = axes - (0 if videos or _one_frame(axes, grid, keys) else 1)
    cameras: dict[Numbers, list[tuple[Numbers, str]]] = {}
    for key, name in sorted(keys.items()):
        cameras.setdefault(key[:expected], []).append((key[expected:], name))
    rows, cols = _grid_of(folder, list(cameras), grid)
    places = dict(zip(product(range(rows), range(cols)), sorted(cameras), strict=True))
    files = {view: tuple(name for _, name in cameras[key]) for view, key in places.items()}
    counts = {view: len(names) for view, names in files.items()}
    for view, count in counts.items():
        if count != counts[0, 0] or (videos and count != 1):
            found = f"{count} files for view {view[0]},{view[1]}, such as {files[view][0]}"
            raise InputError(folder, found, f"{1 if videos else counts[0, 0]} as for view 0,0")
    if not videos:
        frames = {view: [number for number, _ in cameras[key]] for view, key in places.items()}
        _check_counters(folder, frames)
    return FoundViews(rows, cols, files, videos)


def _check_counters(folder: Path, frames: Mapping[Position, Sequence[Numbers]]) -> None:
    """Where frames are counted, all views must lack the same ones: others would be of different moments.

    Raises:
        InputError: a view lacks a frame that another one has.
    """
    counted: dict[Position, list[int]] = {}
    for view, numbers in frames.items():
        found = [number[-1] for number in numbers if number]
        if not found or found[-1] - found[0] >= _SPARSE * len(found):
            return  # no frame's number, or one that is a time
        counted[view] = [number - found[0] for number in found]
    for view, own in counted.items():
        if own != counted[0, 0]:
            place = next(n for n, (a, b) in enumerate(zip(own, counted[0, 0], strict=True)) if a != b)
            raise InputError(
                folder,
                f"frames that view 0,0 or view {view[0]},{view[1]} lacks, from its number {place} on",
                "the same numbers in every view, or an array.json with times_ns",
            )
    missing = counted[0, 0][-1] + 1 - len(counted[0, 0])
    if missing:
        warnings.warn(
            f"{folder}: {missing} frames are missing between the first and the last: the others are taken as"
            " following each other; `times_ns` in array.json says when they were taken",
            MvCodecWarning,
            stacklevel=3,
        )


def _listed(folder: Path) -> tuple[list[str], bool]:
    if not folder.is_dir():
        is_there = folder.exists()
        raise InputError(folder, "a file" if is_there else "nothing there", "a folder of pictures or videos")
    try:
        paths = [path for pattern in ("*", "*/*") for path in folder.glob(pattern) if path.is_file()]
    except OSError as error:
        raise InputError(folder, error.strerror or "an unreadable folder", "a folder") from None
    for suffixes in (VIDEO_SUFFIXES, PICTURE_SUFFIXES):
        found = [path for path in paths if path.suffix.lower() in suffixes]
        if found:
            return sorted(path.relative_to(folder).as_posix() for path in found), suffixes is VIDEO_SUFFIXES
    raise InputError(folder, "no picture and no video", "some there or in folders right below")


def _keys(folder: Path, names: Sequence[str]) -> dict[Numbers, str]:
    """The numbers that tell files apart: row and column where they are named so, and what varies."""
    shapes = {_NUMBER.sub("#", name): name for name in names}
    if len(shapes) > 1:
        one, other = list(shapes.values())[:2]
        raise InputError(folder, f"{one} and {other}", NUMBERED)
    numbers = {name: tuple(map(int, _NUMBER.findall(name))) for name in names}
    named = _ROW_AND_COLUMN.search(names[0])
    kept = [] if named is None else [len(_NUMBER.findall(names[0][: named.start()])) + i for i in (0, 1)]
    varying = [
        place for place, values in enumerate(zip(*numbers.values(), strict=True)) if len(set(values)) > 1
    ]
    places = sorted({*kept, *varying}) or [0]
    keys = {tuple(values[place] for place in places): name for name, values in numbers.items() if values}
    if len(keys) != len(names):
        raise InputError(
            folder, f"{len(names)} files with {len(keys)} different numbers", "a number for each"
        )
    return keys


def _one_frame(axes: int, grid: tuple[int, int] | None, keys: Mapping[Numbers, str]) -> bool:
    """Whether pictures have no frame's number: each is a view of its own."""
    named = _ROW_AND_COLUMN.search(next(iter(keys.values()))) is not None
    if named or grid is None:
        return axes == 1 or (axes == 2 and (named or "/" not in next(iter(keys.values()))))
    return len(keys) == grid[0] * grid[1]


def _grid_of(folder: Path, cameras: Sequence[Numbers], grid: tuple[int, int] | None) -> tuple[int, int]:
    if len(cameras[0]) == 2:
        sides = tuple(len({camera[axis] for camera in cameras}) for axis in (0, 1))
        if sides[0] * sides[1] != len(cameras):
            found = f"{len(cameras)} of the {sides[0]} x {sides[1]} views that the names speak of"
            raise InputError(folder, found, "all of them")
        if grid not in (None, sides):
            raise SettingError("grid", f"{grid[0]}x{grid[1]}", f"{sides[0]}x{sides[1]} as the names say")
        return sides[0], sides[1]
    if len(cameras[0]) != 1:
        raise InputError(
            folder, f"{len(cameras[0])} numbers for each camera", "a row and a column, or one number"
        )
    if grid is None:
        raise SettingError("grid", "nothing", f"RxC for the {len(cameras)} cameras, numbered in row order")
    if grid[0] * grid[1] != len(cameras):
        raise SettingError(
            "grid", f"{grid[0]}x{grid[1]}", f"RxC with R*C = {len(cameras)}, the number of cameras"
        )
    return grid

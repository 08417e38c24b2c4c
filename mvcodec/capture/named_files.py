"""Video and picture files that the user named, one for each view or with several views in each."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

from mvcodec.array import Position
from mvcodec.capture.bit_depth import BitDepth
from mvcodec.capture.reading import Reading
from mvcodec.capture.split import quilt_layout, quilt_views, split_views
from mvcodec.capture.video_input import VideoView
from mvcodec.capture.view_array import PictureView, ViewReader, check_sizes
from mvcodec.errors import InputError, MvCodecWarning, SettingError
from mvcodec.workers import run_all

PICTURE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".ppm", ".pgm", ".bmp", ".tif", ".tiff", ".webp"})


def open_files(
    paths: Sequence[Path], name: str, grid: tuple[int, int] | None, reading: Reading
) -> tuple[tuple[int, int], dict[Position, ViewReader]]:
    """The whole grid of views and a reader for each.

    Args:
        paths: in row order.
        name: of the input, for messages.
        grid: (rows, cols) of views; None: those of a single file that holds several.

    Raises:
        SettingError: grid, split and the number of files don't fit each other.
        InputError: a file is missing, unreadable, of another size, or cannot be divided.
    """
    for path in paths:
        if path.is_dir():
            raise InputError(path, "a folder among several inputs", "video files only, or one array folder")
    quilt = quilt_layout(paths[0]) if len(paths) == 1 and reading.split is None else None
    inside = (1, quilt[0] * quilt[1]) if quilt is not None else reading.split or (1, 1)
    whole = _whole_grid(len(paths), grid, inside)
    depth = BitDepth(name, reading.bits)

    def opened(path: Path) -> ViewReader:
        is_picture = path.suffix.lower() in PICTURE_SUFFIXES
        return PictureView((path,), depth) if is_picture else VideoView(path, reading.gaps)

    readers = run_all(opened, paths)
    cols = whole[1] // inside[1]
    check_sizes(dict(zip(((n // cols, n % cols) for n in range(len(paths))), readers, strict=True)))
    if quilt is not None:
        return whole, quilt_views(readers[0], *quilt)
    if inside == (1, 1):
        return whole, {divmod(number, cols): reader for number, reader in enumerate(readers)}
    views = {}
    for number, reader in enumerate(readers):
        row, col = divmod(number, cols)
        for (inner_row, inner_col), view in split_views(reader, *inside).items():
            views[row * inside[0] + inner_row, col * inside[1] + inner_col] = view
    return whole, dict(sorted(views.items()))


def tell_notes(views: Mapping[Position, ViewReader]) -> None:
    """Warn of what is unusual about the files of views."""
    for view in views.values():
        for note in view.notes:
            warnings.warn(f"{view.path}: {note}", MvCodecWarning, stacklevel=3)


def _whole_grid(files: int, grid: tuple[int, int] | None, inside: tuple[int, int]) -> tuple[int, int]:
    if grid is None and files == 1 and inside != (1, 1):
        return inside
    if grid is None:
        of_one = "an array folder, or `split` RxC where the one file holds several views"
        raise SettingError("grid", "nothing", of_one if files == 1 else f"RxC for {files} files in row order")
    rows, cols = grid
    held = inside[0] * inside[1]
    if rows < 1 or cols < 1 or rows * cols != files * held:
        what = "the number of files" if held == 1 else f"{files} files of {inside[0]}x{inside[1]} views"
        raise SettingError("grid", f"{rows}x{cols}", f"RxC with R*C = {files * held}, {what}")
    if rows % inside[0] or cols % inside[1]:
        expected = f"rows that {inside[0]} and columns that {inside[1]} divide, as the files are split"
        raise SettingError("grid", f"{rows}x{cols}", expected)
    return grid

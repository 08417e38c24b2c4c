"""Names of files by a pattern, whose numbers begin at 0 or at 1."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Sequence
from pathlib import Path
from string import Formatter

from mvcodec.array import Position
from mvcodec.errors import MvCodecWarning
from mvcodec.fields import Fields

NUMBERS = ("row", "col", "frame")


def pattern_names(fields: Fields, key: str, pattern: str, allowed: set[str]) -> set[str]:
    """The names between braces; InputError where there are others or they can't be filled in."""
    expected = " ".join(f"{{{name}}}" for name in sorted(allowed))
    try:
        names = {name for _, name, _, _ in Formatter().parse(pattern) if name is not None}
        if names <= allowed:
            pattern.format(**dict.fromkeys(names, 0))
    except (ValueError, IndexError, KeyError) as error:
        raise fields.wrong(key, pattern, f"a pattern of {expected} ({error})") from None
    if not names <= allowed:
        raise fields.wrong(key, pattern, f"no other fields than {expected}")
    return names


def pattern_files(
    source: Path, pattern: str, names: set[str], rows: int, cols: int, frames: int | None
) -> dict[Position, tuple[Path, ...] | Path]:
    """The files of every view. Where those counted from 0 are not there, but from 1 are, these are meant.

    Args:
        source: the file that has the pattern; names are relative to its folder.
        pattern: with some of {row}, {col} and {frame} in it.
        names: which of them.
        frames: how many frames there are; None where {frame} is not in it.
    """
    begin = _begin(source, pattern, names, (rows, cols, frames or 1))

    def path(row: int, col: int, frame: int) -> Path:
        numbers = (row + begin[0], col + begin[1], frame + begin[2])
        return source.parent / pattern.format(**dict(zip(NUMBERS, numbers, strict=True)))

    return {
        (row, col): path(row, col, 0)
        if frames is None
        else tuple(path(row, col, frame) for frame in range(frames))
        for row in range(rows)
        for col in range(cols)
    }


def _begin(source: Path, pattern: str, names: set[str], counts: Sequence[int]) -> tuple[int, ...]:
    """The first row, column and frame number: 0, or 1 where only that names files that exist."""
    choices = [(0, 1) if name in names else (0,) for name in NUMBERS]
    for begin in itertools.product(*choices):
        ends = (begin, tuple(first + count - 1 for first, count in zip(begin, counts, strict=True)))
        names_there = (pattern.format(**dict(zip(NUMBERS, end, strict=True))) for end in ends)
        if all((source.parent / name).exists() for name in names_there):
            if any(begin):
                ones = " and ".join(name for name, first in zip(NUMBERS, begin, strict=True) if first)
                text = f"{source}: pattern = {pattern}: the numbers of {ones} begin at 1, as the files do"
                warnings.warn(text, MvCodecWarning, stacklevel=5)
            return begin
    return (0, 0, 0)

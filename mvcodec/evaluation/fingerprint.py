"""What measured points depend on: the input's pictures and the code. And pictures that an input repeats."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import mvcodec
from mvcodec.array import Position
from mvcodec.capture import ArraySource

PACKAGE = Path(mvcodec.__file__).parent

CHAIN = (
    *("*.py", "capture", "stereo", "layers", "video", "container", "synthesis", "kernels"),
    *(f"evaluation/{name}.py" for name in ("chain", "metrics", "quality", "remembered")),
)
"""The rooms, and files of this one, that a point of mvcodec's own curve depends on."""

ANCHORS_REVISION = 1
"""Raised with each change that gives an anchor other bits or figures from the same encoder options.

Anchors take hours where mvcodec's own points take minutes; a digest of the code would measure them
again after each change of a comment.
"""


@dataclass(frozen=True, slots=True)
class InputFacts:
    """What was found in an input.

    Attributes:
        digest: of every picture and the geometry; equal inputs have equal ones.
        repeated: groups of places (view, frame number) that hold one and the same picture.
    """

    digest: str
    repeated: tuple[tuple[tuple[Position, int], ...], ...]


def examine(source: ArraySource, chosen: range) -> InputFacts:
    """Read every picture of the chosen frames once.

    A picture that serves two views or two times would flatter a pseudo-video sequence.
    """
    places: dict[bytes, list[tuple[Position, int]]] = {}
    whole = hashlib.blake2b(repr((source.array, chosen)).encode(), digest_size=16)
    for frame_set in source.frame_sets(slice(chosen.start, chosen.stop), source.array.positions):
        for view in source.array.positions:
            picture = hashlib.blake2b(frame_set.pictures[view].tobytes(), digest_size=16).digest()
            places.setdefault(picture, []).append((view, frame_set.index))
            whole.update(picture)
    repeated = tuple(tuple(group) for group in places.values() if len(group) > 1)
    return InputFacts(whole.hexdigest(), repeated)


def code_digest(names: Iterable[str]) -> str:
    """A digest of source files of this package: files, patterns or folders, relative to it."""
    digest = hashlib.blake2b(digest_size=16)
    for name in names:
        root = PACKAGE / name
        files = root.rglob("*.py") if root.is_dir() else PACKAGE.glob(name)
        for path in sorted(files):
            digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()

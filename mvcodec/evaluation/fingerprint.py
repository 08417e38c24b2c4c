"""What measured points depend on: the input's pictures, code, libraries. And which pictures repeat."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import mvcodec
from mvcodec.array import Position
from mvcodec.capture import ArraySource
from mvcodec.video.pyav import library_versions

PACKAGE = Path(mvcodec.__file__).parent

CHAIN = (
    *(
        "*.py",
        "capture",
        "stereo",
        "layers",
        "encoding",
        "video",
        "container",
        "decoding",
        "synthesis",
        "kernels",
    ),
    *(f"evaluation/{name}.py" for name in ("chain", "metrics", "quality", "remembered")),
)
"""The rooms, and files of this one, that a point of mvcodec's own curve depends on."""

ANCHORS_REVISION = 1
"""Raised with each change that gives an anchor other bits from the same encoder options.

Anchors take hours where mvcodec's own points take minutes; a digest of all of the code would measure
them again after each change of a comment.
"""

ANCHOR_FIGURES = ("evaluation/metrics.py", "video/colour.py")
"""The files that give an anchor other figures from the same bits."""

FIRST_ANCHOR_FIGURES = "6f1446dd8db4f76adc487a702b14eb3f"
"""Their digest when points did not state it yet: such points hold as long as it is still the same."""

LIBRARIES = ("av", "mcap", "numba", "numpy", "opencv-python-headless", "zstandard")
"""Distributions that a point of mvcodec's own curve depends on, beside FFmpeg."""


@dataclass(frozen=True, slots=True)
class InputFacts:
    """What was found in an input.

    Attributes:
        digest: of every picture and the geometry; equal inputs have equal ones.
        pictures: a digest of every picture alone; arrays that differ in geometry, real cameras or name
            share it.
        repeated: groups of places (view, frame number) that hold one and the same picture.
    """

    digest: str
    pictures: str
    repeated: tuple[tuple[tuple[Position, int], ...], ...]


def examine(source: ArraySource, chosen: range) -> InputFacts:
    """Read every picture of the chosen frames once.

    A picture that serves two views or two times would flatter a pseudo-video sequence.
    """
    places: dict[bytes, list[tuple[Position, int]]] = {}
    whole = hashlib.blake2b(repr((source.array, chosen)).encode(), digest_size=16)
    pictures = hashlib.blake2b(digest_size=16)
    for frame_set in source.frame_sets(slice(chosen.start, chosen.stop), source.array.positions):
        for view in source.array.positions:
            picture = hashlib.blake2b(frame_set.pictures[view].tobytes(), digest_size=16).digest()
            places.setdefault(picture, []).append((view, frame_set.index))
            whole.update(picture)
            pictures.update(picture)
    repeated = tuple(tuple(group) for group in places.values() if len(group) > 1)
    return InputFacts(whole.hexdigest(), pictures.hexdigest(), repeated)


def code_digest(names: Iterable[str]) -> str:
    """A digest of source files of this package: files, patterns or folders, relative to it."""
    digest = hashlib.blake2b(digest_size=16)
    for name in names:
        root = PACKAGE / name
        files = root.rglob("*.py") if root.is_dir() else PACKAGE.glob(name)
        for path in sorted(files):
            digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def anchors_code() -> int | str:
    """What stands for the code that an anchor's point depends on."""
    figures = code_digest(ANCHOR_FIGURES)
    return ANCHORS_REVISION if figures == FIRST_ANCHOR_FIGURES else f"{ANCHORS_REVISION}, {figures}"


def chain_libraries() -> dict[str, str]:
    """Versions of what a point of mvcodec's own curve depends on, as installed."""
    return {**{name: importlib.metadata.version(name) for name in LIBRARIES}, **library_versions()}


def measuring_versions() -> dict[str, str]:
    """What a point is measured with: mvcodec, Python, libraries and the kind of machine."""
    own = {"mvcodec": mvcodec.__version__, "python": platform.python_version()}
    return {**own, **chain_libraries(), "machine": f"{platform.machine()}, {platform.system()}"}

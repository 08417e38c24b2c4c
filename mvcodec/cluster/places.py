"""Where inputs are and outputs go: folders of this machine, or what fsspec reaches (s3, gs, http ...)."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mvcodec.errors import InputError, MissingExtra, OutputError

EXTRA = "cluster"

_FAILURES = (OSError, ValueError, RuntimeError)
"""What file systems raise: their own words come with it."""


@dataclass(frozen=True, slots=True)
class Place:
    """A file or folder.

    Attributes:
        url: as the user wrote it; without a scheme it is a path of this machine.
    """

    url: str

    @property
    def local(self) -> Path | None:
        """The path, where it is one of this machine."""
        if "://" not in self.url:
            return Path(self.url)
        return Path(self.url.removeprefix("file://")) if self.url.startswith("file://") else None

    def __truediv__(self, name: str) -> Place:
        return Place(f"{self.url.rstrip('/')}/{name}")

    @property
    def name(self) -> str:
        """The last part."""
        return self.url.rstrip("/").rsplit("/", 1)[-1]

    def exists(self) -> bool:
        """Whether something is there.

        Raises:
            InputError: it cannot be asked.
        """
        system, path = self._system()
        with _reading(self.url):
            return bool(system.exists(path))

    def matches(self) -> list[Place]:
        """What a pattern with ``*``, ``?`` or ``[`` stands for, sorted; itself where it is none."""
        if not any(letter in self.url for letter in "*?[") or self.exists():
            return [self]
        system, path = self._system()
        with _reading(self.url):
            found = sorted(system.glob(path))
        scheme = self.url.split("://", 1)[0] + "://" if self.local is None else ""
        return [Place(scheme + str(name)) for name in found]

    def fingerprint(self) -> str:
        """Changes with what is there: names, sizes and, where the system tells them, times or digests.

        Raises:
            InputError: there is nothing.
        """
        system, path = self._system()
        with _reading(self.url):
            if not system.exists(path):
                raise InputError(self.url, "nothing there", "an input")
            names = sorted(system.find(path)) if system.isdir(path) else [path]
            facts = [_facts(system.info(name)) for name in names]
        return hashlib.blake2b(json.dumps(facts).encode(), digest_size=10).hexdigest()

    @contextmanager
    def fetched(self, folder: Path | None = None) -> Iterator[Path]:
        """The file or folder on this machine: itself, or a copy that goes with the block.

        Args:
            folder: where copies are made.

        Raises:
            InputError: there is nothing, or it cannot be read.
        """
        if self.local is not None:
            yield self.local
            return
        system, path = self._system()
        with tempfile.TemporaryDirectory(dir=folder, prefix="mvcodec-in-") as made:
            copy = Path(made) / self.name
            with _reading(self.url):
                system.get(path, str(copy), recursive=bool(system.isdir(path)))
            yield copy

    def put(self, made: Path) -> None:
        """Move a finished local file or folder here; what was here before is replaced as a whole.

        Raises:
            OutputError: the system refuses.
        """
        target = self.local
        try:
            if target is not None:
                target.parent.mkdir(parents=True, exist_ok=True)
                if target.is_dir():
                    shutil.rmtree(target)
                shutil.move(made, target)
                return
            system, path = self._system()
            if system.exists(path):
                system.rm(path, recursive=True)
            system.put(str(made), path, recursive=made.is_dir())
        except _FAILURES as error:
            raise OutputError(self.url, _words(error)) from None

    def move(self, target: Place) -> None:
        """Move a finished file or folder of the same file system; what was at `target` is replaced.

        Raises:
            OutputError: the system refuses.
        """
        if self.local is not None:
            target.put(self.local)
            return
        (system, path), (_, new) = self._system(), target._system()
        try:
            if system.exists(new):
                system.rm(new, recursive=True)
            system.mv(path, new, recursive=True)
        except _FAILURES as error:
            raise OutputError(target.url, _words(error)) from None

    def read(self) -> bytes:
        """The content of a file.

        Raises:
            InputError: there is none, or it cannot be read.
        """
        system, path = self._system()
        with _reading(self.url):
            return bytes(system.cat_file(path))

    def remove(self) -> None:
        """Remove a file or folder, if it is there.

        Raises:
            OutputError: the system refuses.
        """
        system, path = self._system()
        try:
            if system.exists(path):
                system.rm(path, recursive=True)
        except _FAILURES as error:
            raise OutputError(self.url, _words(error)) from None

    def _system(self) -> tuple[Any, str]:
        try:
            import fsspec
        except ImportError:
            raise MissingExtra("fsspec", EXTRA) from None
        try:
            system, path = fsspec.core.url_to_fs(self.url)
        except ImportError as error:  # fsspec says which package knows this kind of address
            raise InputError(self.url, str(error), "an address whose package is installed") from None
        except ValueError as error:
            raise InputError(self.url, str(error), "a path, or an address that fsspec knows") from None
        # A listing that is kept would not show what other machines have written since.
        system.invalidate_cache()
        return system, str(path)


def _facts(info: dict[str, Any]) -> list[Any]:
    told = [info.get(key) for key in ("name", "size", "mtime", "ETag", "LastModified")]
    return [value if isinstance(value, str | int | float | None) else str(value) for value in told]


@contextmanager
def _reading(url: str) -> Iterator[None]:
    try:
        yield
    except _FAILURES as error:
        raise InputError(url, _words(error), "a file or folder that can be read") from None


def _words(error: BaseException) -> str:
    words = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(words).split())

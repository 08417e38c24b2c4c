"""Every error that mvcodec raises on purpose: one tree, messages of one line.

A message names the thing, the value found and what was expected. The command line turns
`SettingError` into exit code 2 and every other `MvCodecError` into exit code 1.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path


class MvCodecError(Exception):
    """Base of all errors raised on purpose by mvcodec."""


class SettingError(MvCodecError, ValueError):
    """A setting (an option, a configuration field) has a value that is not allowed.

    Args:
        setting: name of the library's setting, such as ``qp``; the command line names its option instead.
        found: the offending value.
        expected: what would have been accepted.
    """

    def __init__(self, setting: str, found: object, expected: str) -> None:
        super().__init__(f"{setting}: found {found!s}, expected {expected}")
        self.setting, self.found, self.expected = setting, found, expected


class NoSuchFrame(SettingError, IndexError):
    """A frame set was asked for, by number or time, that is not there; `setting` is the file's name."""


class InputError(MvCodecError):
    """Something that was read (a file, a folder, a stream) is not what it must be.

    Args:
        source: path or name of what was read.
        found: what is there.
        expected: what was expected.
    """

    def __init__(self, source: str | Path, found: object, expected: str) -> None:
        super().__init__(f"{source}: found {found!s}, expected {expected}")
        self.source, self.found, self.expected = str(source), found, expected


class StreamError(InputError):
    """A coded stream (container, header or packet) is damaged or not ours.

    Args:
        topic: where in the stream, or None for the stream as a whole.
        time_ns: when in the stream, or None.
    """

    def __init__(
        self,
        source: str | Path,
        found: object,
        expected: str,
        topic: str | None = None,
        time_ns: int | None = None,
    ) -> None:
        super().__init__(source, found, expected)
        self.topic, self.time_ns = topic, time_ns


class MissingReference(StreamError):
    """A coded picture builds on one that never came; the track's next keyframe heals that."""


class OutputError(MvCodecError):
    """Something could not be written.

    Args:
        target: path of what was to be written.
        reason: why not, in the system's words.
    """

    def __init__(self, target: str | Path, reason: object) -> None:
        super().__init__(f"{target}: cannot be written: {reason!s}")
        self.target, self.reason = str(target), reason


class StreamClosed(MvCodecError):
    """`push` was called on a stage that has been flushed or closed."""


class MissingExtra(MvCodecError):
    """An optional package is not installed.

    Args:
        package: what is missing.
        extra: the extra of mvcodec that it belongs to; all packages of that are named.
    """

    def __init__(self, package: str, extra: str) -> None:
        wanted = " ".join(f"'{requirement}'" for requirement in _packages_of(extra) or (package,))
        super().__init__(f"{package} is not installed; install it with: pip install {wanted}")


def require_packages(packages: Iterable[str], extra: str) -> None:
    """Raise MissingExtra where a package of an extra is not installed."""
    from importlib.util import find_spec

    for package in packages:
        if find_spec(package) is None:
            raise MissingExtra(package, extra)


def _packages_of(extra: str) -> list[str]:
    """What an extra brings, as pip takes it: mvcodec itself may be in no index that pip knows."""
    import re  # as importlib.metadata, which takes time, for an error alone
    from importlib import metadata

    try:
        declared = metadata.requires("mvcodec") or []
    except metadata.PackageNotFoundError:
        return []
    found = [re.fullmatch(r"""(\S+?) *; *extra == ['"]([\w-]+)['"]""", line) for line in declared]
    return [match[1] for match in found if match is not None and match[2] == extra]


class MvCodecWarning(UserWarning):
    """Something that the user should know, in one line; issued with `warnings.warn`."""

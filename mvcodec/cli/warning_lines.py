"""Warnings as lines on standard error, few of each kind."""

from __future__ import annotations

import re
import sys
import warnings
from dataclasses import dataclass, field
from typing import TextIO

from mvcodec.cli.arguments import in_options
from mvcodec.closing import Closing
from mvcodec.errors import MvCodecWarning

SHOWN = 5
"""So many of one kind are shown; how many more there were is said in the end."""

_NUMBER = re.compile(r"(?<!\w)\d[\d.]*")
"""What differs between warnings of one kind: times and numbers of frames, not the names of cameras."""


@dataclass(slots=True)
class _Kind:
    texts: list[str] = field(default_factory=list)
    more: int = 0


class WarningLines(Closing):
    """Prints our warnings, each text once; counts those of one kind beyond the first few, for `close` to say.

    Python's own filter would keep every text of an endless stream.
    """

    def __init__(self) -> None:
        self._kinds: dict[str, _Kind] = {}

    def show(
        self,
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        """Stands in for `warnings.showwarning`."""
        if not issubclass(category, MvCodecWarning):
            text = warnings.formatwarning(message, category, filename, lineno, line)
            _write(text.rstrip(), file or sys.stderr)
            return
        text = in_options(" ".join(str(message).split()))
        kind = self._kinds.setdefault(_NUMBER.sub("#", text), _Kind())
        if text in kind.texts:
            return
        if len(kind.texts) == SHOWN:
            kind.more += 1
            return
        kind.texts.append(text)
        _write(f"mvcodec: warning: {text}", file or sys.stderr)

    def close(self) -> None:
        """Say how many were not shown."""
        for kind in self._kinds.values():
            if kind.more:
                _write(f"mvcodec: warning: {kind.more} more like this: {kind.texts[0]}", sys.stderr)
        self._kinds.clear()


def _write(text: str, file: TextIO) -> None:
    from tqdm import tqdm

    tqdm.write(text, file=file)

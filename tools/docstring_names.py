"""Docstrings that explain several names at once (`row, col: the place`), taken apart for the generated pages.

An extension of Griffe (see mkdocs.yml), whose sections have a name a line.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_TOGETHER = re.compile(r"^( +)([\w.*]+(?:, [\w.*]+)+)( \([^)]*\))?: (.*)$")


def taken_apart(text: str) -> str:
    """The docstring with a line for each of several names, each with the same explanation."""
    lines = text.splitlines()
    result: list[str] = []
    at = 0
    while at < len(lines):
        match = _TOGETHER.match(lines[at])
        at += 1
        if match is None:
            result.append(lines[at - 1])
            continue
        indent, names, note, explanation = match[1], match[2], match[3] or "", match[4]
        more = []
        while at < len(lines) and lines[at].startswith(f"{indent} "):
            more.append(lines[at])
            at += 1
        for name in names.split(", "):
            result += [f"{indent}{name}{note}: {explanation}", *more]
    return "\n".join(result)


class SplitNames(Extension):
    """Takes every docstring apart as it is loaded."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """What Griffe calls for each module, class, function and attribute."""
        if obj.docstring is not None:
            obj.docstring.value = taken_apart(obj.docstring.value)

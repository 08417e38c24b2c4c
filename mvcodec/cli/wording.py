"""One style for what is wrong with a command: what, found, expected; and what was probably meant."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches

from mvcodec.errors import SettingError

KINDS = {"int": "a whole number", "float": "a number"}
_CHOICE = re.compile(r"invalid choice: '(.*)' \(choose from (.*)\)$", re.DOTALL)
_KIND = re.compile(r"invalid (int|float) value: '(.*)'$", re.DOTALL)
_LISTED = re.compile(r"(?:one|some) of ([^;]+)")


def in_our_words(message: str, known: Sequence[str]) -> str:
    """A message of argparse in the form of our own errors.

    Args:
        known: options of the command, one of which an unknown one may mean.
    """
    message = re.sub(r"^argument (?:-\w, |-\w/)?", "", message).replace("with argument ", "with ")
    if choice := _CHOICE.search(message):
        found, names = choice[1], [name.strip(" '") for name in choice[2].split(",")]
        expected = f"found '{found}', expected one of {', '.join(names)}{meant(found, names)}"
        return message[: choice.start()] + expected
    if kind := _KIND.search(message):
        return f"{message[: kind.start()]}found '{kind[2]}', expected {KINDS[kind[1]]}"
    if message.startswith("unrecognized arguments: "):
        words = message.removeprefix("unrecognized arguments: ")
        return f"found {words}, which the command does not take{meant(words.split()[0], known)}"
    return message


def with_suggestion(error: SettingError) -> str:
    """The error, and what was probably meant where it lists names and does not say so itself."""
    if "did you mean" in error.expected:
        return str(error)
    listed = _LISTED.search(error.expected)
    names = re.findall(r"[\w.+-]+", listed[1]) if listed else []
    return f"{error}{meant(str(error.found), names)}"


def meant(found: str, names: Sequence[str]) -> str:
    """`; did you mean X?`, or nothing where no name is like it. Dashes that all options have say nothing."""
    plain = {name.lstrip("-"): name for name in names}
    close = [plain[name] for name in get_close_matches(found.lower().lstrip("-"), plain, 1)]
    return f"; did you mean {close[0]}?" if close and close[0] != found else ""

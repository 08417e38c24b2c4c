"""Typed access to a JSON document from outside: a wrong type names the file and the key."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from mvcodec.errors import InputError

_WORDS = {dict: "an object", list: "a list", str: "a text", bool: "true or false", type(None): "null"}
_MISSING = object()


class Fields:
    """One JSON object of a file or stream.

    Args:
        source: the file, for messages.
        values: the object.
        prefix: where in the file it is, e.g. ``calibration.``.
        error: what is raised: InputError, or StreamError for what a stream says.
    """

    def __init__(
        self,
        source: str | Path,
        values: dict[str, Any],
        prefix: str = "",
        error: type[InputError] = InputError,
    ) -> None:
        self.source, self.values, self.prefix, self._error = source, values, prefix, error

    @classmethod
    def load(cls, source: Path) -> Fields:
        """Read a JSON file that holds an object.

        Raises:
            InputError: unreadable, not UTF-8, malformed, or another kind of value.
        """
        try:
            document = json.loads(source.read_bytes().decode("utf-8"))
        except OSError as error:
            raise InputError(source, error.strerror or "an unreadable file", "a readable JSON file") from None
        except json.JSONDecodeError as error:
            where = f"line {error.lineno} column {error.colno}"
            raise InputError(source, f"malformed JSON ({error.msg} at {where})", "a JSON object") from None
        except (ValueError, RecursionError) as error:
            raise InputError(source, f"malformed JSON ({type(error).__name__})", "a JSON object") from None
        if not isinstance(document, dict):
            raise InputError(source, _described(document), "a JSON object")
        return cls(source, document)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def wrong(self, key: str, found: object, expected: str) -> InputError:
        """The error for a value of this object."""
        return self._error(self.source, f"{self.prefix}{key} = {found!s}", expected)

    def get(self, key: str, expected: str, default: object = _MISSING) -> Any:
        """Any value; InputError where it is absent and has no default."""
        if key in self.values:
            return self.values[key]
        if default is _MISSING:
            raise self._error(self.source, f"no {self.prefix}{key}", expected)
        return default

    def integer(self, key: str, low: int, high: int, default: int | None = None) -> int:
        """A whole number in low..high."""
        expected = f"a whole number {low}..{high}"
        value = self.get(key, expected, *([] if default is None else [default]))
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.wrong(key, _described(value), expected)
        return value

    def number(self, key: str, default: float | None = None, *, positive: bool = False) -> float:
        """A finite number."""
        expected = "a positive number" if positive else "a number"
        value = self.get(key, expected, *([] if default is None else [default]))
        return self.check_number(key, value, expected, positive=positive)

    def check_number(self, key: str, value: object, expected: str, *, positive: bool = False) -> float:
        """`value` as a finite float; InputError names `key` otherwise."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.wrong(key, _described(value), expected)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number) or (positive and number <= 0):
            raise self.wrong(key, _described(value), expected)
        return number

    def text(self, key: str, default: str | None = None) -> str:
        """A text."""
        value = self.get(key, "a text", *([] if default is None else [default]))
        if not isinstance(value, str):
            raise self.wrong(key, _described(value), "a text")
        return value

    def truth(self, key: str, default: bool | None = None) -> bool:
        """True or false."""
        value = self.get(key, "true or false", *([] if default is None else [default]))
        if not isinstance(value, bool):
            raise self.wrong(key, _described(value), "true or false")
        return value

    def integers(self, key: str) -> tuple[int, ...]:
        """A list of whole numbers."""
        expected = "a list of whole numbers"
        value = self.get(key, expected)
        if not isinstance(value, list):
            raise self.wrong(key, _described(value), expected)
        for item in value:
            if isinstance(item, bool) or not isinstance(item, int):
                raise self.wrong(key, f"a list with {_described(item)} in it", expected)
        return tuple(value)

    def pair(self, key: str) -> tuple[float, float]:
        """[lo, hi], two finite numbers."""
        expected = "[lo, hi], two numbers"
        value = self.get(key, expected)
        if not isinstance(value, list) or len(value) != 2:
            raise self.wrong(key, _described(value), expected)
        return self.check_number(key, value[0], expected), self.check_number(key, value[1], expected)

    def inner(self, key: str) -> Fields:
        """An object inside this one."""
        value = self.get(key, "an object")
        if not isinstance(value, dict):
            raise self.wrong(key, _described(value), "an object")
        return Fields(self.source, value, f"{self.prefix}{key}.", self._error)


def _described(value: object) -> str:
    """A value for a message: short ones as they are, others by kind."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:g}" if isinstance(value, float) else str(value)[:20]
    if isinstance(value, str) and len(value) <= 40:
        return repr(value)
    return _WORDS.get(type(value), type(value).__name__)

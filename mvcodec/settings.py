"""A setting is written once: its type, default, range and help stand on the field of a settings dataclass.

The check of the value, the option of the command line, the text form ``name:key=value`` and the lists of
`mvcodec plugins` are all read from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, dataclass, field, fields
from difflib import get_close_matches
from enum import Enum
from functools import cache
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from mvcodec.errors import SettingError

NONE_WORDS = ("none", "auto")
BOOLS = {
    "yes": True,
    "true": True,
    "on": True,
    "1": True,
    "no": False,
    "false": False,
    "off": False,
    "0": False,
}
_KEY = "mvcodec.setting"


@dataclass(frozen=True, slots=True)
class Setting:
    """What is known of one setting, apart from its value.

    Attributes:
        name: of the field.
        type: what values are instances of, `None` aside. Of a tuple, bounds and choices are each part's.
        default: None where something is chosen, if `optional`.
        help: one line without a full stop.
        low, high: the smallest and the largest value; None: no bound.
        choices: the only values; None: all within the bounds.
        expected: what would be accepted, in words; by default made from the bounds or choices.
        parse: text to value, where the type alone does not say it.
        optional: whether None is allowed.
    """

    name: str
    type: Any
    default: Any
    help: str
    low: float | None = None
    high: float | None = None
    choices: Collection[Any] | None = None
    expected: str = ""
    parse: Callable[[str], Any] | None = None
    optional: bool = False

    @property
    def allowed(self) -> str:
        """What would be accepted, in words."""
        if self.expected:
            return self.expected
        if self.type is bool:
            return "yes or no"
        choices = self._choices
        if choices is not None:
            words = [str(choice) for choice in choices]
            return " or ".join(words) if len(words) < 3 else f"one of {', '.join(words)}"
        what = "a whole number" if self.type is int else "a number" if self.type is float else "text"
        if self.low is not None and self.high is not None:
            return f"{what}, {self.low:g}..{self.high:g}"
        if self.low is not None:
            return f"{what} of at least {self.low:g}"
        return what

    @property
    def type_name(self) -> str:
        """``int``, ``float``, ``yes|no``, ``text``, as lists of settings have it."""
        return {int: "int", float: "float", bool: "yes|no"}.get(self.type, "text")

    def check(self, value: Any, name: str = "") -> None:
        """Raise SettingError, under `name` or this setting's own, where a value is not allowed."""
        if value is None and self.optional:
            return
        if not self._fits(value):
            raise SettingError(name or self.name, show(value), self.allowed)

    def read(self, text: str, name: str = "") -> Any:
        """The value that a text stands for, checked.

        Raises:
            SettingError: it stands for none that is allowed.
        """
        value = self.parsed(text, name)
        self.check(value, name)
        return value

    def parsed(self, text: str, name: str = "") -> Any:
        """The value that a text stands for, whatever it is.

        Raises:
            SettingError: it stands for none.
        """
        nothing = self.optional and text in NONE_WORDS and text not in (self._choices or ())
        return None if nothing else self.given(text, name)

    def given(self, text: str, name: str = "") -> Any:
        """As `parsed`, where nothing is said by saying nothing: no word stands for it."""
        return self._value(text, name or self.name)

    @property
    def _choices(self) -> Collection[Any] | None:
        if self.choices is not None:
            return self.choices
        return list(self.type) if isinstance(self.type, type) and issubclass(self.type, Enum) else None

    def _fits(self, value: Any) -> bool:
        if get_origin(self.type) is not tuple:
            return self._part_fits(value, self.type)
        kinds = get_args(self.type)
        if isinstance(value, tuple) and kinds[-1] is Ellipsis:
            kinds = kinds[:1] * len(value)
        return (
            isinstance(value, tuple) and len(value) == len(kinds) and all(map(self._part_fits, value, kinds))
        )

    def _part_fits(self, value: Any, kind: Any) -> bool:
        if kind is bool:
            return isinstance(value, bool)
        if kind in (int, float):
            number = isinstance(value, Integral if kind is int else Real) and not isinstance(value, bool)
            if not number or not math.isfinite(value):
                return False
        if self._choices is not None and value not in self._choices:
            return False
        return (self.low is None or value >= self.low) and (self.high is None or value <= self.high)

    def _value(self, text: str, name: str) -> Any:
        try:
            if self.parse is not None:
                return self.parse(text)
            if self.type is bool:
                return BOOLS[text.lower()]
            if self.type is object or get_origin(self.type) is Literal:
                return text
            return self.type(text)
        except (ValueError, KeyError) as error:
            if isinstance(error, SettingError):
                raise SettingError(name, error.found, error.expected) from None
            raise SettingError(name, text or "nothing", f"{self.allowed}{self._guess(text)}") from None

    def _guess(self, text: str) -> str:
        return did_you_mean(text, map(str, self._choices or ()))


def setting(
    default: Any,
    help: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: Collection[Any] | None = None,
    expected: str = "",
    parse: Callable[[str], Any] | None = None,
) -> Any:
    """A field of a settings dataclass. Arguments as the attributes of `Setting`."""
    known = {"help": help, "low": low, "high": high, "choices": choices, "expected": expected, "parse": parse}
    return field(default=default, metadata={_KEY: known})


@cache
def settings_of(cls: Any) -> Mapping[str, Setting]:
    """The settings of a dataclass by name, in the order of its fields; fields without help are none."""
    hints = get_type_hints(cls)
    found = {}
    for item in fields(cls):
        known = item.metadata.get(_KEY)
        if known is None:
            continue
        kind, optional = _without_none(hints[item.name])
        default = None if item.default is MISSING else item.default
        found[item.name] = Setting(item.name, kind, default, optional=optional, **known)
    return found


def check_settings(instance: object, prefix: str = "") -> None:
    """Raise SettingError where a field of a settings dataclass is not allowed; for ``__post_init__``.

    Args:
        prefix: before the name of a setting in the message, such as ``DilsSettings.``.
    """
    cls: Any = type(instance)
    for name, known in settings_of(cls).items():
        known.check(getattr(instance, name), prefix + name)


def show(value: Any) -> str:
    """A value as it is written in a specification: ``yes``, ``none``, ``0.5``."""
    if value is None:
        return NONE_WORDS[0]
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return ("x" if all(isinstance(part, int) for part in value) else ",").join(map(show, value))
    return str(value)


def did_you_mean(word: str, known: Any) -> str:
    """``; did you mean X?`` where a known word is close, else nothing."""
    close = get_close_matches(word.lower(), list(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def _without_none(hint: Any) -> tuple[Any, bool]:
    if get_origin(hint) in (Union, UnionType):
        kinds = [kind for kind in get_args(hint) if kind is not NoneType]
        return (kinds[0] if len(kinds) == 1 else object), NoneType in get_args(hint)
    return hint, False

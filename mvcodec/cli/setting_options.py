"""Options made from the fields of settings: name, type, range, default and help stand there alone."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from mvcodec.cli.arguments import OPTIONS, in_options
from mvcodec.errors import SettingError
from mvcodec.settings import Setting, did_you_mean, settings_of, show

AUTO = "auto"
"""Leaves a setting to the encoder, where its option's metavar names it."""
MOST_SHOWN = 5
"""How many choices stand in a usage line; more are listed in the help."""


def add_setting(
    group: argparse._ActionsContainer,
    settings: type,
    name: str,
    *,
    parse: Callable[[str], Any] | None = None,
    metavar: str | None = None,
    left_open: bool = False,
    note: str = "",
) -> None:
    """Add the option of one field of a settings dataclass; arguments as `add_option`'s."""
    known = settings_of(settings)[name]
    add_option(group, known, parse=parse, metavar=metavar, left_open=left_open, note=note)


def add_option(
    group: argparse._ActionsContainer,
    known: Setting,
    *,
    parse: Callable[[str], Any] | None = None,
    metavar: str | None = None,
    left_open: bool = False,
    note: str = "",
) -> None:
    """Add the option of one setting, which is called as `OPTIONS` says.

    Args:
        group: a parser or a group of its options; it gives the value under the setting's name.
        known: the setting.
        parse: text to value, where the command line takes other words than the library.
        metavar: what stands for the value; by default made from the choices or the type.
        left_open: what counts where the option is not given is the command's to say, in `note`.
        note: what only the command line has to say of it, before the default.
    """
    given = None if known.choices is None else [show(choice) for choice in known.choices]
    shown = given is not None and len(given) <= MOST_SHOWN
    meaning, sign, default = known.help.partition(" (default: ")
    if metavar is None and not shown and (given is not None or None not in (known.low, known.high)):
        meaning += f", {known.allowed.removeprefix('a whole number, ').removeprefix('a number, ')}"
    if left_open and "(default: " in note:
        sign = default = ""
    elif known.default is not None:
        sign, default = " (default: ", f"{show(known.default)})"
    group.add_argument(
        OPTIONS[known.name],
        dest=known.name,
        type=reader(known, parse, AUTO if parse is None and (metavar or "").endswith(f"|{AUTO}") else None),
        default=None if left_open else known.default,
        metavar=metavar or ("|".join(given or ()) if shown else _kind(known)),
        help=in_options(meaning + note + sign + default).replace("%", "%%"),
    )


def reader(
    known: Setting, parse: Callable[[str], Any] | None = None, open_word: str | None = None
) -> Callable[[str], Any]:
    """What argparse calls with the text of an option: the value, checked against the setting.

    `open_word` says the same as leaving the option away.
    """

    def read(text: str) -> Any:
        try:
            value = None if text == open_word else (parse or known.given)(text)
        except SettingError as error:
            raise argparse.ArgumentTypeError(f"found {text!r}, expected {error.expected}") from None
        try:
            if value != AUTO:  # where the library has no such word, the command does what it says
                known.check(value)
        except SettingError as error:
            guess = did_you_mean(text, map(str, known.choices or ()))
            raise argparse.ArgumentTypeError(f"found {text}, expected {error.expected}{guess}") from None
        return value

    return read


def _kind(known: Setting) -> str:
    return "N" if known.type in (int, float) else "NAME"

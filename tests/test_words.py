"""The library speaks of settings; only the command line of options."""

from __future__ import annotations

import argparse
import ast
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

import mvcodec
from mvcodec.cli.arguments import OPTIONS, as_option, in_options
from mvcodec.cli.main import COMMANDS, command_parser
from mvcodec.errors import SettingError

PACKAGE = Path(mvcodec.__file__).parent
SPEAKS_OPTIONS = ("cli", "cluster")
"""The command line, and what runs its commands elsewhere."""

POSITIONAL = ("output",)
"""Settings of the library whose commands have no option for them; others have one of that name."""

OPTION = re.compile(r"(?<![-\w(])--[a-z][a-z-]+(?![\w-]*:)")


def options_named(source: str) -> Iterator[str]:
    """The options of the command line in the texts of a program."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from OPTION.findall(node.value)


def test_the_search_finds_options_in_every_kind_of_text() -> None:
    assert list(options_named('def f():\n    """See --grid."""\n    return f"--real {1}", "a--b"')) == [
        "--grid",
        "--real",
    ]


def test_settings_in_messages_become_options_too() -> None:
    error = SettingError("calibration", "none given", "by `calibration`, or `nominal` to accept it")
    assert str(as_option(error)).endswith("by --calibration, or --nominal to accept it")
    assert in_options("x: no frame rate, `fps` N says it; `lone` stays") == (
        "x: no frame rate, --fps N says it; `lone` stays"
    )


def test_no_option_is_named_outside_of_the_command_line() -> None:
    named = {
        str(path.relative_to(PACKAGE)): found
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).parts[0] not in SPEAKS_OPTIONS
        and (found := list(options_named(path.read_text())))
    }
    assert named == {}


def settings_named(source: str) -> Iterator[str]:
    """The settings that a program's errors name, and those in backquotes that its texts do."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "SettingError":
            if isinstance(node.args[0], ast.Constant):
                yield from str(node.args[0].value).split(", ")
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "setting":
            yield from re.findall(r"`(\w+)`", ast.unparse(node))


def options_of(parser: argparse.ArgumentParser) -> Iterator[str]:
    """The options of a command and of those below it."""
    for action in parser._actions:
        yield from action.option_strings
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from options_of(below)


@cache
def all_options() -> frozenset[str]:
    return frozenset(option for name in COMMANDS for option in options_of(command_parser(name)))


def test_every_setting_that_an_option_is_called_like_becomes_it() -> None:
    for path in PACKAGE.rglob("*.py"):
        if "cli" in path.relative_to(PACKAGE).parts:
            continue
        for name in settings_named(path.read_text()):
            option = f"--{name.replace('_', '-')}"
            if option in all_options() and name not in POSITIONAL:
                assert in_options(f"`{name}`") == option, path


def test_every_option_behind_a_setting_is_there() -> None:
    assert set(OPTIONS.values()) <= all_options()


@pytest.mark.parametrize(
    ("function", "names"),
    [
        (mvcodec.open, {"on_error", "matcher", "synthesizer"}),
        (mvcodec.Decoder, {"on_error", "matcher", "threads"}),
        (mvcodec.Decoder.open, {"frames"}),
        (mvcodec.McapWriter, {"chunk_ms"}),
        (mvcodec.open_input, {"grid", "real"}),
        (mvcodec.encode, {"fps"}),
    ],
)
def test_what_the_library_and_the_command_line_share_has_one_name(
    function: Callable[..., object], names: set[str]
) -> None:
    assert names <= set(inspect.signature(function).parameters)
    assert all(OPTIONS[name] == f"--{name.replace('_', '-')}" for name in names)


@pytest.mark.parametrize(
    ("setting", "option"),
    [
        ("qp", "--qp"),
        ("bitrate_kbps", "--bitrate"),
        ("synthesizer dils:alpha", "--synthesizer dils:alpha"),
        ("matcher blocks:size", "--matcher blocks:size"),
        ("host, port", "--host, --port"),
        ("--topics", "--topics"),
        ("OUT", "OUT"),
        ("JointSettings.jump", "JointSettings.jump"),
    ],
)
def test_the_command_line_names_the_option_instead(setting: str, option: str) -> None:
    assert str(as_option(SettingError(setting, 1, "2"))) == f"{option}: found 1, expected 2"

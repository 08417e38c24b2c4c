"""The library speaks of settings; only the command line of options."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import mvcodec
from mvcodec.cli.arguments import as_option, in_options
from mvcodec.errors import SettingError

PACKAGE = Path(mvcodec.__file__).parent
SPEAKS_OPTIONS = ("cli", "cluster")
"""The command line, and what runs its commands elsewhere."""

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

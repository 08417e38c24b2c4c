"""Pages written from the program itself: commands from their parsers, settings from their fields.

A hook of MkDocs (see mkdocs.yml). The line `<!-- commands -->` becomes a section for each command, and
`<!-- settings mvcodec.X -->` a table of the settings of a class.
"""

from __future__ import annotations

import argparse
import re
from functools import partial
from typing import Any

import mvcodec
from mvcodec.cli.main import COMMANDS, command_parser
from mvcodec.settings import settings_of, show

MARK = "<!-- commands -->"
SETTINGS = re.compile(r"<!-- settings mvcodec\.(\w+) -->")
USAGE_WIDTH = 76


def on_page_markdown(markdown: str, **_: Any) -> str:
    """What MkDocs calls for each page: its text, with commands and settings in place of their marks."""
    if MARK in markdown:
        markdown = markdown.replace(MARK, commands_text())
    return SETTINGS.sub(lambda mark: settings_text(getattr(mvcodec, mark[1])), markdown)


def settings_text(cls: type) -> str:
    """A table of the settings of a class: name, default, what is allowed, and what it means."""
    rows = [
        f"| `{name}` | {'' if known.default is None else f'`{show(known.default)}`'}"
        f" | {_cell(known.allowed)} | {_cell(_sentence(known.help))} |"
        for name, known in settings_of(cls).items()
    ]
    return "\n".join(["| setting | default | allowed | meaning |", "|---|---|---|---|", *rows])


def commands_text() -> str:
    """A section for each command: purpose, usage, and a table of what it takes."""
    return "\n\n".join(command_text(name, command_parser(name)) for name in COMMANDS)


def command_text(name: str, parser: argparse.ArgumentParser, heading: str = "##") -> str:
    """The section of one command, with one for each command below it, if there are."""
    parser.formatter_class = partial(argparse.HelpFormatter, width=USAGE_WIDTH)
    lines = [f"{heading} mvcodec {name}", "", _sentence(parser.description or ""), "", "```text"]
    lines += [parser.format_usage().removeprefix("usage: ").rstrip(), "```", ""]
    below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    rows = [action for action in parser._actions if action.dest != "help" and action not in below]
    if rows:
        lines += ["| argument | meaning |", "|---|---|"]
        lines += [f"| {_names(action)} | {_help(action, parser)} |" for action in rows]
    for action in below:
        for word, inner in action.choices.items():
            lines += ["", command_text(f"{name} {word}", inner, f"{heading}#")]
    return "\n".join(lines)


def _names(action: argparse.Action) -> str:
    """`--codec h264|hevc`, `--json`, `IN.mcap`; what stands in a table's cell."""
    value = action.metavar or ("|".join(map(str, action.choices)) if action.choices else action.dest)
    if not action.option_strings:
        return f"`{_cell(str(value))}`"
    takes = "" if action.nargs == 0 else f" {value}"
    return "<br>".join(f"`{option}{_cell(takes)}`" for option in action.option_strings)


def _help(action: argparse.Action, parser: argparse.ArgumentParser) -> str:
    text = (action.help or "") % {**vars(action), "prog": parser.prog}
    # Names in angle or square brackets and stars are meant as they stand.
    for sign in "\\*_<[":
        text = text.replace(sign, f"\\{sign}")
    return _cell(_sentence(text))


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}" if text else ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")

"""The page of the command line, written from the parsers themselves: a hook of MkDocs (see mkdocs.yml).

In docs/command-line.md the line `<!-- commands -->` becomes a section for each command.
"""

from __future__ import annotations

import argparse
from functools import partial
from typing import TYPE_CHECKING, Any

from mvcodec.cli.main import COMMANDS, command_parser

if TYPE_CHECKING:
    from mkdocs.structure.pages import Page

MARK = "<!-- commands -->"
PAGE = "command-line.md"
USAGE_WIDTH = 76


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """What MkDocs calls for each page: its text, with the commands in place of the mark."""
    return markdown.replace(MARK, commands_text()) if page.file.src_uri == PAGE else markdown


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

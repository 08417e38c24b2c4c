"""The documents: every page is in the site, what is cited exists, and the command line's page is true."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

import command_pages
import docstring_names
import pytest

from mvcodec.cli.main import COMMANDS, command_parser

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
CITING = ("*.md", "*.toml", "*.yml", "Makefile", ".ci/run", "docs/*.md")
CODE = ("mvcodec", "tools", "tests", "benchmarks", "examples")
URL = re.compile(r"https?://\S+")
DOCUMENT = re.compile(r"[\w./-]*\w\.md\b")
FILE = re.compile(r"`((?:mvcodec|tools|tests|benchmarks|examples|samples|docs)/[\w./-]*)`")


def citing_files() -> list[Path]:
    """Every file of the project that may cite a document."""
    texts = [path for pattern in CITING for path in ROOT.glob(pattern)]
    return texts + [path for folder in CODE for path in (ROOT / folder).rglob("*.py")]


def missing_documents(path: Path) -> set[str]:
    """Names of documents in the text of a file that lie neither beside it, nor in docs/, nor in the root."""
    names = set(DOCUMENT.findall(URL.sub("", path.read_text("utf-8"))))
    return {name for name in names if not any((at / name).is_file() for at in (ROOT, DOCS, path.parent))}


def test_every_document_that_is_cited_exists() -> None:
    missing = {str(path.relative_to(ROOT)): missing_documents(path) for path in citing_files()}
    assert {name: names for name, names in missing.items() if names} == {}


def test_a_document_that_is_not_there_is_found_missing(tmp_path: Path) -> None:
    absent = "NOWHERE" + ".md"
    (tmp_path / "x.py").write_text(f'"""See FORMAT.md, {absent} and https://example.org/{absent}."""')
    assert missing_documents(tmp_path / "x.py") == {absent}


@pytest.mark.parametrize("path", [*DOCS.glob("*.md"), ROOT / "README.md"], ids=lambda path: path.name)
def test_files_that_a_document_names_exist(path: Path) -> None:
    named = FILE.findall(path.read_text("utf-8"))
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_every_page_is_in_the_site() -> None:
    listed = re.findall(r"^  - [^:]+: (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(path.name for path in DOCS.glob("*.md"))


def test_twenty_tasks_say_where_they_begin() -> None:
    text = (DOCS / "contributing.md").read_text("utf-8").partition("## Twenty usual tasks")[2]
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", text.partition("\n## ")[0], re.MULTILINE)[1:]
    assert len(rows) == 20
    assert all(FILE.search(files) for _, files in rows)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_page_of_the_command_line_has_every_option_with_its_help(name: str) -> None:
    parser = command_parser(name)
    section = command_pages.command_text(name, parser)
    assert section.startswith(f"## mvcodec {name}\n")
    for action in options_of(parser):
        assert action.help, f"{action.dest} has no help"
        words = action.option_strings or [str(action.metavar).replace("|", "\\|")]
        assert all(f"`{word}" in section for word in words)


def options_of(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Those of a command and of the commands below it, --help aside."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from options_of(below)
        elif action.dest != "help":
            yield action


def test_the_array_folders_of_the_documents_are_read(tmp_path: Path) -> None:
    from mvcodec.capture.manifest import read_manifest

    examples = re.findall(r"```json\n(.*?)```", (DOCS / "array-folders.md").read_text("utf-8"), re.DOTALL)
    assert len(examples) == 3
    for text in examples:
        (tmp_path / "array.json").write_text(text)
        manifest = read_manifest(tmp_path / "array.json")
        assert len(manifest.views) == manifest.rows * manifest.cols


def test_names_that_are_explained_together_are_taken_apart() -> None:
    text = "Args:\n    row, col: the place,\n        in steps.\n    x: one, two: three."
    apart = (
        "Args:\n    row: the place,\n        in steps.\n    col: the place,\n        in steps.\n"
        "    x: one, two: three."
    )
    assert docstring_names.taken_apart(text) == apart

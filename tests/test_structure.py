"""The map of the project is kept true."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]


def listed_files() -> set[str]:
    """The paths that STRUCTURE.md lists, one a line in backquotes."""
    return set(re.findall(r"^- `([^`]+\.py)`: \S", (ROOT / "STRUCTURE.md").read_text(), re.MULTILINE))


def actual_files() -> set[str]:
    folders = ("mvcodec", "benchmarks", "tools", "examples")
    paths = (path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return {str(path) for path in paths if path.name != "__init__.py" or len(path.parts) == 2}


def test_structure_names_every_file_and_no_other() -> None:
    assert actual_files() - listed_files() == set()
    assert listed_files() - actual_files() == set()


def test_a_name_of_a_file_says_which_file_it_is() -> None:
    """Commands have the names of what they call, and the design names three tools after their commands."""
    commands = re.compile(r"mvcodec/cli/|tools/(encode|decode|play)\.py$")
    names = Counter(Path(path).name for path in actual_files() if not commands.match(path))
    assert {name: count for name, count in names.items() if count > 1} == {}

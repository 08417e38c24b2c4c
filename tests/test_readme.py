"""The README is short, and what it says to type works."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from small_arrays import HEIGHT, WIDTH, write_array

import mvcodec
from mvcodec.cli.main import command_parser

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text("utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
COMMANDS = re.findall(r"(?:^    |`)mvcodec ([a-z-]+ [^`#\n]+)", TEXT, re.MULTILINE)


def test_it_is_short() -> None:
    assert len(TEXT.splitlines()) <= 100
    outside = re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL).splitlines()
    assert [line for line in outside if len(line) > 120 and not line.startswith(("    ", "|"))] == []


def test_it_has_ten_lines_of_python() -> None:
    (code,) = PYTHON
    lines = [line for line in code.splitlines() if line and not line.startswith(("import ", "from "))]
    assert len(lines) <= 10


def test_its_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_array(tmp_path / "samples" / "room_2x2", frames=2)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(PYTHON[0], names)
    picture = names["picture"]
    assert getattr(picture, "shape", None) == (HEIGHT, WIDTH, 3)


def test_its_commands_are_understood() -> None:
    assert len(COMMANDS) >= 6
    assert {"encode", "info", "play", "render", "decode"} <= {command.split()[0] for command in COMMANDS}
    for command in COMMANDS:
        name, *arguments = shlex.split(command)
        if name != "COMMAND":
            command_parser(name).parse_args(arguments)


def test_its_links_lead_somewhere() -> None:
    links = re.findall(r"\]\((?!https?://)([^)#]+)", TEXT)
    assert len(links) > 5
    assert [link for link in links if not (ROOT / link).is_file()] == []


def test_its_wheel_has_today_s_version() -> None:
    assert set(re.findall(r"mvcodec-([\d.]+)-py3", TEXT)) == {mvcodec.__version__}
    assert f"## [{mvcodec.__version__}]" in (ROOT / "CHANGELOG.md").read_text("utf-8")

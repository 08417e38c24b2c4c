"""The page in the wheel is the one that its sources make."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from mvcodec.container.limits import DEFAULT_LIMITS

ROOT = Path(__file__).parents[1]
ROOM = ROOT / "web"
BUILT = ROOT / "mvcodec" / "web_player" / "dist"
SOURCES = ("build.mjs", "package.json", "package-lock.json", "tsconfig.json", "src")
"""As in build.mjs."""


def digest_of_sources() -> str:
    found = [
        path for name in SOURCES for path in ((ROOM / name), *(ROOM / name).rglob("*")) if path.is_file()
    ]
    digest = hashlib.sha256()
    for name, path in sorted((path.relative_to(ROOM).as_posix(), path) for path in found):
        digest.update(f"{name}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


def test_the_page_was_built_from_todays_sources() -> None:
    assert (BUILT / "sources.sha256").read_text().strip() == digest_of_sources(), "run `make web`"


def test_the_bundle_asks_nothing_of_the_network_and_evaluates_no_text() -> None:
    script = (BUILT / "player.js").read_text("utf-8")
    assert "new Function(" not in script
    assert "eval(" not in script
    assert "</script" not in script.lower()


def test_the_page_has_each_limit_of_the_python_reader() -> None:
    text = (ROOM / "src" / "container" / "limits.ts").read_text("utf-8")
    found = re.findall(r"(\w+): (\d+)(?: << (\d+))?,", text)
    ours = {
        "max_" + re.sub("([A-Z])", r"_\1", name).lower(): int(number) << int(shift or 0)
        for name, number, shift in found
    }
    assert ours == asdict(DEFAULT_LIMITS)


@pytest.mark.skipif(
    not (ROOM / "node_modules").is_dir(), reason="the page's libraries are not installed (make web)"
)
def test_building_again_gives_the_same_bytes(tmp_path: Path) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    node = shutil.which("node", path=path)
    assert node is not None
    out = tmp_path / "page"
    subprocess.run([node, "build.mjs", "--out", str(out)], cwd=ROOM, check=True)
    for name in sorted(path.name for path in out.iterdir()):
        assert (out / name).read_bytes() == (BUILT / name).read_bytes(), f"{name}: run `make web`"

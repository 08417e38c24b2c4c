"""The documents' page about the player shows it, from any server of files."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser_page import CHROMIUM, NO_CHROMIUM, SCREENSHOTS, pixels_of
from playwright.sync_api import Page, expect
from web_fixtures import Site, serve_folder

pytestmark = [pytest.mark.skipif(CHROMIUM is None, reason=NO_CHROMIUM), pytest.mark.slow]
pytest_plugins = ("web_fixtures",)

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def documents(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("documents") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True)
    yield from serve_folder(folder)


def test_the_page_about_the_player_plays_the_sample(tab: Page, documents: Site) -> None:
    tab.goto(f"{documents.url}/player.html")
    tab.wait_for_function("document.querySelector('mvcodec-player').ready?.then(() => true)")
    assert pixels_of(tab).shape == (360, 640, 3)
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    tab.screenshot(path=SCREENSHOTS / "docs_player.png")
    player = tab.locator("mvcodec-player")
    player.locator(".stage").focus()
    tab.keyboard.press(" ")
    expect(player.locator(".time")).not_to_contain_text("0:00.0 /")

"""Fixtures of the tests in a browser: a coded file, a player that serves it, Chromium and a page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser_page import ARGUMENTS, CHROMIUM
from player_files import Running, encode, playing, write_original
from playwright.sync_api import Browser, Page, sync_playwright


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_original(tmp_path_factory.mktemp("browser") / "original")


@pytest.fixture(scope="module")
def file(original: Path) -> Path:
    return encode(original, original.parent / "room.mcap")


@pytest.fixture(scope="module")
def server(file: Path, original: Path) -> Iterator[Running]:
    with playing(file, "--original", original) as running:
        yield running


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield found
        found.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page whose errors fail the test, and whose requests must stay on this machine."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: troubles.append(request.url) if is_foreign(request.url) else None)
    yield page
    page.close()
    assert troubles == []


def is_foreign(url: str) -> bool:
    return not url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "blob:http://127.0.0.1:"))

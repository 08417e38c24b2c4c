"""Fixtures of the tests in a browser: those of the player, Chromium and a page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser_page import ARGUMENTS, CHROMIUM
from playwright.sync_api import Browser, Page, sync_playwright

pytest_plugins = ("player_fixtures",)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield found
        found.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page whose errors fail the test, and whose requests must stay on this machine. Nothing sways."""
    page = browser.new_page(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: troubles.append(request.url) if is_foreign(request.url) else None)
    yield page
    page.close()
    assert troubles == []


def is_foreign(url: str) -> bool:
    return not url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "blob:http://127.0.0.1:"))

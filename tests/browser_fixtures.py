"""Fixtures of the tests in a browser: those of the player, Chromium and a page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser_page import watched_page
from playwright.sync_api import Browser, Page

pytest_plugins = ("chromium", "player_fixtures")


@pytest.fixture(scope="module")
def page(chromium: Browser) -> Iterator[Page]:
    """One for all tests of a file: to start a page costs more than most of them."""
    yield from watched_page(chromium, 1280, 720)

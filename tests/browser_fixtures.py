"""Fixtures of the tests in a browser: those of the player, Chromium and a page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser_page import watched_page
from playwright.sync_api import Browser, Page

pytest_plugins = ("chromium", "player_fixtures")


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    yield from watched_page(chromium, 1280, 720)
